// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_closest_features.h"

namespace btgpu {

namespace {

constexpr const char* kFile = "stages/44_find_closest_features.cl";

}  // namespace

void FindClosestFeatures::build(ComputeDevice& device, Kernels& kernels, const char* options) {
  kernels.findClosestFeatures = Kernel(device, kFile, "findClosestFeatures", options);
  if (device.shape() == KernelShape::Gpu) kernels.findWaysOut = Kernel(device, kFile, "findWaysOut", options);
}

void FindClosestFeatures::enqueue(Queue& queue, DeviceWorld& world, bool flat, bool curved) {
  queue.enterStage("44_find_closest_features");
  ComputeDevice& device = queue.device();
  const char* options = flat ? "" : "-DBTGPU_CURVED";
  if (!m_countConvexPairs.isBuilt()) m_countConvexPairs = Kernel(device, kFile, "countConvexPairs", options);
  if (flat && !m_flat.findClosestFeatures.isBuilt()) build(device, m_flat, "");
  if (curved && !m_curved.findClosestFeatures.isBuilt()) build(device, m_curved, "-DBTGPU_CURVED");
  const size_t capacity = world.capacities.pairs;
  world.closest.resize(queue, capacity);
  m_near.resize(queue, capacity);
  const bool apart =
      device.shape() == KernelShape::Gpu;  // the ways out of cores that overlap are a launch of their own
  m_overlap.resize(queue, apart ? capacity : 1);
  m_convexCount.resize(queue, 1);
  const Count count{capacity, &m_convexCount};
  m_countConvexPairs.launch(queue, {1, 1}, world.counters, world.bucketFirst, m_convexCount);
  if (flat) enqueueSearch(queue, world, m_flat);
  if (curved) enqueueSearch(queue, world, m_curved);
  if (apart) {
    m_compact.run(queue, count, m_overlap, m_overlapping, m_overlapCount);
    if (flat) enqueueWaysOut(queue, world, m_flat);
    if (curved) enqueueWaysOut(queue, world, m_curved);
  }
  m_compact.run(queue, count, m_near, world.nearPairs, world.nearCount);
}

void FindClosestFeatures::enqueueSearch(Queue& queue, DeviceWorld& world, Kernels& kernels) {
  kernels.findClosestFeatures.launch(
      queue, queue.device().grid(world.capacities.pairs), world.counters, world.bucketFirst, world.items, world.pairs,
      world.infos, world.shapes, world.poses, world.oldManifolds, world.hullVertices, world.hullFaces,
      world.hullCorners, world.hullEdges, world.contacts, world.closest, m_near, m_overlap);
}

void FindClosestFeatures::enqueueWaysOut(Queue& queue, DeviceWorld& world, Kernels& kernels) {
  const size_t capacity = world.capacities.pairs;
  kernels.findWaysOut.launch(queue, queue.device().grid(capacity), world.counters, static_cast<uint>(capacity),
                             m_overlapCount, m_overlapping, world.bucketFirst, world.items, world.pairs, world.infos,
                             world.shapes, world.poses, world.hullVertices, world.hullFaces, world.hullCorners,
                             world.hullEdges, world.closest);
}

}  // namespace btgpu
