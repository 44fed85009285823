// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 44's second half, closest features of convex cores: every feature of the one against every
// feature of the other, in double. Separations agree within 1e-5 of the pair's size (Core sizes plus margins): the
// kernel computes in float, takes cores nearer than that for touching, and prefers a face's axis within 1e-5. Where
// two axes are as good within that, the kernel may choose the other one.
#pragma once

#include <vector>

#include "../world_input.h"
#include "reference_maths.h"

namespace btgpu {

// A core's features, in the axes of a shape or of the world.
struct Polytope {
  struct Face {
    reference::Vec normal;
    std::vector<size_t> corners;
  };
  struct Edge {
    size_t from, to;
  };
  std::vector<reference::Vec> vertices;
  std::vector<Face> faces;
  bool hasVolume = false;
  std::vector<Edge> edges;  // of what is a point, one from it to itself
};

// The shape without its margin.
Polytope polytopeOf(const Shape& shape, const HullArrays& hulls);
// Turned and moved.
Polytope placed(const Polytope& local, const reference::Matrix& rotation, reference::Vec position);

struct ClosestCores {
  double separation;        // negative: the least overlap along any axis
  reference::Vec normal;    // unit, from A to B
  reference::Vec onA, onB;  // closest points of two cores that do not overlap
};

// Both in the same axes.
ClosestCores closestCoresReference(const Polytope& a, const Polytope& b);

// The gap between the two along an axis from A to B; negative: overlap.
double separationAlong(const Polytope& a, const Polytope& b, reference::Vec axis);

}  // namespace btgpu
