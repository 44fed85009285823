// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// How well a solver does, in figures that need no other solver to be right: heights, joints, energy.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "worlds.h"

namespace btgpu::tool {

// A world to measure. Lengths are the application's, energies J.
struct QualityScene {
  std::string name, description;
  int steps;
  double timeStep;
  Builder build;
};

// Those of `btgpu quality`: piles from the built-in scenes, and small ones of its own for joints and energy.
std::vector<QualityScene> qualityScenes();

struct Quality {
  double heightAtStart = 0, heightAtEnd = 0, topAtStart = 0, topAtEnd = 0;  // mean and highest centre of moving bodies
  double restingEnergy = 0;            // kinetic, a body, mean of the last 60 steps
  double depth99 = 0;                  // 99th percentile of the depths of contact in the last 60 steps
  double meanGap = 0, largestGap = 0;  // between the two ends of a joint, in the last 60 steps; 0 without joints
  double lostEnergy = 0;               // of the whole world from start to end
  double gainedEnergy = 0;             // most that it ever had above the start
  double milliseconds = 0;             // a step, median
  int joints = 0;
};

// nullopt solver: stock Bullet. `settings`: for all but the choice of the solver.
Quality measureQuality(const QualityScene& scene, std::optional<btGpuSolver> solver, const btGpuSettings& settings);

}  // namespace btgpu::tool
