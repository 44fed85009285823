// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The page of btgpu compare --report, as a browser shows it: every plot has both lines where they can be seen, every
// step is in them, nothing is loaded from elsewhere. BTGPU_TOOL is the path of the tool.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/support/browser.h"
#include "tests/support/subprocess.h"
#include "tools/btgpu/compare.h"
#include "tools/btgpu/report/page.h"
#include "tools/btgpu/report/svg_plot.h"

namespace btgpu::test {
namespace {

using nlohmann::json;

constexpr int kWidth = 1280;
const std::vector<std::string> kPlots = {"kinetic-energy", "total-energy",   "mean-height",
                                         "contacts",       "penetration-99", "penetration-deepest",
                                         "residual",       "pose",           "step-time"};
const std::vector<std::string> kSections = {"end", "checks", "plots", "stages", "fallbacks"};

// What the page is made of, as the browser sees it. Added to a copy of the page, which has no script itself.
constexpr const char* kProbe = R"js(<script>
const box = e => { const r = e.getBoundingClientRect(); return [r.x + scrollX, r.y + scrollY, r.width, r.height]; };
const line = (svg, name) => {
  const parts = [...svg.querySelectorAll('.line.' + name + ', .dot.' + name)];
  const points = parts.flatMap(p => p.points ? [...p.points].map(q => [q.x, q.y])
                                             : [[p.cx.baseVal.value, p.cy.baseVal.value]]);
  if (!parts.length) return null;
  const style = getComputedStyle(parts[0]);
  return { points, colour: (parts[0].points ? style.stroke : style.fill).match(/\d+/g).map(Number) };
};
const text = e => e.textContent;
addEventListener('load', () => {
  const probe = document.createElement('pre');
  probe.id = 'probe';
  probe.textContent = JSON.stringify({
    height: document.documentElement.scrollHeight,
    width: document.documentElement.scrollWidth,
    scripts: document.scripts.length - 1,
    title: document.title,
    heading: text(document.querySelector('h1')),
    verdict: text(document.querySelector('.verdict')),
    body: document.body.innerText,
    sections: [...document.querySelectorAll('section')].map(s => s.id),
    plots: Object.fromEntries([...document.querySelectorAll('figure.plot')].map(f => {
      const svg = f.querySelector('svg');
      return [f.id, { box: box(svg), steps: Number(svg.dataset.steps), gpu: line(svg, 'gpu'), stock: line(svg, 'stock'),
        legend: [...f.querySelectorAll('.legend b')].map(text), svg: svg.outerHTML }];
    })),
    pictures: [...document.images].map(i => ({ width: i.naturalWidth, height: i.naturalHeight, box: box(i) })),
    checks: [...document.querySelectorAll('#checks tbody tr')].map(r => [...r.children].map(text)),
    fallbacks: [...document.querySelectorAll('#fallbacks tbody tr')].map(r => [...r.children].map(text)),
    stages: [...document.querySelectorAll('#stages tbody tr')].map(r => [...r.children].map(text)),
    bars: [...document.querySelectorAll('#stages .bar')].map(b => b.getBoundingClientRect().width),
  });
  document.body.append(probe);
});
</script></body>)js";

std::string unescaped(std::string html) {
  const std::pair<const char*, const char*> kNames[] = {{"&lt;", "<"}, {"&gt;", ">"}, {"&amp;", "&"}};
  for (const auto& [from, to] : kNames) {
    for (size_t at = 0; (at = html.find(from, at)) != std::string::npos; at += std::string(to).size()) {
      html.replace(at, std::string(from).size(), to);
    }
  }
  return html;
}

class Report : public testing::Test {
 protected:
  void SetUp() override {
    try {
      browserPath();
    } catch (const std::runtime_error& e) { FAIL() << e.what(); }
  }

  std::string pagePath() const { return m_folder.file("report.html"); }

  // Runs the tool; the page is at pagePath().
  Finished compare(std::vector<std::string> arguments, const RunOptions& options = {}) {
    arguments.insert(arguments.begin(), {BTGPU_TOOL, "compare"});
    arguments.insert(arguments.end(), {"--report", pagePath(), "--json", m_folder.file("result.json")});
    return runProgram(arguments, options);
  }

  json result() const { return json::parse(readFile(m_folder.file("result.json"))); }

