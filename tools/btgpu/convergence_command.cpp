// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "arguments.h"
#include "bullet_file.h"
#include "commands.h"
#include "convergence.h"
#include "progress.h"
#include "report/log_plot.h"

namespace btgpu::tool {
namespace {

struct ConvergenceArguments {
  std::string scene = "stack", size, device, csv, json, svg;
  int steps = 100;
  std::vector<int> iterations = {1, 2, 3, 5, 10, 20, 50, 100};
};

int runConvergence(const ConvergenceArguments& arguments) {
  checkDevice(arguments.device);
  ConvergenceOptions options;
  options.steps = arguments.steps;
  options.device = arguments.device;
  options.iterations = arguments.iterations;
  if (!std::is_sorted(options.iterations.begin(), options.iterations.end())) {
    throw InputError("--iterations: give them in ascending order");
  }
  Builder build;
  if (isBulletFile(arguments.scene)) {
    if (!arguments.size.empty()) throw InputError("--size does not go with a .bullet file: it has its own");
    build = builderOfFile(arguments.scene);
  } else {
    const scenes::Scene& scene = sceneNamed(arguments.scene);
    options.timeStep = scene.timeStep;
    build = builderOf(scene, arguments.size.empty() ? scene.size : parseSize(arguments.size));
  }
  ConvergenceResult result;
  {
    ProgressBar bar(arguments.scene, solvesOf(options));
    options.progress = [&bar](int done) { bar.show(done); };
    result = measureConvergence(arguments.scene, build, options);
  }
  fmt::print("{}", toText(result));
  std::fflush(stdout);
  if (!arguments.csv.empty()) writeFile(arguments.csv, toCsv(result));
  if (!arguments.json.empty()) writeFile(arguments.json, toJson(result));
  if (!arguments.svg.empty()) writeFile(arguments.svg, toSvg(result));
  return result.deviceDifferences == 0 ? kAgreed : kFailed;
}

std::string table(const ConvergenceResult& r, const char* what, std::vector<double> ConvergenceLine::*values) {
  std::string text = fmt::format("  {:<18}", what);
  for (const int i : r.iterations) text += fmt::format(" {:>9}", i);
  text += "\n";
  for (const ConvergenceLine& line : r.lines) {
    text += fmt::format("  {:<18}", line.solver);
    for (const double v : line.*values) text += fmt::format(" {:>9.3g}", v);
    text += "\n";
  }
  return text;
}

}  // namespace

std::string toText(const ConvergenceResult& r) {
  std::string text = fmt::format("{}: {} bodies, step {}, {} contact points, {} joints, on {}\n", r.scene, r.bodies,
                                 r.steps + 1, r.contacts, r.joints, r.device);
  text += table(r, "residual, rms", &ConvergenceLine::residual);
  text += table(r, "distance", &ConvergenceLine::distance);
  if (r.deviceDifferences > 0) {
    text += fmt::format("{} solves did not start from the same contacts: nothing is to be learned from them\n",
                        r.deviceDifferences);
  }
  return text;
}

std::string toCsv(const ConvergenceResult& r) {
  std::string text = "scene,bodies,step,solver,iterations,residual,distance\n";
  for (const ConvergenceLine& line : r.lines) {
    for (size_t i = 0; i < r.iterations.size(); ++i) {
      text += fmt::format("{},{},{},\"{}\",{},{:.6g},{:.6g}\n", r.scene, r.bodies, r.steps + 1, line.solver,
                          r.iterations[i], line.residual[i], line.distance[i]);
    }
  }
  return text;
}

std::string toJson(const ConvergenceResult& r) {
  nlohmann::json lines = nlohmann::json::array();
  for (const ConvergenceLine& line : r.lines) {
    lines.push_back({{"solver", line.solver}, {"residual", line.residual}, {"distance", line.distance}});
  }
  const nlohmann::json json = {
      {"scene", r.scene},    {"device", r.device},         {"bodies", r.bodies},
      {"step", r.steps + 1}, {"contacts", r.contacts},     {"joints", r.joints},
      {"lines", lines},      {"iterations", r.iterations}, {"deviceDifferences", r.deviceDifferences}};
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string toSvg(const ConvergenceResult& r) {
  std::vector<LogLine> lines;
  for (const ConvergenceLine& line : r.lines) {
    lines.push_back({line.solver, {}});
    for (size_t i = 0; i < r.iterations.size(); ++i) {
      lines.back().points.push_back({static_cast<double>(r.iterations[i]), line.residual[i]});
    }
  }
  return logPlot(fmt::format("{}, {} bodies, step {}", r.scene, r.bodies, r.steps + 1), "iterations",
                 "rms velocity error of the rows", lines);
}

Command addConvergenceCommand(CLI::App& tool) {
  const auto arguments = std::make_shared<ConvergenceArguments>();
  CLI::App* command = tool.add_subcommand(
      "convergence", "solve one and the same step with each solver, and show what is left by number of iterations");
  command->add_option("scene", arguments->scene, "built-in scene or .bullet file")->capture_default_str();
  command->add_option("--size", arguments->size, "size of a built-in scene, as X,Y,Z")->check(kNotEmpty);
  command->add_option("--steps", arguments->steps, "steps before the one that is solved")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str();
  command->add_option("--iterations", arguments->iterations, "numbers of iterations, ascending")
      ->delimiter(',')
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  command->add_option("--device", arguments->device, "OpenCL device: index, gpu, cpu or part of its name");
  command->add_option("--csv", arguments->csv, "write the figures to this file")->check(kNotEmpty);
  command->add_option("--json", arguments->json, "write the result to this file")->check(kNotEmpty);
  command->add_option("--svg", arguments->svg, "draw the residuals to this file")->check(kNotEmpty);
  return {command, [arguments] { return runConvergence(*arguments); }};
}

}  // namespace btgpu::tool
