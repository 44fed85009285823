// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "arguments.h"
#include "bisect.h"
#include "btgpu_version.h"
#include "bullet_file.h"
#include "commands.h"
#include "compare.h"
#include "progress.h"
#include "report/page.h"
#include "stage_hashes.h"

namespace btgpu::tool {
namespace {

struct CompareArguments {
  std::string scene, size, device, hostStages, json, report, stageHashes;
  btGpuSolver solver = btGpuSolver::Parity;
  int steps = 0;
  bool hash = false, profile = false, bisect = false;
};

// A world that gets no device says so itself, on stderr.
bool worldNamedCause(const CompareResult& result) {
  return std::any_of(result.fallbacks.begin(), result.fallbacks.end(),
                     [](const btGpuFallback& f) { return f.m_what == "device"; });
}

// Of the last step, in which all before it shows.
std::unique_ptr<StageHashFile> stageHashes(const CompareArguments& arguments, int steps) {
  if (!arguments.stageHashes.empty()) return std::make_unique<StageHashFile>(arguments.stageHashes);
  if (arguments.hash) return std::make_unique<StageHashFile>(steps - 1);
  return nullptr;
}

void printHashes(const StageHashFile& stages, const CompareResult& result) {
  for (const auto& [stage, hash] : stages.ofStep(result.steps - 1)) fmt::print("hash {} {}\n", stage, hash);
  fmt::print("hash {:016x}\n", result.hash);
}

int reportComparison(const CompareArguments& arguments, const CompareResult& result) {
  fmt::print("{}", toText(result));
  if (!arguments.json.empty()) writeFile(arguments.json, toJson(result));
  if (!arguments.report.empty()) writeFile(arguments.report, reportPage(result, BTGPU_VERSION));
  if (!result.compared && !worldNamedCause(result)) {
    fmt::print(stderr, "btgpu: not compared: no step ran on a device; the lines 'on the CPU' say why\n");
  }
  std::fflush(stdout);
  return result.pass() ? kAgreed : kFailed;
}

int runBisection(const std::string& name, const Builder& build, CompareOptions options) {
  BisectResult result;
  {
    ProgressBar bar(name, options.steps);
    options.progress = [&bar](int done) { bar.show(done); };
    result = bisect(name, build, options);
  }
  fmt::print("{}", toText(result));
  std::fflush(stdout);
  return result.pass() ? kAgreed : kFailed;
}

int runComparison(const CompareArguments& arguments, const std::string& name, const Builder& build,
                  const scenes::Expectations& expectations, double timeStep, int defaultSteps) {
  checkDevice(arguments.device);
  CompareOptions options;
  options.timeStep = timeStep;
  options.steps = arguments.steps > 0 ? arguments.steps : defaultSteps;
  options.device = arguments.device;
  options.solver = arguments.solver;
  options.hostStages = arguments.hostStages;
  options.profile = arguments.profile;
  options.report = !arguments.report.empty();
  if (arguments.bisect) return runBisection(name, build, options);
  const auto hashes = stageHashes(arguments, options.steps);
  CompareResult result;
  {
    ProgressBar bar(name, options.steps);
    options.progress = [&bar](int done) { bar.show(done); };
    result = compare(name, build, expectations, options);
  }
  const int status = reportComparison(arguments, result);
  if (arguments.hash) printHashes(*hashes, result);
  std::fflush(stdout);
  return status;
}

int compareBuiltIn(const CompareArguments& arguments) {
  const scenes::Scene& scene = sceneNamed(arguments.scene);
  const scenes::Size size = arguments.size.empty() ? scene.size : parseSize(arguments.size);
  return runComparison(arguments, scene.name, builderOf(scene, size), scene.expectations, scene.timeStep, scene.steps);
}

// Of a file nothing is known: whether it comes to rest is seen in stock, and what the CPU does in the device's steps is
// listed.
scenes::Expectations unknownScene() {
  scenes::Expectations expectations;
  expectations.comesToRest = scenes::Rest::AsStock;
  expectations.cpuShares = {"*"};
  return expectations;
}

int compareFile(const CompareArguments& arguments) {
  if (!arguments.size.empty()) throw InputError("--size does not go with a .bullet file: it has its own");
  constexpr int kSteps = 300;
  constexpr double kTimeStep = 1.0 / 60.0;
  return runComparison(arguments, arguments.scene, builderOfFile(arguments.scene), unknownScene(), kTimeStep, kSteps);
}

}  // namespace

Command addCompareCommand(CLI::App& tool) {
  const auto arguments = std::make_shared<CompareArguments>();
  CLI::App* comparison = tool.add_subcommand("compare", "run a scene on btgpu and on stock Bullet and compare");
  comparison->add_option("scene", arguments->scene, "built-in scene or .bullet file")->required();
  comparison->add_option("--size", arguments->size, "size of a built-in scene, as X,Y,Z")->check(kNotEmpty);
  comparison->add_option("--steps", arguments->steps, "steps to run")->check(CLI::Range(1, 10'000'000));
  comparison->add_option("--device", arguments->device, "OpenCL device: index, gpu, cpu or part of its name");
  addSolverOption(*comparison, arguments->solver);
  comparison->add_option("--json", arguments->json, "write the result to this file")->check(kNotEmpty);
  comparison->add_option("--report", arguments->report, "write a page with plots and pictures to this HTML file")
      ->check(kNotEmpty);
  comparison->add_flag("--profile", arguments->profile, "time each stage by device events; slows btgpu's steps");
  comparison->add_option("--host-stages", arguments->hostStages,
                         "stages whose references run on the host in their place, as 30,70");
  comparison->add_flag("--bisect", arguments->bisect,
                       "find the first stage of the first step that is off its reference; nothing else is compared");
  comparison->add_flag("--hash", arguments->hash,
                       "print a hash of what each stage of the last step left, and one of every pose and velocity bit");
  comparison
      ->add_option("--stage-hashes", arguments->stageHashes,
                   "write a hash of what each stage of each step was given, and of what it left, to this file")
      ->check(kNotEmpty);
  return {comparison, [arguments] {
            return isBulletFile(arguments->scene) ? compareFile(*arguments) : compareBuiltIn(*arguments);
          }};
}

}  // namespace btgpu::tool
