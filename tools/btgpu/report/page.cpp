// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "../compare.h"
#include "page_style.h"
#include "svg_plot.h"

namespace btgpu::tool {
namespace {

std::string section(const char* id, const char* title, const std::string& content) {
  return fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", id, title, content);
}

std::string paragraph(const std::string& html) { return "<p>" + html + "</p>\n"; }

std::vector<std::string> failedChecks(const CompareResult& r) {
  std::vector<std::string> failed;
  for (const Check& c : r.checks) {
    if (!c.pass()) failed.push_back(c.name);
  }
  return failed;
}

std::string verdict(const CompareResult& r) {
  if (!r.compared) return "<p class=\"verdict fail\"><b>Not compared</b> no step ran on a device</p>";
  if (r.pass())
    return fmt::format("<p class=\"verdict pass\"><b>In agreement</b> {} checks passed</p>", r.checks.size());
  std::string names;
  for (const std::string& name : failedChecks(r)) names += (names.empty() ? "" : ", ") + escapeHtml(name);
  return fmt::format("<p class=\"verdict fail\"><b>Not in agreement</b> {} of {} checks failed: {}</p>",
                     failedChecks(r).size(), r.checks.size(), names);
}

std::string fact(const char* name, const std::string& html) {
  return fmt::format("<div><dt>{}</dt><dd>{}</dd></div>", name, html);
}

std::string header(const CompareResult& r) {
  std::string facts = fact("Device", r.device.empty() ? "none" : escapeHtml(r.device));
  facts += fact("Bodies", std::to_string(r.bodies));
  facts += fact("Steps", fmt::format("{}, {} on the device", r.steps, r.deviceSteps));
  if (r.steps > 1 && r.deviceSteps == r.steps) {
    facts +=
        fact("ms a step", fmt::format("btgpu {}, stock {}", htmlNumber(r.gpuMsPerStep), htmlNumber(r.cpuMsPerStep)));
  }
  return fmt::format("<header><p class=\"what\">btgpu compare</p><h1>{}</h1>{}<dl>{}</dl></header>\n",
                     escapeHtml(r.scene), verdict(r), facts);
}

std::string picture(const char* world, const char* cssClass, const Image& image) {
  if (image.rgba.empty()) return "";
  return fmt::format(
      "<figure class=\"picture\"><img alt=\"The world at the end: {0}\" width=\"{1}\" height=\"{2}\" "
      "src=\"data:image/png;base64,{3}\"><figcaption><i class=\"key {4}\"></i>{0}</figcaption></figure>\n",
      world, image.width, image.height, base64(encodePng(image)), cssClass);
}

std::string pictures(const CompareResult& r) {
  const std::string both = picture("btgpu", "gpu", r.report.gpuEnd) + picture("stock", "stock", r.report.stockEnd);
  return section("end", "The end of the run",
                 "<div class=\"pictures\">" + both + "</div>\n" +
                     "<p class=\"note\">Seen from the same place; a body has the same colour on both sides. Piles are "
                     "chaotic: single bodies may lie elsewhere, the pile as a whole may not.</p>");
}

// How much of the limit is used up.
std::string gauge(const Check& c) {
  if (!(c.limit > 0) || !std::isfinite(c.value)) return "";
  const double share = 100 * std::clamp(c.value / c.limit, 0.0, 1.0);
  return fmt::format("<span class=\"gauge\"><span style=\"width:{:.1f}%\"></span></span>", share);
}

std::string checkTable(const CompareResult& r) {
  std::string rows;
  for (const Check& c : r.checks) {
    const Tolerance& t = tolerance(c.name);
    rows += fmt::format(
        "<tr class=\"{}\"><th scope=\"row\"><code>{}</code><span class=\"meaning\">{}</span></th><td "
        "class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"used\">{}</td><td "
        "class=\"outcome\">{}</td></tr>\n",
        c.pass() ? "pass" : "fail", escapeHtml(c.name), escapeHtml(t.meaning), htmlNumber(c.value), htmlNumber(c.limit),
        gauge(c), c.pass() ? "pass" : "FAIL");
  }
  return section("checks", "Checks",
                 "<div class=\"scroll\"><table><thead><tr><th>check</th><th class=\"number\">value</th><th "
                 "class=\"number\">limit</th><th class=\"used\">used</th><th></th></tr></thead><tbody>\n" +
                     rows + "</tbody></table></div>\n");
}

// stock below, wide; btgpu on top, thin: where they agree both can be seen.
Plot plotOf(const char* id, const char* title, const char* unit, const char* note, const Series& s,
            std::vector<double> WorldSeries::*values) {
  return {id, title, unit, note, {{"stock", "stock", &(s.stock.*values)}, {"btgpu", "gpu", &(s.gpu.*values)}}};
}

std::string plots(const CompareResult& r) {
  const Series& s = r.report.series;
  using W = WorldSeries;
  Plot kinetic =
      plotOf("kinetic-energy", "Kinetic energy", "J a body", "Mean of the moving bodies.", s, &W::kineticEnergy);
  Plot total = plotOf("total-energy", "Total energy", "J a body",
                      "Kinetic energy and the height in gravity above the origin.", s, &W::totalEnergy);
  Plot height = plotOf("mean-height", "Mean height", "m", "Of the moving bodies, against gravity.", s, &W::meanHeight);
  total.fromZero = height.fromZero = false;
  const Plot contacts = plotOf("contacts", "Contact points", "", "All points of the contact caches.", s, &W::contacts);
  const Plot depth99 = plotOf("penetration-99", "Penetration, 99th percentile", "m",
                              "99 of 100 contact points are less deep.", s, &W::depth99);
  const Plot deepest =
      plotOf("penetration-deepest", "Penetration, deepest", "m", "The deepest contact point.", s, &W::deepest);
  const Plot residual = plotOf("residual", "Velocity residual of one step", "m/s",
                               "What the contact rows still lack after the solve (rms), both from the same state and "
                               "contacts.",
                               s, &W::residual);
  const Plot pose{"pose",
                  "Pose difference of one step",
                  "",
                  "Between btgpu and stock from the same state: the largest of the bodies without contact, relative "
                  "to size and distance.",
                  {{"btgpu − stock", "gpu", &s.pose}}};
  Plot time = plotOf("step-time", "Time a step", "ms",
                     "By the host's clock; stock is Bullet's single-threaded world. btgpu also copies its contacts "
                     "back to be compared.",
                     s, &W::milliseconds);
  time.cutPeaks = true;
  std::string figures;
  for (const Plot* plot : std::initializer_list<const Plot*>{&kinetic, &total, &height, &contacts, &depth99, &deepest,
                                                             &residual, &pose, &time}) {
    figures += plotFigure(*plot, r.report.timeStep);
  }
  std::string lead;
  if (s.pose.empty()) {
    lead = "<p class=\"missing\">No step ran on the device: there is nothing to plot.</p>\n";
  } else if (static_cast<int>(s.pose.size()) < r.steps) {
    lead = fmt::format("<p class=\"missing\">The first {} of {} steps: then one did not run on the device.</p>\n",
                       s.pose.size(), r.steps);
  }
  return section("plots", "Step by step", lead + "<div class=\"plots\">" + figures + "</div>\n");
}

std::string bar(const char* cssClass, double value, double largest) {
  return fmt::format("<span class=\"bar {}\" style=\"width:{:.2f}%\"></span>", cssClass,
                     largest > 0 ? 100 * value / largest : 0);
}

std::string phaseTable(const StageTimes& times) {
  double largest = 0, gpu = 0, stock = 0;
  for (const Phase& p : times.phases) {
    largest = std::max({largest, p.gpu, p.stock});
    gpu += p.gpu;
    stock += p.stock;
  }
  std::string rows;
  for (const Phase& p : times.phases) {
    rows += fmt::format(
        "<tr><th scope=\"row\">{}</th><td class=\"number\">{}</td><td class=\"number\">{}</td><td "
        "class=\"bars\">{}{}</td></tr>\n",
        p.name, htmlNumber(p.gpu), htmlNumber(p.stock), bar("gpu", p.gpu, largest), bar("stock", p.stock, largest));
  }
  rows += fmt::format(
      "<tr class=\"sum\"><th scope=\"row\">sum</th><td class=\"number\">{}</td><td "
      "class=\"number\">{}</td><td></td></tr>\n",
      htmlNumber(gpu), htmlNumber(stock));
  return "<div class=\"scroll\"><table><thead><tr><th>part of the step</th><th class=\"number\"><i class=\"key "
         "gpu\"></i>btgpu, ms</th><th class=\"number\"><i class=\"key stock\"></i>stock, "
         "ms</th><th></th></tr></thead><tbody>\n" +
         rows + "</tbody></table></div>\n";
}

std::string stageTable(const StageTimes& times) {
  double largest = 0;
  for (const btGpuStageTime& t : times.stages) largest = std::max(largest, t.m_milliseconds);
  std::string rows;
  for (const btGpuStageTime& t : times.stages) {
    rows += fmt::format(
        "<tr><th scope=\"row\"><code>{}</code></th><td class=\"number\">{}</td><td "
        "class=\"number\">{:.1f}</td><td class=\"bars\">{}</td></tr>\n",
        escapeHtml(t.m_stage), htmlNumber(t.m_milliseconds / times.steps),
        static_cast<double>(t.m_launches) / times.steps, bar("gpu", t.m_milliseconds, largest));
  }
  return "<div class=\"scroll\"><table><thead><tr><th>stage of btgpu</th><th class=\"number\">ms</th><th "
         "class=\"number\">launches</th><th></th></tr></thead><tbody>\n" +
         rows + "</tbody></table></div>\n";
}

std::string stages(const CompareResult& r) {
  const StageTimes& times = r.report.stages;
  if (times.stages.empty()) {
    return section("stages", "Stage times", "<p class=\"missing\">No stage ran on a device.</p>\n");
  }
  return section("stages", "Stage times",
                 phaseTable(times) + stageTable(times) +
                     fmt::format("<p class=\"note\">Means of a run of its own over the first {} steps, since timing "
                                 "slows a step. btgpu: time on the device, without what the host does in between; "
                                 "stock: Bullet's own profile zones.</p>\n",
                                 times.steps));
}

std::string fallbacks(const CompareResult& r) {
  if (r.fallbacks.empty()) {
    return section("fallbacks", "What fell back", paragraph("Nothing: everything ran on the device."));
  }
  std::string rows;
  for (const btGpuFallback& f : r.fallbacks) {
    rows += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td class=\"number\">{}</td></tr>\n",
                        escapeHtml(f.m_what), escapeHtml(f.m_reason), f.m_wholeStep ? "the whole step" : "only this",
                        f.m_count);
  }
  return section("fallbacks", "What fell back",
                 "<div class=\"scroll\"><table><thead><tr><th>because of</th><th>why</th><th>ran on the CPU</th><th "
                 "class=\"number\">times</th></tr></thead><tbody>\n" +
                     rows + "</tbody></table></div>\n");
}

}  // namespace

std::string reportPage(const CompareResult& r, const std::string& version) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><meta name=\"color-scheme\" content=\"light dark\">\n"
      "<title>{} – btgpu compare</title>\n<style>{}</style></head>\n<body><main>\n",
      escapeHtml(r.scene), kPageStyle);
  html += header(r) + pictures(r) + checkTable(r) + plots(r) + stages(r) + fallbacks(r);
  return html + fmt::format("<footer>btgpu {}, bits of the end state {:016x}</footer>\n</main></body></html>\n",
                            escapeHtml(version), r.hash);
}

}  // namespace btgpu::tool
