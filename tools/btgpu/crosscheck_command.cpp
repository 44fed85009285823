// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>

#include "arguments.h"
#include "bullet_file.h"
#include "commands.h"
#include "compare.h"
#include "progress.h"

namespace btgpu::tool {
namespace {

struct CrosscheckArguments {
  std::string scene, size, device, lines;
  int steps = 0, every = 1;
};

btGpuSettings settingsOf(const CrosscheckArguments& arguments, const scenes::Expectations& expectations) {
  btGpuSettings settings;
  settings.m_device = arguments.device;
  settings.m_crosscheckEvery = arguments.every;
  settings.m_crosscheckFile = arguments.lines;
  settings.m_crosscheckOtherDepths = expectations.otherDepths;
  return settings;
}

// What the CPU did is taken from the record and not compared: only what the scene declares may run there.
long reportFallbacks(const btGpuDynamicsWorld& world, const scenes::Expectations& expectations) {
  const std::vector<btGpuFallback> fallbacks = world.fallbackReport();
  for (const btGpuFallback& f : fallbacks) fmt::print("on the CPU   {}: {} ({})\n", f.m_what, f.m_reason, f.m_count);
  return undeclaredFallbacks(fallbacks, expectations.cpuShares);
}

// The world says on stderr what failed first, and at its end how the run went.
int reportCrosscheck(const CrosscheckArguments& arguments, const btGpuDynamicsWorld& world, int steps,
                     const scenes::Expectations& expectations) {
  const btGpuCrosscheckSummary summary = world.crosscheck();
  fmt::print("{:<26} {:>11} {:>11}\n", "check", "value", "limit");
  for (const btGpuCheck& c : summary.m_checks) {
    fmt::print("{:<26} {:>11.4g} {:>11.4g} {}\n", c.m_name, c.m_value, c.m_limit, c.m_failed ? "FAILED" : "");
  }
  const long undeclared = reportFallbacks(world, expectations);
  const bool complete = summary.m_checkedSteps == static_cast<unsigned>(steps / arguments.every) &&
                        summary.m_stockSteps == 0 && undeclared == 0;
  fmt::print("steps {}, checked {}, failed {}{}\n", summary.m_steps, summary.m_checkedSteps, summary.m_failedSteps,
             complete ? "" : "; not everything was compared");
  return complete && summary.agreed() ? kAgreed : kFailed;
}

int runCrosscheck(const CrosscheckArguments& arguments) {
  const scenes::Scene& scene = sceneNamed(arguments.scene);
  const scenes::Size size = arguments.size.empty() ? scene.size : parseSize(arguments.size);
  const int steps = arguments.steps > 0 ? arguments.steps : scene.steps;
  if (arguments.every > steps) throw InputError("--every is more than the steps: nothing would be checked");
  checkDevice(arguments.device);
  TestWorld<btGpuDynamicsWorld> gpu(builderOf(scene, size), settingsOf(arguments, scene.expectations));
  {
    ProgressBar bar(scene.name, steps);
    for (int step = 0; step < steps; ++step) {
      gpu.world().stepSimulation(static_cast<btScalar>(scene.timeStep), 0);
      bar.show(step + 1);
    }
  }
  return reportCrosscheck(arguments, gpu.world(), steps, scene.expectations);
}

}  // namespace

Command addCrosscheckCommand(CLI::App& tool) {
  const auto arguments = std::make_shared<CrosscheckArguments>();
  CLI::App* check = tool.add_subcommand("crosscheck", "run a scene as an application does, with the cross-check on");
  check->add_option("scene", arguments->scene, "built-in scene")->required();
  check->add_option("--size", arguments->size, "size of the scene, as X,Y,Z")->check(kNotEmpty);
  check->add_option("--steps", arguments->steps, "steps to run")->check(CLI::Range(1, 10'000'000));
  check->add_option("--every", arguments->every, "check every so many-th step")->check(CLI::Range(1, 1'000'000));
  check->add_option("--device", arguments->device, "OpenCL device: index, gpu, cpu or part of its name");
  check->add_option("--lines", arguments->lines, "append a JSON line a checked step to this file")->check(kNotEmpty);
  return {check, [arguments] { return runCrosscheck(*arguments); }};
}

}  // namespace btgpu::tool
