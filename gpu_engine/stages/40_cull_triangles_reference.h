// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 40: every triangle of a pair's mesh against the other shape's box, in double and without a
// tree. A triangle whose box is within 1e-5 of the sizes and distances at hand of touching the shape's may be there or
// not (both are made of some 20 rounded operations); all others must be the same, in the order of the triangles.
#pragma once

#include <vector>

#include "contract.h"
#include "pair_arrays.h"

namespace btgpu {

struct TriangleInput {
  PairArrays arrays;
  MeshArrays meshes;

  size_t pairCount() const { return arrays.bucketFirst[BUCKET_MESH + 1] - arrays.bucketFirst[BUCKET_MESH]; }
  // By position in BUCKET_MESH.
  const Pair& pair(size_t k) const { return arrays.pairs[arrays.items[arrays.bucketFirst[BUCKET_MESH] + k]]; }
  const Mesh& meshOf(size_t k) const {
    return meshes.meshes[static_cast<size_t>(arrays.shapeOf(pair(k).bodyB).firstVertex)];
  }
};

struct TriangleHits {
  uint groups;                     // searches a pair
  std::vector<uint> found, first;  // by search
  std::vector<TriangleHit> hits;
};

TriangleHits cullTrianglesReference(const TriangleInput& in);

// `counted`: StepCounters::triangleHits.
void checkTriangleHits(Contract& contract, const TriangleInput& in, const TriangleHits& device, uint counted);

}  // namespace btgpu
