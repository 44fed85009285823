// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include "arguments.h"
#include "bullet_file.h"
#include "commands.h"
#include "quality.h"

namespace btgpu::tool {
namespace {

struct QualityArguments {
  std::vector<std::string> scenes;
  btGpuSettings settings;
};

void printRow(const char* world, const Quality& q) {
  fmt::print("  {:<8} {:>9.4f} {:>9.4f} {:>10.3g} {:>9.5f} {:>9.5f} {:>9.5f} {:>10.4g} {:>10.4g} {:>9.3f}\n", world,
             q.heightAtEnd, q.topAtEnd, q.restingEnergy, q.depth99, q.meanGap, q.largestGap, q.lostEnergy,
             q.gainedEnergy, q.milliseconds);
}

int runQuality(const QualityArguments& arguments) {
  checkDevice(arguments.settings.m_device);
  int known = 0;
  for (const QualityScene& scene : qualityScenes()) {
    const auto wanted = [&](const std::string& name) { return scene.name.compare(0, name.size(), name) == 0; };
    if (!arguments.scenes.empty() && std::none_of(arguments.scenes.begin(), arguments.scenes.end(), wanted)) continue;
    ++known;
    const Quality stock = measureQuality(scene, std::nullopt, arguments.settings);
    fmt::print("{}: {}; {} steps; {} joints; height {:.4f}, top {:.4f} at the start\n", scene.name, scene.description,
               scene.steps, stock.joints, stock.heightAtStart, stock.topAtStart);
    fmt::print("  {:<8} {:>9} {:>9} {:>10} {:>9} {:>9} {:>9} {:>10} {:>10} {:>9}\n", "world", "height", "top",
               "resting J", "depth 99", "gap mean", "gap max", "lost J", "gained J", "ms a step");
    printRow("stock", stock);
    for (const btGpuSolver solver : {btGpuSolver::Parity, btGpuSolver::Fast}) {
      const Quality q = measureQuality(scene, solver, arguments.settings);
      printRow(solver == btGpuSolver::Parity ? "parity" : "fast", q);
    }
    std::fflush(stdout);
  }
  if (known == 0) throw InputError("there is no such scene of `btgpu quality`");
  return kAgreed;
}

}  // namespace

Command addQualityCommand(CLI::App& tool) {
  const auto arguments = std::make_shared<QualityArguments>();
  CLI::App* quality =
      tool.add_subcommand("quality", "measure heights, joints and energy with stock, parity and fast mode");
  quality->add_option("scene", arguments->scenes, "scenes by the beginning of their names; left out: all of them");
  btGpuSettings& s = arguments->settings;
  quality->add_option("--substeps", s.m_fastSubsteps, "substeps of the fast mode")->check(CLI::Range(1, 64));
  quality->add_option("--hertz", s.m_fastContactHertz, "frequency of its contacts")->check(CLI::PositiveNumber);
  quality->add_option("--damping-ratio", s.m_fastContactDampingRatio, "their damping ratio")
      ->check(CLI::PositiveNumber);
  quality->add_option("--push-speed", s.m_fastPushSpeed, "speed at which penetration is pushed out at most")
      ->check(CLI::PositiveNumber);
  quality->add_option("--device", s.m_device, "OpenCL device: index, gpu, cpu or part of its name");
  return {quality, [arguments] { return runQuality(*arguments); }};
}

}  // namespace btgpu::tool
