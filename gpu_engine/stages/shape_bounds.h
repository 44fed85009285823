// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The bounds of a shape in some axes, as Bullet's getAabb has them, for the references of stages 20 and 40.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "../../kernels/shared/shape.h"
#include "reference_maths.h"

namespace btgpu::reference {

struct Bounds {
  Vec lower, upper;

  // Takes in a body of that size along the axes around a point.
  void add(const Vec& point, const Vec& reach) {
    for (int k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], point[k] - reach[k]);
      upper[k] = std::max(upper[k], point[k] + reach[k]);
    }
  }
};

inline Bounds noBounds() { return {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}; }

// Of the core, turned and not moved.
inline Bounds coreBounds(const Shape& shape, const Matrix& r, const std::vector<float4>& vertices) {
  Bounds box = noBounds();
  if (shape.type == SHAPE_CYLINDER || shape.type == SHAPE_CONE) {
    const Vec up = r.column(shape.variant), end = up * double(shape.halfLength);
    Vec rim;
    for (int k = 0; k < 3; ++k) rim[k] = shape.radius * std::hypot(up[(k + 1) % 3], up[(k + 2) % 3]);
    box.add(end, shape.type == SHAPE_CONE ? Vec{} : rim);
    box.add(-end, rim);
    return box;
  }
  const auto first = static_cast<size_t>(shape.firstVertex), count = static_cast<size_t>(shape.vertexCount);
  for (size_t i = first; i < first + count; ++i) {
    Vec reach;
    if (shape.type == SHAPE_MULTI_SPHERE) {
      const Vec stretch = toVec(vertices[first + count]);
      for (int k = 0; k < 3; ++k) {
        const Vec along{r(k, 0) * stretch.x, r(k, 1) * stretch.y, r(k, 2) * stretch.z};
        reach[k] = length(along) * vertices[i].w;
      }
    }
    box.add(r * toVec(vertices[i]), reach);
  }
  return box;
}

inline Bounds shapeBounds(const Shape& shape, const Vec& position, const Matrix& r,
                          const std::vector<float4>& vertices) {
  constexpr double kPlaneExtent = 1e18;  // BT_LARGE_FLOAT, btStaticPlaneShape::getAabb
  Bounds box = noBounds();
  if (shape.type == SHAPE_PLANE) {
    box.add({}, {kPlaneExtent, kPlaneExtent, kPlaneExtent});
    return box;
  }
  double margin = 0;
  if (shape.type == SHAPE_SPHERE) {
    box.add({}, {});
    margin = shape.extents.x;
  } else if (shape.boundsMargins > 0) {
    box = coreBounds(shape, r, vertices);
    margin = double(shape.boundsMargins) * shape.margin;
  } else {
    // btCapsuleShape::getAabb bounds the box around the capsule, not the capsule.
    const double radius = shape.type == SHAPE_CAPSULE ? shape.margin : 0;
    const Vec half = toVec(shape.extents) + Vec{radius, radius, radius};
    const bool centred = shape.type == SHAPE_HULL || shape.type == SHAPE_MULTI_SPHERE || shape.type == SHAPE_SUM ||
                         shape.type == SHAPE_COMPOUND || shape.type == SHAPE_MESH;
    const Vec centre = centred ? r * toVec(shape.centre) : Vec{};
    for (int corner = 0; corner < 8; ++corner) {
      const Vec p{corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y, corner & 4 ? half.z : -half.z};
      box.add(centre + r * p, {});
    }
  }
  const Vec by{margin, margin, margin};
  return {position + box.lower - by, position + box.upper + by};
}

}  // namespace btgpu::reference
