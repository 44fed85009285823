// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A random walk on stock Bullet and on btgpu side by side.
#pragma once

#include <string>
#include <vector>

#include "walker.h"

namespace btgpu::test {

struct WalkResult {
  std::string failure;  // empty: none
  int failedAt = -1;    // index of the operation
  std::vector<std::string> done;
  unsigned long long checkedSteps = 0, deviceSteps = 0, stockSteps = 0, restingSteps = 0;
  std::vector<btGpuFallback> fallbacks;
};

// Goes through the operations until something is wrong.
WalkResult runWalk(const std::vector<Operation>& walk, std::uint32_t seed, bool verbose = false);

// Leaves out operations as long as what is left still fails.
std::vector<Operation> shrinkWalk(std::vector<Operation> walk, std::uint32_t seed, int attempts);

}  // namespace btgpu::test
