// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Makes tables and plots for docs/performance.md of what benchmarks/run_all.sh measured.
//   btgpu_bench_tables FOLDER
// reads every .json file in the folder (of `btgpu bench`, or of Google Benchmark) and writes tables.md beside them, and
// a plot for each file of `btgpu bench` and each scene in it that was run at several sizes.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "../tools/btgpu/report/log_plot.h"

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// A figure that may be missing.
std::string cell(const json& row, const char* name, const char* format) {
  const auto it = row.find(name);
  if (it == row.end() || !it->is_number()) return "";
  return fmt::format(fmt::runtime(format), it->get<double>());
}

const json* rowOf(const json& run, const std::string& world) {
  for (const json& row : run.at("rows")) {
    if (row.at("world") == world) return &row;
  }
  return nullptr;
}

std::string worldCell(const json& run, const char* world) {
  const json* row = rowOf(run, world);
  return row ? fmt::format("{:.3g} ({:.3g})", row->at("msMedian").get<double>(), row->at("msP95").get<double>()) : "";
}

std::string stepsTable(const json& runs) {
  std::string text =
      "| scene | size | bodies | manifolds | contacts | btgpu, ms (p95) | stock | bullet3 | times stock's speed | "
      "translation | device | rest | launches | waits | bytes a body "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|"
      "---|---|---|\n";
  for (const json& run : runs) {
    if (run.at("rows").empty()) continue;
    const json* gpu = rowOf(run, "gpu");
    const json& row = gpu ? *gpu : run.at("rows")[0];
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} |", run.at("scene").get<std::string>(),
                        run.at("size").get<std::string>(), row.at("bodies").get<long>(),
                        cell(row, "manifolds", "{:.0f}"), cell(row, "contacts", "{:.0f}"), worldCell(run, "gpu"),
                        worldCell(run, "cpu"), worldCell(run, "bullet3"));
    const json none = json::object();
    const json& own = gpu ? *gpu : none;
    text += fmt::format(" {} | {} | {} | {} | {} | {} | {} |\n", cell(own, "timesCpu", "{:.2f}"),
                        cell(own, "translateMs", "{:.3g}"), cell(own, "deviceMs", "{:.3g}"),
                        cell(own, "restMs", "{:.3g}"), cell(own, "launches", "{:.0f}"), cell(own, "waits", "{:.0f}"),
                        cell(own, "deviceBytesPerBody", "{:.0f}"));
  }
  return text;
}

// Stages down, runs across.
std::string stagesTable(const json& runs) {
  std::vector<const json*> timed;
  std::set<std::string> stages;
  for (const json& run : runs) {
    const json* gpu = rowOf(run, "gpu");
    if (!gpu || gpu->at("stages").empty()) continue;
    timed.push_back(&run);
    for (const auto& [stage, ms] : gpu->at("stages").items()) stages.insert(stage);
  }
  if (timed.empty()) return "";
  std::string text = "\n| stage, ms a step |", line = "|---|";
  for (const json* run : timed) {
    text += fmt::format(" {} {} |", run->at("scene").get<std::string>(), run->at("size").get<std::string>());
    line += "---|";
  }
  text += "\n" + line + "\n";
  for (const auto& stage : stages) {
    text += "| `" + stage + "` |";
    for (const json* run : timed) text += " " + cell(rowOf(*run, "gpu")->at("stages"), stage.c_str(), "{:.3g}") + " |";
    text += "\n";
  }
  return text;
}

std::string notes(const json& runs) {
  std::string text;
  for (const json& run : runs) {
    const std::string name = run.at("scene").get<std::string>() + " " + run.at("size").get<std::string>();
    const std::string error = run.at("error").get<std::string>();
    if (!error.empty()) text += fmt::format("- {}: {}\n", name, error);
    for (const json& reason : run.at("leftOut")) text += fmt::format("- {}: {}\n", name, reason.get<std::string>());
  }
  return text.empty() ? text : "\n" + text;
}

