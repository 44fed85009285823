// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "42_collide_primitives.h"

#include <fmt/format.h>

namespace btgpu {
namespace {

constexpr uint bit(uint type) { return 1u << type; }

// The types of A and of B, as bits.
struct PrimitiveBucket {
  uint bucket, typesA, typesB;
};
constexpr PrimitiveBucket kBuckets[] = {
    {BUCKET_SPHERE_SPHERE, bit(SHAPE_SPHERE), bit(SHAPE_SPHERE)},
    {BUCKET_SPHERE_PLANE, bit(SHAPE_SPHERE), bit(SHAPE_PLANE)},
    {BUCKET_BOX_PLANE, bit(SHAPE_BOX), bit(SHAPE_PLANE)},
    {BUCKET_SPHERE_BOX, bit(SHAPE_SPHERE), bit(SHAPE_BOX)},
    {BUCKET_CAPSULES, bit(SHAPE_CAPSULE), bit(SHAPE_CAPSULE)},
    {BUCKET_CAPSULE_PLANE, bit(SHAPE_CAPSULE), bit(SHAPE_PLANE)},
    {BUCKET_HULL_PLANE, bit(SHAPE_HULL), bit(SHAPE_PLANE)},
    {BUCKET_CURVED_PLANE, bit(SHAPE_CYLINDER) | bit(SHAPE_CONE) | bit(SHAPE_MULTI_SPHERE) | bit(SHAPE_SUM),
     bit(SHAPE_PLANE)},
};

}  // namespace

void CollidePrimitives::enqueue(Queue& queue, DeviceWorld& world, uint shapeTypes) {
  queue.enterStage("42_collide_primitives");
  for (const auto& b : kBuckets) {
    if (!(shapeTypes & b.typesA) || !(shapeTypes & b.typesB)) continue;
    Kernel& kernel = m_kernels[b.bucket];
    if (!kernel.isBuilt()) {
      kernel = Kernel(queue.device(), "stages/42_collide_primitives.cl", "collidePrimitives",
                      fmt::format("-DBTGPU_BUCKET={}", b.bucket));
    }
    kernel.launch(queue, queue.device().grid(world.capacities.pairs), world.counters, world.bucketFirst, world.items,
                  world.pairs, world.infos, world.shapes, world.poses, world.oldManifolds, world.hullVertices,
                  world.contacts);
  }
}

}  // namespace btgpu