  json look(Scheme scheme = Scheme::Light, int width = kWidth) const {
    std::string page = readFile(pagePath());
    const size_t end = page.rfind("</body>");
    if (end == std::string::npos) throw std::runtime_error("the page has no end");
    page.replace(end, 7, kProbe);
    const std::string probed = m_folder.file("probed.html");
    writeFile(probed, page);
    const std::string dom = dumpDom(probed, width, scheme), mark = "<pre id=\"probe\">";
    const size_t from = dom.rfind(mark) + mark.size();
    return json::parse(unescaped(dom.substr(from, dom.rfind("</pre>") - from)));
  }

  // What must be true of every page.
  void expectSound(const json& seen, int steps) {
    EXPECT_EQ(seen.at("sections"), kSections);
    ASSERT_EQ(seen.at("plots").size(), kPlots.size());
    for (const std::string& id : kPlots) {
      SCOPED_TRACE(id);
      const json& plot = seen.at("plots").at(id);
      EXPECT_EQ(plot.at("steps"), steps);
      for (const char* word : {"nan", "inf"}) {
        EXPECT_EQ(plot.at("svg").get<std::string>().find(word), std::string::npos) << word;
      }
    }
    const std::string body = seen.at("body").get<std::string>();
    EXPECT_FALSE(std::regex_search(body, std::regex("\\b-?(nan|inf)\\b"))) << body;
    EXPECT_EQ(seen.at("scripts"), 0);
    ASSERT_EQ(seen.at("pictures").size(), 2u);
    for (const json& picture : seen.at("pictures")) EXPECT_EQ(picture.at("width"), 960) << "not a PNG";

    const std::string page = readFile(pagePath());
    EXPECT_FALSE(
        std::regex_search(page.substr(0, 20000), std::regex("(src|href)=\"(?!data:)|@import|url\\((?!#)|https?:")))
        << "the page wants something from elsewhere";
  }

  TemporaryFolder m_folder;
};

bool near(const std::array<int, 3>& a, const json& colour) {
  int distance = 0;
  for (size_t k = 0; k < 3; ++k) distance = std::max(distance, std::abs(a[k] - colour.at(k).get<int>()));
  return distance <= 24;  // of 255: lines have soft edges
}

// From the first to the last column of the plot in which the colour is seen.
int extentOf(const Screenshot& shot, const json& box, const json& colour) {
  const int x0 = box.at(0).get<int>(), y0 = box.at(1).get<int>();
  const int x1 = std::min(shot.width, x0 + box.at(2).get<int>()), y1 = std::min(shot.height, y0 + box.at(3).get<int>());
  int first = x1, last = x0 - 1;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      if (!near(shot.at(x, y), colour)) continue;
      first = std::min(first, x);
      last = std::max(last, x);
    }
  }
  return std::max(0, last - first + 1);
}

// Both lines of every plot, seen in its rectangle. `share` of the plot's width that they reach across.
void expectLinesVisible(const json& seen, const Screenshot& shot, double share) {
  for (const std::string& id : kPlots) {
    SCOPED_TRACE(id);
    const json& plot = seen.at("plots").at(id);
    const double width = plot.at("box").at(2).get<double>();
    ASSERT_GT(width, 200);
    ASSERT_GT(plot.at("box").at(3).get<double>(), 100);
    for (const char* world : {"gpu", "stock"}) {
      SCOPED_TRACE(world);
      if (id == "pose" && std::string(world) == "stock") continue;  // a difference: one line
      ASSERT_TRUE(plot.at(world).is_object()) << "no line";
      const int extent = extentOf(shot, plot.at("box"), plot.at(world).at("colour"));
      EXPECT_GE(extent, std::max(2.0, share * width));
    }
  }
}

TEST_F(Report, EveryPlotShowsBothWorlds) {
  const Finished run = compare({"stack", "--size", "3,3,3", "--steps", "60"});
  ASSERT_EQ(run.exitCode, 0) << run.out << run.err;
  EXPECT_EQ(run.err, "");
  json colours[2];
  for (const Scheme scheme : {Scheme::Light, Scheme::Dark}) {
    SCOPED_TRACE(scheme == Scheme::Light ? "light" : "dark");
    const json seen = look(scheme);
    expectSound(seen, 60);
    EXPECT_EQ(seen.at("width"), kWidth) << "wider than the window";
    const int height = seen.at("height").get<int>();
    const Screenshot shot = takeScreenshot(pagePath(), kWidth, height, scheme);
    ASSERT_EQ(shot.height, height);
    // The plot area takes 416 of 480 units; of the times, the first may be cut off.
    expectLinesVisible(seen, shot, 0.8);
    for (const std::string& id : kPlots) {
      EXPECT_EQ(seen.at("plots").at(id).at("gpu").at("points").size(), 60u) << id;
      if (id != "pose") { EXPECT_EQ(seen.at("plots").at(id).at("stock").at("points").size(), 60u) << id; }
    }
    const auto page = shot.at(2, 2);
    EXPECT_EQ(page[0] + page[1] + page[2] > 384, scheme == Scheme::Light);
    colours[scheme == Scheme::Dark] = seen.at("plots").at("contacts").at("gpu").at("colour");
  }
  EXPECT_NE(colours[0], colours[1]);

  const json seen = look();
  EXPECT_NE(seen.at("verdict").get<std::string>().find("In agreement"), std::string::npos);
  EXPECT_EQ(seen.at("heading"), "stack");
  EXPECT_EQ(seen.at("checks").size(), result().at("checks").size());
  EXPECT_NE(seen.at("body").get<std::string>().find(result().at("device").get<std::string>()), std::string::npos);
  EXPECT_GE(seen.at("stages").size(), 15u) << "parts of the step, and stages";
  double widest = 0;
  for (const json& bar : seen.at("bars")) widest = std::max(widest, bar.get<double>());
  EXPECT_GT(widest, 100);
}

