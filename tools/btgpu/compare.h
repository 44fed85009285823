// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "free_run.h"
#include "one_step.h"

namespace btgpu::tool {

struct CompareOptions {
  std::string scene;  // a built-in scene or a .bullet file
  std::optional<scenes::Size> size;
  std::optional<int> steps;
  std::string device;
  bool hash = false;
};

struct CompareResult {
  std::string scene, device;
  int bodies = 0, steps = 0, deviceSteps = 0, repeatedSteps = 0;
  double cpuMsPerStep = 0, gpuMsPerStep = 0;  // mean over the steps after the first
  std::vector<Check> checks;
  std::vector<btGpuFallback> fallbacks;
  WorldFigures gpu, stock;  // at the end
  std::uint64_t hash = 0;   // of every pose and velocity bit at the end
  bool compared = true;     // false: there was no device
  bool pass() const;
};

// Runs the comparison; `progress` is called after each step with the number of steps done.
CompareResult compare(const std::string& name, const Builder& build, const scenes::Expectations& expectations,
                      double timeStep, int steps, const std::string& device, const std::function<void(int)>& progress);

// Hash of the poses and velocities of all bodies, bit by bit, in the order they were added.
std::uint64_t hashBodies(const btCollisionWorld& world);

std::string toText(const CompareResult& result);
std::string toJson(const CompareResult& result);

}  // namespace btgpu::tool
