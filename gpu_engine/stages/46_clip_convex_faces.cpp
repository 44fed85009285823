// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "46_clip_convex_faces.h"

namespace btgpu {

void ClipConvexFaces::enqueue(Queue& queue, DeviceWorld& world, bool flat, bool curved) {
  queue.enterStage("46_clip_convex_faces");
  if (flat) enqueue(queue, world, m_flat, "");
  if (curved) enqueue(queue, world, m_curved, "-DBTGPU_CURVED");
}

void ClipConvexFaces::enqueue(Queue& queue, DeviceWorld& world, Kernel& kernel, const char* options) {
  if (!kernel.isBuilt()) {
    kernel = Kernel(queue.device(), "stages/46_clip_convex_faces.cl", "clipConvexFaces", options);
  }
  const size_t capacity = world.capacities.pairs;
  kernel.launch(queue, queue.device().grid(capacity), world.counters, static_cast<uint>(capacity), world.nearCount,
                world.nearPairs, world.bucketFirst, world.items, world.pairs, world.infos, world.shapes, world.poses,
                world.oldManifolds, world.hullVertices, world.hullFaces, world.hullCorners, world.closest,
                world.contacts);
}

}  // namespace btgpu
