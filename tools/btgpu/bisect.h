// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The first stage of the first step whose output on the device is off its reference by more than its contract.
#pragma once

#include <string>
#include <vector>

#include "compare.h"

namespace btgpu::tool {

struct BisectResult {
  std::string scene, device;
  int steps = 0, stockSteps = 0;  // steps done; of these, those in which nothing could be checked
  std::string difference;         // empty: there is none
  std::vector<btGpuFallback> fallbacks;
  bool pass() const { return difference.empty() && stockSteps == 0 && steps > 0; }
};

// Runs the scene on btgpu alone, each stage of each step held against its reference, up to the first difference.
BisectResult bisect(const std::string& name, const Builder& build, const CompareOptions& options);

std::string toText(const BisectResult& result);

}  // namespace btgpu::tool
