// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What a comparison measured in each step, for the report's plots.
#pragma once

#include <vector>

namespace btgpu::tool {

// Of one world, one value a step.
struct WorldSeries {
  std::vector<double> kineticEnergy, totalEnergy;  // J a moving body; potential energy is 0 at the origin's height
  std::vector<double> meanHeight;                  // m
  std::vector<double> contacts;                    // contact points
  std::vector<double> depth99, deepest;            // penetration, m: 99th percentile and largest
  std::vector<double> residual;                    // m/s: Residual::rms after one step from btgpu's state
  std::vector<double> milliseconds;                // of the step
};

struct Series {
  WorldSeries gpu, stock;    // stock: the run that starts exactly as btgpu does
  std::vector<double> pose;  // largest difference after one step from the same state, as in integrate.pose
};

}  // namespace btgpu::tool
