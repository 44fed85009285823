// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <vector>

#include "../worlds.h"

namespace btgpu::tool {

// A part of the step that both worlds have.
struct Phase {
  std::string name;
  double gpu, stock;  // ms a step; btgpu: sum of its stages' time on the device
};

struct StageTimes {
  int steps = 0;
  std::vector<btGpuStageTime> stages;  // sums over the steps
  std::vector<Phase> phases;
};

// Runs btgpu and stock for some steps of their own, since timing slows both: device events, Bullet's profile zones.
StageTimes measureStages(const Builder& build, const btGpuSettings& settings, btScalar timeStep, int steps);

}  // namespace btgpu::tool
