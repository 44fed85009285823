// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "worlds.h"

namespace btgpu::tool {

struct ConvergenceOptions {
  double timeStep = 1.0 / 60.0;
  int steps = 100;                    // before the one that is solved again and again
  std::vector<int> iterations;        // ascending
  std::string device;                 // as btGpuSettings::m_device
  std::function<void(int)> progress;  // called after each solve with the number of solves done
};

// What one solver makes of the step, by number of iterations.
struct ConvergenceLine {
  std::string solver;
  std::vector<double> residual;  // rms of the rows' velocity errors (translation/oracle/residuals.h)
  std::vector<double> distance;  // of the velocities from stock's after kConvergedIterations, mass-weighted
};

struct ConvergenceResult {
  std::string scene, device;
  int bodies = 0, steps = 0;
  long contacts = 0, joints = 0;
  std::vector<int> iterations;
  std::vector<ConvergenceLine> lines;
  int deviceDifferences = 0;  // solves that did not start from the very same contacts as the first; must be 0
};

// Runs a scene on btgpu's parity solver, then does its next step with each solver and number of iterations, always from
// the same state and contact cache; stock's solver gets btgpu's contacts. Throws InputError if a step is not done on
// the device.
ConvergenceResult measureConvergence(const std::string& scene, const Builder& build, const ConvergenceOptions& options);
int solvesOf(const ConvergenceOptions& options);  // that measureConvergence makes

std::string toText(const ConvergenceResult& result);
std::string toCsv(const ConvergenceResult& result);
std::string toJson(const ConvergenceResult& result);
// Residual by iterations.
std::string toSvg(const ConvergenceResult& result);

}  // namespace btgpu::tool
