// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "bench.h"
#include "btgpu_version.h"
#include "compat/solver_choice.h"

namespace btgpu::tool {
namespace {

// The figures of a row that not every world has, under their names.
std::vector<std::pair<std::string, std::optional<double>>> optionalFigures(const BenchRow& r) {
  const auto figure = [](const std::optional<long>& v) {
    return v ? std::optional<double>(static_cast<double>(*v)) : std::optional<double>();
  };
  std::optional<double> bytesPerBody;
  if (r.counts.deviceBytes) bytesPerBody = static_cast<double>(*r.counts.deviceBytes) / std::max(1, r.bodies);
  const auto ofEnd = [&r](double EndFigures::*member) {
    return r.end ? std::optional<double>((*r.end).*member) : std::nullopt;
  };
  return {{"deviceMs", r.split.deviceMs},
          {"translateMs", r.split.translateMs},
          {"restMs", r.restMs},
          {"launches", figure(r.counts.launches)},
          {"waits", figure(r.counts.waits)},
          {"manifolds", figure(r.counts.manifolds)},
          {"contacts", figure(r.counts.contacts)},
          {"colours", figure(r.counts.colours)},
          {"deviceBytes", figure(r.counts.deviceBytes)},
          {"deviceBytesPerBody", bytesPerBody},
          {"meanHeight", ofEnd(&EndFigures::meanHeight)},
          {"kineticEnergy", ofEnd(&EndFigures::kineticEnergy)}};
}

bool isCount(const std::string& figure) {
  for (const char* other : {"deviceBytesPerBody", "meanHeight", "kineticEnergy"}) {
    if (figure == other) return false;
  }
  return figure.find("Ms") == std::string::npos;
}

const BenchRow* rowOf(const BenchResult& result, const std::string& world) {
  const auto it =
      std::find_if(result.rows.begin(), result.rows.end(), [&](const BenchRow& r) { return r.world == world; });
  return it == result.rows.end() ? nullptr : &*it;
}

const char* onOff(bool on) { return on ? "on" : "off"; }

std::string gpuSplit(const BenchRow& r) {
  std::string text =
      fmt::format("gpu, ms a step: {:.3f} translation, {:.3f} from the launch to the results, {:.3f} rest\n",
                  *r.split.translateMs, *r.split.deviceMs, *r.restMs);
  text += fmt::format("  {} launches, {} waits, {} manifolds, {} contacts, {} colours\n", *r.counts.launches,
                      *r.counts.waits, *r.counts.manifolds, *r.counts.contacts, *r.counts.colours);
  if (r.counts.deviceBytes) {
    text += fmt::format("  {:.1f} MB of arrays on the device, {:.0f} bytes a body\n",
                        static_cast<double>(*r.counts.deviceBytes) / 1e6,
                        static_cast<double>(*r.counts.deviceBytes) / std::max(1, r.bodies));
  }
  if (r.stages.empty()) return text;
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

// Of all runs, in the order of their numbers.
std::set<std::string> stageNames(const std::vector<BenchResult>& results) {
  std::set<std::string> names;
  for (const BenchResult& result : results) {
    for (const BenchRow& row : result.rows) {
      for (const BenchStage& s : row.stages) names.insert(s.stage);
    }
  }
  return names;
}

std::optional<double> timesCpu(const BenchResult& result, const BenchRow& row) {
  const BenchRow* cpu = rowOf(result, "cpu");
  return cpu ? std::optional<double>(cpu->msMedian / row.msMedian) : std::nullopt;
}

std::string processorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

nlohmann::json rowJson(const BenchResult& result, const BenchRow& r) {
  nlohmann::json stages = nlohmann::json::object(), launches = nlohmann::json::object();
  for (const BenchStage& s : r.stages) {
    stages[s.stage] = s.ms;
    launches[s.stage] = s.launches;
  }
  const auto ratio = timesCpu(result, r);
  nlohmann::json row = {{"world", r.world}, {"device", r.device}, {"driver", r.driver},
                        {"scene", r.scene}, {"bodies", r.bodies}, {"msMedian", r.msMedian},
                        {"msP95", r.msP95}, {"stages", stages},   {"stageLaunches", launches}};
  row["timesCpu"] = ratio ? nlohmann::json(*ratio) : nlohmann::json(nullptr);
  for (const auto& [name, value] : optionalFigures(r)) {
    if (!value) {
      row[name] = nullptr;
    } else if (isCount(name)) {
      row[name] = static_cast<long>(*value);
    } else {
      row[name] = *value;
    }
  }
  return row;
}

nlohmann::json runJson(const BenchResult& result) {
  nlohmann::json rows = nlohmann::json::array();
  for (const BenchRow& r : result.rows) rows.push_back(rowJson(result, r));
  const BenchOptions& o = result.options;
  return {{"scene", result.scene},
          {"size", result.size},
          {"steps", o.steps},
          {"measured", o.steps - o.steps / 2},
          {"timeStep", o.timeStep},
          {"solver", nameOf(o.solver)},
          {"sleeping", o.sleeping},
          {"watchSleepers", o.watchSleepers},
          {"contacts", o.contacts},
          {"hostQueries", o.hostQueries},
          {"motionStates", o.motionStates},
          {"rows", rows},
          {"leftOut", result.leftOut},
          {"error", result.error}};
}

}  // namespace

std::string toText(const BenchResult& result) {
  const BenchOptions& o = result.options;
  if (result.rows.empty()) return fmt::format("{} {}: not measured\n", result.scene, result.size);
  std::string text = fmt::format(
      "{}: {} bodies, {} steps, figures of the last {}; solver {}, sleeping {}, contacts {}, host queries {}, motion "
      "states {}\n",
      result.scene, result.rows.front().bodies, o.steps, o.steps - o.steps / 2, nameOf(o.solver),
      o.watchSleepers ? onOff(o.sleeping) : "unwatched", onOff(o.contacts), onOff(o.hostQueries),
      onOff(o.motionStates));
  text += fmt::format("  {:<8} {:>8} {:>12} {:>12} {:>10} {:>10} {:>10}  {}\n", "world", "bodies", "ms median",
                      "ms p95", "x cpu", "manifolds", "contacts", "device");
  const auto count = [](const std::optional<long>& v) { return v ? std::to_string(*v) : std::string("-"); };
  for (const BenchRow& r : result.rows) {
    const auto times = timesCpu(result, r);
    const std::string ratio = times ? fmt::format("{:.2f}", *times) : "-";
    text += fmt::format("  {:<8} {:>8} {:>12.3f} {:>12.3f} {:>10} {:>10} {:>10}  {}\n", r.world, r.bodies, r.msMedian,
                        r.msP95, ratio, count(r.counts.manifolds), count(r.counts.contacts), r.device);
  }
  for (const BenchRow& r : result.rows) {
    if (!r.end) continue;
    text += fmt::format("  {} at the end: mean height {:.3f}, kinetic energy {:.4g} J a body\n", r.world,
                        r.end->meanHeight, r.end->kineticEnergy);
  }
  if (rowOf(result, "bullet3")) {
    text += "  bullet3 never sleeps, has its own friction, restitution and inertia, and planes as boxes\n";
  }
  if (const BenchRow* gpu = rowOf(result, "gpu")) text += gpuSplit(*gpu);
  return text;
}

std::string toTable(const std::vector<BenchResult>& results) {
  std::string text = fmt::format("{:<14} {:<11} {:>9} {:>10} {:>10}  {:<8} {:>11} {:>11} {:>7}\n", "scene", "size",
                                 "bodies", "manifolds", "contacts", "world", "ms median", "ms p95", "x cpu");
  const auto count = [](const std::optional<long>& v) { return v ? std::to_string(*v) : std::string("-"); };
  for (const BenchResult& result : results) {
    for (const BenchRow& r : result.rows) {
      const auto times = timesCpu(result, r);
      text += fmt::format("{:<14} {:<11} {:>9} {:>10} {:>10}  {:<8} {:>11.3f} {:>11.3f} {:>7}\n", result.scene,
                          result.size, r.bodies, count(r.counts.manifolds), count(r.counts.contacts), r.world,
                          r.msMedian, r.msP95, times ? fmt::format("{:.2f}", *times) : "-");
    }
    if (!result.error.empty()) text += fmt::format("{:<14} {:<11} {}\n", result.scene, result.size, result.error);
    for (const auto& reason : result.leftOut) {
      text += fmt::format("{:<14} {:<11} {}\n", result.scene, result.size, reason);
    }
  }
  return text;
}

std::string toJson(const std::vector<BenchResult>& results) {
  nlohmann::json runs = nlohmann::json::array();
  for (const BenchResult& result : results) runs.push_back(runJson(result));
  const nlohmann::json json = {{"version", BTGPU_VERSION},
                               {"processor", processorName()},
                               {"threads", std::thread::hardware_concurrency()},
                               {"runs", runs}};
  // A file's name may be no UTF-8.
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string toCsv(const std::vector<BenchResult>& results) {
  const std::set<std::string> stages = stageNames(results);
  std::string text = "scene,size,world,device,bodies,steps,msMedian,msP95,timesCpu";
  for (const auto& figure : optionalFigures(BenchRow())) text += "," + figure.first;
  for (const auto& stage : stages) text += "," + stage;
  text += "\n";
  const auto field = [](const std::optional<double>& v) { return v ? fmt::format(",{:.9g}", *v) : std::string(","); };
  for (const BenchResult& result : results) {
    for (const BenchRow& r : result.rows) {
      text += fmt::format("{},{},{},{},{},{},{:.6g},{:.6g}", csvField(r.scene), csvField(result.size), r.world,
                          csvField(r.device), r.bodies, result.options.steps, r.msMedian, r.msP95);
      text += field(timesCpu(result, r));
      for (const auto& figure : optionalFigures(r)) text += field(figure.second);
      for (const auto& stage : stages) {
        const auto it =
            std::find_if(r.stages.begin(), r.stages.end(), [&](const BenchStage& s) { return s.stage == stage; });
        text += field(it == r.stages.end() ? std::nullopt : std::optional<double>(it->ms));
      }
      text += "\n";
    }
  }
  return text;
}

}  // namespace btgpu::tool
