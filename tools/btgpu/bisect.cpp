// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bisect.h"

#include <fmt/format.h>

namespace btgpu::tool {

BisectResult bisect(const std::string& name, const Builder& build, const CompareOptions& options) {
  btGpuSettings settings;
  settings.m_device = options.device;
  settings.m_solver = options.solver;
  settings.m_hostStages = options.hostStages;
  settings.m_checkStages = true;
  TestWorld<btGpuDynamicsWorld> gpu(build, settings);
  BisectResult result;
  result.scene = name;
  while (result.steps < options.steps && result.difference.empty() && result.stockSteps == 0) {
    gpu.world().stepSimulation(static_cast<btScalar>(options.timeStep), 0);
    const btGpuStatistics statistics = gpu.world().statistics();
    result.device = statistics.m_device;
    result.difference = statistics.m_firstStageDifference;
    result.stockSteps = static_cast<int>(statistics.m_stockSteps);
    ++result.steps;
    if (options.progress) options.progress(result.steps);
  }
  result.fallbacks = gpu.world().fallbackReport();
  return result;
}

std::string toText(const BisectResult& r) {
  if (!r.difference.empty()) return r.difference + "\n";
  if (r.pass()) {
    return fmt::format("{}: {} steps on {}: every stage of every step is within its contract\n", r.scene, r.steps,
                       r.device);
  }
  std::string text = fmt::format("{}: step {} ran on the stock path, where there are no stages\n", r.scene, r.steps);
  for (const auto& f : r.fallbacks) text += fmt::format("  {} ({})\n", f.m_what, f.m_reason);
  return text;
}

}  // namespace btgpu::tool
