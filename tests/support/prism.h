// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cmath>
#include <vector>

#include "kernels/shared/shape.h"

namespace btgpu {

// Corners of a regular prism that stands upright around the origin.
inline std::vector<float4> prismPoints(int sides, float radius, float halfHeight) {
  std::vector<float4> points;
  for (int k = 0; k < sides; ++k) {
    const float angle = 6.2831853f * static_cast<float>(k) / static_cast<float>(sides);
    for (const float y : {-halfHeight, halfHeight}) {
      points.push_back({radius * std::cos(angle), y, radius * std::sin(angle), 0});
    }
  }
  return points;
}

}  // namespace btgpu