// Milliseconds over bodies, a line a world, for each scene with several sizes. Returns the links.
std::string plots(const fs::path& folder, const std::string& stem, const json& runs) {
  std::map<std::string, std::map<std::string, std::vector<btgpu::LogPoint>>> scenes;
  for (const json& run : runs) {
    for (const json& row : run.at("rows")) {
      scenes[run.at("scene")][row.at("world")].push_back({row.at("bodies"), row.at("msMedian")});
    }
  }
  std::string links;
  for (const auto& [scene, worlds] : scenes) {
    std::vector<btgpu::LogLine> lines;
    size_t most = 0;
    for (const auto& [world, points] : worlds) {
      lines.push_back({world == "cpu" ? "stock" : world == "gpu" ? "btgpu" : world, points});
      most = std::max(most, points.size());
    }
    if (most < 2) continue;
    const std::string file = fs::path(stem + "-" + scene).filename().string() + ".svg";
    std::ofstream(folder / file) << btgpu::logPlot(scene + ": ms a step over bodies", "bodies", "ms a step", lines);
    links += fmt::format("![{}]({})\n", scene, file);
  }
  return links.empty() ? links : "\n" + links;
}

std::string benchText(const fs::path& folder, const std::string& stem, const json& file) {
  const json& runs = file.at("runs");
  std::string text = fmt::format("## {}\n\n", stem);
  std::string device;
  for (const json& run : runs) {
    const json* gpu = rowOf(run, "gpu");
    if (gpu) device = gpu->at("device").get<std::string>() + " (" + gpu->at("driver").get<std::string>() + ")";
  }
  const auto onOff = [&runs](const char* name) { return !runs.empty() && runs[0].at(name) == true ? "on" : "off"; };
  text += fmt::format(
      "btgpu {} on {}; host {}, {} threads. Median ms a step of the second half of the steps, 95th percentile in "
      "brackets; sleeping {}, contacts {}, host queries {}.\n\n",
      file.at("version").get<std::string>(), device.empty() ? "no device" : device,
      file.at("processor").get<std::string>(), file.at("threads").get<int>(), onOff("sleeping"), onOff("contacts"),
      onOff("hostQueries"));
  return text + stepsTable(runs) + stagesTable(runs) + notes(runs) + plots(folder, stem, runs);
}

// Of Google Benchmark, with the counters of primitives.cpp and stages.cpp.
std::string microText(const std::string& stem, const json& file) {
  std::string text = fmt::format("## {}\n\n", stem);
  const json& context = file.at("context");
  if (context.contains("device")) {
    text += fmt::format("{}; copies {} GB/s (read and write), {} GFLOP/s in fused multiply-adds.\n\n",
                        context.at("device").get<std::string>(), context.at("copyGBs").get<std::string>(),
                        context.at("gflops").get<std::string>());
  }
  text +=
      "| benchmark | time, us | bytes touched, MB | GB/s | flops a byte | of the roof, % "
      "|\n|---|---|---|---|---|---|\n";
  for (const json& b : file.at("benchmarks")) {
    std::string name = b.at("name").get<std::string>();
    name = name.substr(0, std::min(name.find("/iterations:"), name.find("/manual_time")));
    if (b.contains("error_occurred") && b.at("error_occurred") == true) {
      text += fmt::format("| {} | {} | | | | |\n", name, b.value("error_message", std::string()));
      continue;
    }
    static const std::map<std::string, double> units = {{"ns", 1e-3}, {"us", 1}, {"ms", 1e3}, {"s", 1e6}};
    const double us = b.at("real_time").get<double>() * units.at(b.at("time_unit").get<std::string>());
    text += fmt::format("| {} | {:.4g} | {} | {} | {} | {} |\n", name, us,
                        b.value("MB", 0.0) > 0 ? cell(b, "MB", "{:.4g}") : std::string(), cell(b, "GB/s", "{:.4g}"),
                        cell(b, "flops/B", "{:.2g}"), cell(b, "roof%", "{:.3g}"));
  }
  return text;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2 || !fs::is_directory(arguments[1])) {
    std::fprintf(stderr, "usage: %s FOLDER\n", arguments[0]);
    return 2;
  }
  const fs::path folder = arguments[1];
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::string text = fmt::format("# {}\n\nMade by benchmarks/run_all.sh; raw figures beside this file.\n",
                                 fs::canonical(folder).filename().string());
  bool complete = true;
  for (const fs::path& path : files) {
    try {
      const json file = json::parse(std::ifstream(path));
      const std::string stem = path.stem().string();
      text += "\n" + (file.contains("runs") ? benchText(folder, stem, file) : microText(stem, file));
    } catch (const std::exception& e) {
      std::fprintf(stderr, "%s: %s\n", path.c_str(), e.what());
      complete = false;
    }
  }
  std::ofstream out(folder / "tables.md");
  out << text;
  return out.flush() && complete ? 0 : 1;
}
