// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "42_collide_primitives.h"

#include <fmt/format.h>

namespace btgpu {
namespace {

struct PrimitiveBucket {
  uint bucket, typeA, typeB;
};
constexpr PrimitiveBucket kBuckets[] = {
    {BUCKET_SPHERE_SPHERE, SHAPE_SPHERE, SHAPE_SPHERE}, {BUCKET_SPHERE_PLANE, SHAPE_SPHERE, SHAPE_PLANE},
    {BUCKET_BOX_PLANE, SHAPE_BOX, SHAPE_PLANE},         {BUCKET_SPHERE_BOX, SHAPE_SPHERE, SHAPE_BOX},
    {BUCKET_CAPSULES, SHAPE_CAPSULE, SHAPE_CAPSULE},    {BUCKET_CAPSULE_PLANE, SHAPE_CAPSULE, SHAPE_PLANE},
    {BUCKET_HULL_PLANE, SHAPE_HULL, SHAPE_PLANE},
};

}  // namespace

void CollidePrimitives::enqueue(Queue& queue, DeviceWorld& world, uint shapeTypes) {
  queue.enterStage("42_collide_primitives");
  for (const auto& b : kBuckets) {
    if (!(shapeTypes >> b.typeA & 1u) || !(shapeTypes >> b.typeB & 1u)) continue;
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
