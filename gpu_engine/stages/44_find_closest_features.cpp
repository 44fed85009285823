// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_closest_features.h"

namespace btgpu {

void FindClosestFeatures::build(ComputeDevice& device) {
  constexpr const char* kFile = "stages/44_find_closest_features.cl";
  m_countConvexPairs = Kernel(device, kFile, "countConvexPairs");
  m_findClosestFeatures = Kernel(device, kFile, "findClosestFeatures");
  m_findWaysOut = Kernel(device, kFile, "findWaysOut");
}

void FindClosestFeatures::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("44_find_closest_features");
  if (!m_findClosestFeatures.isBuilt()) build(queue.device());
  const size_t capacity = world.capacities.pairs;
  world.closest.resize(queue, capacity);
  m_near.resize(queue, capacity);
  m_overlap.resize(queue, capacity);
  m_convexCount.resize(queue, 1);
  const Count count{capacity, &m_convexCount};
  m_countConvexPairs.launch(queue, {1, 1}, world.counters, world.bucketFirst, m_convexCount);
  m_findClosestFeatures.launch(queue, queue.device().grid(capacity), world.counters, world.bucketFirst, world.items,
                               world.pairs, world.infos, world.shapes, world.poses, world.oldManifolds,
                               world.hullVertices, world.hullFaces, world.hullCorners, world.hullEdges, world.contacts,
                               world.closest, m_near, m_overlap);
  m_compact.run(queue, count, m_overlap, m_overlapping, m_overlapCount);
  m_findWaysOut.launch(queue, queue.device().grid(capacity), world.counters, static_cast<uint>(capacity),
                       m_overlapCount, m_overlapping, world.bucketFirst, world.items, world.pairs, world.infos,
                       world.shapes, world.poses, world.hullVertices, world.hullFaces, world.hullCorners,
                       world.hullEdges, world.closest);
  m_compact.run(queue, count, m_near, world.nearPairs, world.nearCount);
}

}  // namespace btgpu
