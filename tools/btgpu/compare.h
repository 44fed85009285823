// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "free_run.h"
#include "one_step.h"
#include "report/image.h"
#include "report/stage_times.h"

namespace btgpu::tool {

// What only the report shows.
struct ReportData {
  double timeStep = 0;
  Series series;
  Image gpuEnd, stockEnd;  // the worlds after the last step, from the same place
  StageTimes stages;
};

struct CompareResult {
  std::string scene, device;
  int bodies = 0, steps = 0, deviceSteps = 0, repeatedSteps = 0;
  double cpuMsPerStep = 0, gpuMsPerStep = 0;  // mean over the steps after the first
  std::vector<Check> checks;
  std::vector<btGpuFallback> fallbacks;
  RunStatistics gpu, stock;             // stock: the run that starts exactly as btgpu does
  std::uint64_t hash = 0;               // of every pose and velocity bit at the end
  std::vector<btGpuStageTime> profile;  // sums over all steps, if wanted
  bool compared = true;                 // false: there was no device
  ReportData report;                    // if wanted
  bool pass() const;
};

struct CompareOptions {
  double timeStep = 1.0 / 60.0;
  int steps = 300;
  std::string device;                 // as btGpuSettings::m_device
  btGpuSolver solver = btGpuSolver::Parity;
  std::string hostStages;             // as btGpuSettings::m_hostStages
  bool profile = false;               // time the stages; slows btgpu's steps
  bool report = false;                // gather ReportData
  std::function<void(int)> progress;  // called after each step with the number of steps done
};

CompareResult compare(const std::string& name, const Builder& build, const scenes::Expectations& expectations,
                      const CompareOptions& options);

// Hash of the poses and velocities of all bodies, bit by bit, in the order they were added.
std::uint64_t hashBodies(const btCollisionWorld& world);

// Entries of the report that the scene does not declare. "*" declares all shares of the CPU, but no whole step.
long undeclaredFallbacks(const std::vector<btGpuFallback>& fallbacks, const std::vector<std::string>& shares);

std::string toText(const CompareResult& result);
std::string toJson(const CompareResult& result);

}  // namespace btgpu::tool