// The numbers are those of the JSON file: the plots' ends, and btgpu is not taken for stock.
TEST_F(Report, LegendsAreTheFigures) {
  ASSERT_EQ(compare({"stack", "--size", "2,3,2", "--steps", "30"}).exitCode, 0);
  const json seen = look(), figures = result();
  const std::pair<const char*, const char*> kBoth[] = {{"mean-height", "meanHeight"},
                                                       {"kinetic-energy", "kineticEnergy"}};
  for (const auto& [plot, figure] : kBoth) {
    SCOPED_TRACE(plot);
    const json& legend = seen.at("plots").at(plot).at("legend");
    ASSERT_EQ(legend.size(), 2u);
    // Four digits are shown.
    const double gpu = figures.at("gpu").at(figure).get<double>(), stock = figures.at("cpu").at(figure).get<double>();
    EXPECT_NEAR(std::stod(legend[0].get<std::string>()), gpu, 1e-3 * std::fabs(gpu));
    EXPECT_NEAR(std::stod(legend[1].get<std::string>()), stock, 1e-3 * std::fabs(stock));
  }
  // A fall: the first point is the highest on the page, the last lower; time goes to the right.
  const json points = seen.at("plots").at("mean-height").at("gpu").at("points");
  EXPECT_LT(points.front().at(1).get<double>(), points.back().at(1).get<double>());
  EXPECT_LT(points.front().at(0).get<double>(), points.back().at(0).get<double>());
}

TEST_F(Report, OneStep) {
  ASSERT_EQ(compare({"stack", "--size", "2,2,2", "--steps", "1"}).exitCode, 0);
  const json seen = look();
  expectSound(seen, 1);
  expectLinesVisible(seen, takeScreenshot(pagePath(), kWidth, seen.at("height").get<int>()), 0);
}

TEST_F(Report, WithoutContacts) {
  ASSERT_EQ(compare({"spin", "--size", "2,1,2", "--steps", "20"}).exitCode, 0);
  const json seen = look();
  expectSound(seen, 20);
  expectLinesVisible(seen, takeScreenshot(pagePath(), kWidth, seen.at("height").get<int>()), 0.7);
}

TEST_F(Report, OnANarrowScreenNothingIsCutOff) {
  ASSERT_EQ(compare({"stack", "--size", "2,2,2", "--steps", "5"}).exitCode, 0);
  // The narrowest window that Chromium makes is 500 wide.
  EXPECT_LE(look(Scheme::Light, 500).at("width"), 500);
}

