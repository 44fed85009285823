// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Worlds for narrowphase tests: pairs of bodies side by side, each given directly rather than found.
#pragma once

#include <vector>

#include "gpu_engine/stages/pair_arrays.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {

inline float sizeOf(float4 v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }
inline float4 xyzOf(float4 v) { return {v.x, v.y, v.z, 0}; }
inline bool equal(float4 a, float4 b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w; }

inline BodyPose at(float x, float y, float z, float4 orientation = kNoTurn) { return {{x, y, z, 0}, orientation}; }

// Pair k is of bodies 2k and 2k + 1, in this order.
struct PairWorld {
  WorldBuilder world;
  std::vector<Pair> pairs;
  std::vector<Manifold> oldManifolds;

  // The bucket of the shapes that the bodies have; a plane or a mesh must be b.
  uint bucketOf(uint a, uint b) const {
    const int typeA = shapeOf(a).type, typeB = shapeOf(b).type;
    const auto isCurved = [](int t) { return t >= SHAPE_CYLINDER && t <= SHAPE_SUM; };
    if (isCurved(typeA) || isCurved(typeB)) return typeB == SHAPE_PLANE ? BUCKET_CURVED_PLANE : BUCKET_CURVED;
    if (typeB == SHAPE_PLANE) {
      if (typeA == SHAPE_CAPSULE) return BUCKET_CAPSULE_PLANE;
      if (typeA == SHAPE_HULL) return BUCKET_HULL_PLANE;
      return typeA == SHAPE_SPHERE ? BUCKET_SPHERE_PLANE : BUCKET_BOX_PLANE;
    }
    if (typeB == SHAPE_MESH) return BUCKET_MESH;
    const auto are = [&](int s, int t) { return (typeA == s && typeB == t) || (typeA == t && typeB == s); };
    if (are(SHAPE_HULL, SHAPE_HULL)) return BUCKET_HULL_HULL;
    if (are(SHAPE_HULL, SHAPE_BOX)) return BUCKET_BOX_HULL;
    if (are(SHAPE_HULL, SHAPE_CAPSULE)) return BUCKET_CAPSULE_HULL;
    if (are(SHAPE_HULL, SHAPE_SPHERE)) return BUCKET_SPHERE_HULL;
    if (are(SHAPE_CAPSULE, SHAPE_BOX)) return BUCKET_CAPSULE_BOX;
    if (are(SHAPE_CAPSULE, SHAPE_CAPSULE)) return BUCKET_CAPSULES;
    if (are(SHAPE_CAPSULE, SHAPE_SPHERE)) return BUCKET_CAPSULES;
    if (typeA != typeB) return BUCKET_SPHERE_BOX;
    return typeA == SHAPE_SPHERE ? BUCKET_SPHERE_SPHERE : BUCKET_BOX_BOX;
  }
  // Returns the pair's index.
  size_t add(int shapeA, BodyPose poseA, int shapeB, BodyPose poseB) {
    const uint a = world.add(shapeA, poseA.position, 1, poseA.orientation);
    const uint b = world.add(shapeB, poseB.position, 1, poseB.orientation);
    pairs.push_back({a, b, NO_INDEX, bucketOf(a, b)});
    return pairs.size() - 1;
  }
  // Gives the last pair a manifold of the last step, with a threshold that need not be that of the shapes.
  void addOldManifold(float threshold) {
    Manifold m{};
    m.bodyA = pairs.back().bodyA;
    m.bodyB = pairs.back().bodyB;
    m.breakingThreshold = threshold;
    pairs.back().oldManifold = static_cast<uint>(oldManifolds.size());
    oldManifolds.push_back(m);
  }

  const Shape& shapeOf(uint body) const { return world.shape(world.info(body).shapeIndex); }
  float4 bFromA(const Pair& p) const { return world.pose(p.bodyB).position - world.pose(p.bodyA).position; }
};

// As the stages' contracts take it; pairs are listed bucket by bucket as stage 35 does.
inline PairArrays arraysOf(const PairWorld& p) {
  const WorldInput in = p.world.finish();
  PairArrays out{p.pairs, in.infos.values, in.shapes.values, in.poses.values, p.oldManifolds, {}, {}, in.hulls};
  for (uint bucket = 0; bucket <= BUCKET_COUNT; ++bucket) {
    out.bucketFirst.push_back(static_cast<uint>(out.items.size()));
    for (uint i = 0; i < p.pairs.size(); ++i) {
      if (p.pairs[i].bucket == bucket) out.items.push_back(i);
    }
  }
  return out;
}

// The pairs and the last step's manifolds on the device, with room for `spare` more pairs.
inline StageBench benchForPairs(Queue& queue, const PairWorld& p, size_t spare = 0) {
  Capacities room;
  room.pairs = p.pairs.size() + spare;
  StageBench bench(queue, p.world.finish(), {}, room);
  bench.setPairs(p.pairs);
  bench.setOldManifolds(p.oldManifolds);
  return bench;
}

}  // namespace btgpu
