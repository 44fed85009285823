// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 44's second half, closest features of convex cores: every feature of the one against every
// feature of the other, in double. Separations agree within 1e-5 of the pair's size (Core sizes plus margins): the
// kernel computes in float, takes cores nearer than that for touching, and prefers a face's axis within 1e-5. Where
// two axes are as good within that, the kernel may choose the other one. Pairs of BUCKET_CURVED: curved_reference.h.
#pragma once

#include <limits>
#include <vector>

#include "contract.h"
#include "pair_arrays.h"

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

// Both in the same axes. Of cores that are farther apart than `beyond` only that is told, as some separation.
ClosestCores closestCoresReference(const Polytope& a, const Polytope& b,
                                   double beyond = std::numeric_limits<double>::infinity());

// The gap between the two along an axis from A to B; negative: overlap.
double separationAlong(const Polytope& a, const Polytope& b, reference::Vec axis);

// The cores of a pair in world axes, from A's position.
struct PlacedCores {
  Polytope a, b;
  reference::Matrix rotationA;
  double size;        // of both shapes, what the kernels' slacks are in proportion to
  double reach;       // with the distance of their centres: no vertex of the one is farther from one of the other
  double depthSlack;  // depths as near as that count as the same
  double margins, threshold;  // of both; how far apart surfaces may be for a contact
  double marginB;
  double limit() const { return margins + threshold; }  // how far apart cores may be
};

// Places the cores of pairs one after the other; a shape's features are made once.
class CorePlacer {
 public:
  explicit CorePlacer(const PairArrays& in) : m_in(in), m_polytopes(in.shapes.size()) {}
  PlacedCores place(const Pair& pair);

 private:
  const Polytope& polytopeAt(size_t shape);

  const PairArrays& m_in;
  std::vector<Polytope> m_polytopes;  // without vertices: not made yet
};

struct ClosestPairs {
  std::vector<ClosestFeatures> closest;  // by position among the convex pairs
  std::vector<uint> near;                // positions of those that may touch, ascending
};

// For all convex pairs; clears their contacts.
ClosestPairs findClosestFeaturesReference(const PairArrays& in, std::vector<RawContacts>& contacts);

// `before`: the candidates that the stage found there, which other pairs keep.
void checkClosestFeatures(Contract& contract, const PairArrays& in, const ClosestPairs& device,
                          const std::vector<RawContacts>& before, const std::vector<RawContacts>& contacts);

}  // namespace btgpu
