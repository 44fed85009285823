// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of boxes for the tests of stages 44 and 46, by hand and at random.
#pragma once

#include "gpu_engine/stages/44_find_separating_axis_reference.h"
#include "tests/support/pair_world.h"

namespace btgpu {

enum class BoxPose {
  Anyhow,   // any poses, about half of them overlapping
  Resting,  // one on the other's face, tilted by at most 0.01
  Aligned,  // all axes parallel, up to the rounding of the quaternion product
  Crossed,  // edge against edge
  Thin,     // one of them 1e-3 thick
};

// Adds a pair of boxes and returns its index. Near (1000, -2000, 500), where a float is good to 1e-4.
size_t addRandomBoxPair(std::mt19937& random, PairWorld& p, BoxPose kind);

// `count` pairs of boxes of all kinds in turn, with a pair of another bucket after every third.
PairWorld randomBoxPairs(std::mt19937& random, size_t count);

// Hand-made and degenerate pairs; every coordinate is exact in a float.
PairWorld exactBoxPairs();

// Indices into exactBoxPairs().
enum ExactBoxPair {
  kSameCube,        // identical cubes at the same place
  kTouchingFaces,   // cubes that touch face to face
  kOneUlpApart,     // the same with the least gap a float can express
  kTouchingEdges,   // cubes that touch along an edge
  kTouchingCorner,  // ... and in a corner
  kStacked,         // a small box a quarter deep in the top of a large one
  kOverhanging,     // ... half over the large one's edge
  kStackedTurned,   // the large one as B
  kThinOnThin,      // sheets of 1e-3
  kEdgeOnEdge,      // crossing edges, 0.25 deep
  kEdgeOverEdge,    // ... and 0.25 apart
  kDiamondOnTop,    // an edge of B on A's top face
  kOtherBucket,     // two spheres
  kFarApart,
  kExactBoxPairs
};

// The contract's size of a pair (44_find_separating_axis_reference.h).
double pairSize(const PairWorld& p, const Pair& pair);
AxisProjections projectionsOf(const PairWorld& p, const Pair& pair);

}  // namespace btgpu