TEST_F(Report, SpecialCharactersInTheFileName) {
  // \xff: no UTF-8, which both files have to be.
  const std::string scene = m_folder.file("a<b> & \"c\" 'd' \xff <script>alert(1)<.bullet");
  const std::string shown = std::regex_replace(scene, std::regex("\xff"), "\uFFFD");
  writeFile(scene, readFile(BTGPU_SOURCE_DIR "/samples/scenes/mixed.bullet"));
  const Finished run = compare({scene, "--steps", "3"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const json seen = look();
  expectSound(seen, 3);
  EXPECT_EQ(seen.at("heading"), shown);
  EXPECT_EQ(seen.at("title"), shown + " – btgpu compare");
  EXPECT_EQ(result().at("scene"), shown);
}

TEST_F(Report, NoDevice) {
  const Finished run = compare({"stack", "--size", "2,2,2", "--steps", "5"}, {{"OCL_ICD_VENDORS=/nonexistent"}});
  EXPECT_EQ(run.exitCode, 1);
  const json seen = look();
  expectSound(seen, 0);
  EXPECT_NE(seen.at("verdict").get<std::string>().find("Not compared"), std::string::npos);
  ASSERT_EQ(seen.at("fallbacks").size(), 1u);
  EXPECT_EQ(seen.at("fallbacks")[0][0], "device");
}

// A result made by hand, with all that may be wrong with one.
TEST_F(Report, FailuresAndFiguresThatAreNotFinite) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  tool::CompareResult r;
  r.scene = "</title><b>";
  r.device = "<img src=x onerror=alert(1)> & Co";
  r.bodies = 2;
  r.steps = r.deviceSteps = 5;
  r.checks = {makeCheck("free.position", kNan), makeCheck("free.height", kInf), makeCheck("solver.energy", 0.5),
              makeCheck("sleep.state", 0)};
  r.fallbacks = {{"<i>joints</i>", "a & b", 3}};
  tool::Image image{960, 1, std::vector<std::uint8_t>(960 * 4, 200)};
  r.report.gpuEnd = r.report.stockEnd = image;
  r.report.timeStep = 1.0 / 60;
  for (tool::WorldSeries* s : {&r.report.series.gpu, &r.report.series.stock}) {
    const std::vector<double> values = {1, kNan, 1e300, -kInf, 2};
    s->kineticEnergy = s->totalEnergy = s->meanHeight = s->contacts = s->depth99 = s->deepest = s->residual =
        s->milliseconds = values;
  }
  r.report.series.pose = std::vector<double>(5, kNan);
  writeFile(pagePath(), tool::reportPage(r, "1 < 2"));
  const json seen = look();
  expectSound(seen, 5);
  EXPECT_EQ(seen.at("heading"), r.scene);
  const std::string body = seen.at("body").get<std::string>(), verdict = seen.at("verdict").get<std::string>();
  for (const std::string& text : {r.device, r.fallbacks[0].m_what, r.fallbacks[0].m_reason, std::string("1 < 2")}) {
    EXPECT_NE(body.find(text), std::string::npos) << text;
  }
  EXPECT_NE(verdict.find("Not in agreement"), std::string::npos) << verdict;
  EXPECT_NE(verdict.find("3 of 4"), std::string::npos) << verdict;
  ASSERT_EQ(seen.at("checks").size(), 4u);
  EXPECT_EQ(seen.at("checks")[0][1], "not finite");
  EXPECT_EQ(seen.at("checks")[2].back(), "FAIL");
  EXPECT_EQ(seen.at("checks")[3].back(), "pass");
  EXPECT_EQ(seen.at("plots").at("contacts").at("gpu").at("points").size(), 3u);
  EXPECT_NE(body.find("4 values are not finite"), std::string::npos);
}

// Long runs: fewer points than steps, but no peak is lost.
TEST(Plot, LongRunsKeepTheirPeaks) {
  std::vector<double> values(100'000, 1);
  values[54'321] = 7;
  values[77'777] = -3;
  const std::string html = tool::plotFigure({"id", "Title", "m", "", {{"btgpu", "gpu", &values}}}, 0.01);
  EXPECT_NE(html.find("data-steps=\"100000\""), std::string::npos);
  EXPECT_LT(html.size(), 60'000u);
  const size_t from = html.find("points=\"") + 8;
  std::istringstream points(html.substr(from, html.find('"', from) - from));
  double highest = 1e9, lowest = -1e9;
  for (std::string point; points >> point;) {
    const double y = std::stod(point.substr(point.find(',') + 1));
    highest = std::min(highest, y);
    lowest = std::max(lowest, y);
  }
  // The axis goes from -5 to 10 over 186 units.
  EXPECT_NEAR(lowest - highest, 186.0 * 10 / 15, 0.1);
}

TEST(Plot, Numbers) {
  EXPECT_EQ(tool::htmlNumber(0), "0");
  EXPECT_EQ(tool::htmlNumber(12345), "12345");
  EXPECT_EQ(tool::htmlNumber(12345.6), "12346");
  EXPECT_EQ(tool::htmlNumber(-1.5), "−1.5");
  EXPECT_EQ(tool::htmlNumber(1.234e-7), "1.234×10<sup>−7</sup>");
  EXPECT_EQ(tool::htmlNumber(2e12), "2×10<sup>12</sup>");
  EXPECT_EQ(tool::htmlNumber(std::nan("")), "not finite");
  EXPECT_EQ(tool::escapeHtml("a<b>&\"'\n"), "a&lt;b&gt;&amp;&quot;&#39;\uFFFD");
}

}  // namespace
}  // namespace btgpu::test
