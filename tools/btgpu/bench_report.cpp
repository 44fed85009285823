// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bench.h"

namespace btgpu::tool {
namespace {

// The figures of a row that not every world has, under their names.
std::vector<std::pair<std::string, std::optional<double>>> optionalFigures(const BenchRow& r) {
  const auto figure = [](const std::optional<long>& v) {
    return v ? std::optional<double>(static_cast<double>(*v)) : std::optional<double>();
  };
  return {{"deviceMs", r.split.deviceMs},
          {"translateMs", r.split.translateMs},
          {"launches", figure(r.counts.launches)},
          {"waits", figure(r.counts.waits)},
          {"manifolds", figure(r.counts.manifolds)},
          {"contacts", figure(r.counts.contacts)},
          {"colours", figure(r.counts.colours)}};
}

bool isTime(const std::string& figure) { return figure == "deviceMs" || figure == "translateMs"; }

const BenchRow* rowOf(const BenchResult& result, const std::string& world) {
  const auto it =
      std::find_if(result.rows.begin(), result.rows.end(), [&](const BenchRow& r) { return r.world == world; });
  return it == result.rows.end() ? nullptr : &*it;
}

const char* onOff(bool on) { return on ? "on" : "off"; }

std::string gpuSplit(const BenchRow& r) {
  std::string text = fmt::format(
      "gpu, ms a step: {:.3f} translation, {:.3f} from the launch to the results, {:.3f} rest\n", *r.split.translateMs,
      *r.split.deviceMs, std::max(0.0, r.msMedian - *r.split.translateMs - *r.split.deviceMs));
  text += fmt::format("  {} launches, {} waits, {} manifolds, {} contacts, {} colours\n", *r.counts.launches,
                      *r.counts.waits, *r.counts.manifolds, *r.counts.contacts, *r.counts.colours);
  text += fmt::format("  {:<30} {:>12} {:>12}\n", "stage (profiled run)", "ms a step", "launches");
  BenchStage sum;
  for (const BenchStage& s : r.stages) {
    text += fmt::format("  {:<30} {:>12.4f} {:>12.1f}\n", s.stage, s.ms, s.launches);
    sum.ms += s.ms;
    sum.launches += s.launches;
  }
  return text + fmt::format("  {:<30} {:>12.4f} {:>12.1f}\n", "all", sum.ms, sum.launches);
}

// A field of a CSV file: device names hold commas.
std::string csvField(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::vector<std::string> stageNames(const BenchResult& result) {
  const BenchRow* gpu = rowOf(result, "gpu");
  std::vector<std::string> names;
  if (gpu) {
    for (const BenchStage& s : gpu->stages) names.push_back(s.stage);
  }
  return names;
}

}  // namespace

std::string toText(const BenchResult& result) {
  const BenchOptions& o = result.options;
  std::string text =
      fmt::format("{}: {} bodies, {} steps, figures of the last {}; sleeping {}, contacts {}, host queries {}\n",
                  result.scene, result.rows.front().bodies, o.steps, o.steps - o.steps / 2, onOff(o.sleeping),
                  onOff(o.contacts), onOff(o.hostQueries));
  text += fmt::format("  {:<8} {:>8} {:>12} {:>12} {:>10} {:>10} {:>10}  {}\n", "world", "bodies", "ms median",
                      "ms p95", "x cpu", "manifolds", "contacts", "device");
  const BenchRow* cpu = rowOf(result, "cpu");
  const auto count = [](const std::optional<long>& v) { return v ? std::to_string(*v) : std::string("-"); };
  for (const BenchRow& r : result.rows) {
    const std::string ratio = cpu ? fmt::format("{:.2f}", cpu->msMedian / r.msMedian) : "-";
    text += fmt::format("  {:<8} {:>8} {:>12.3f} {:>12.3f} {:>10} {:>10} {:>10}  {}\n", r.world, r.bodies, r.msMedian,
                        r.msP95, ratio, count(r.counts.manifolds), count(r.counts.contacts), r.device);
  }
  if (rowOf(result, "bullet3")) {
    text += "  bullet3 never sleeps, has its own friction, restitution and inertia, and planes as boxes\n";
  }
  if (const BenchRow* gpu = rowOf(result, "gpu")) text += gpuSplit(*gpu);
  return text;
}

std::string toJson(const BenchResult& result) {
  nlohmann::json rows = nlohmann::json::array();
  for (const BenchRow& r : result.rows) {
    nlohmann::json stages = nlohmann::json::object();
    for (const BenchStage& s : r.stages) stages[s.stage] = s.ms;
    nlohmann::json row = {{"world", r.world},       {"device", r.device}, {"scene", r.scene}, {"bodies", r.bodies},
                          {"msMedian", r.msMedian}, {"msP95", r.msP95},   {"stages", stages}};
    for (const auto& [name, value] : optionalFigures(r)) {
      if (!value) {
        row[name] = nullptr;
      } else if (isTime(name)) {
        row[name] = *value;
      } else {
        row[name] = static_cast<long>(*value);
      }
    }
    rows.push_back(row);
  }
  const BenchOptions& o = result.options;
  const nlohmann::json json = {{"scene", result.scene},
                               {"steps", o.steps},
                               {"measured", o.steps - o.steps / 2},
                               {"sleeping", o.sleeping},
                               {"contacts", o.contacts},
                               {"hostQueries", o.hostQueries},
                               {"rows", rows}};
  return json.dump(2) + "\n";
}

std::string toCsv(const BenchResult& result) {
  const std::vector<std::string> stages = stageNames(result);
  std::string text = "world,device,scene,bodies,msMedian,msP95";
  for (const auto& figure : optionalFigures(result.rows.front())) text += "," + figure.first;
  for (const auto& stage : stages) text += "," + stage;
  text += "\n";
  for (const BenchRow& r : result.rows) {
    text += fmt::format("{},{},{},{},{:.6g},{:.6g}", r.world, csvField(r.device), csvField(r.scene), r.bodies,
                        r.msMedian, r.msP95);
    for (const auto& figure : optionalFigures(r)) text += figure.second ? fmt::format(",{:.9g}", *figure.second) : ",";
    for (size_t i = 0; i < stages.size(); ++i) text += r.stages.empty() ? "," : fmt::format(",{:.6g}", r.stages[i].ms);
    text += "\n";
  }
  return text;
}

}  // namespace btgpu::tool
