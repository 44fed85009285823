// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_find_pairs.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs.cl";
constexpr uint kMortonKeyBits = PAIR_SORT_STATIC_BIT + 2;

// Steps that one order of the bodies serves for. They don't move far in so few, and no result depends on it.
constexpr uint kStepsPerSort = 4;

}  // namespace

// The tree's shape depends on the number of bodies alone.
void FindPairs::layoutTree(Queue& queue, size_t bodyCount) {
  if (m_treeBodies == bodyCount && !m_levels.empty()) return;
  m_levels.clear();
  BvhLevels levels{};
  size_t size = bodyCount, first = 0;
  while (true) {
    levels.first[levels.levelCount] = static_cast<uint>(first);
    levels.size[levels.levelCount] = static_cast<uint>(size);
    ++levels.levelCount;
    first += (size + BVH_ARITY - 1) / BVH_ARITY * BVH_ARITY;  // siblings lie together
    if (size <= 1) break;
    size = (size + BVH_ARITY - 1) / BVH_ARITY;
  }
  m_nodes.resize(queue, first);
  m_deviceLevels.resize(queue, 1);
  m_levels.assign(1, levels);  // from here on nothing throws for lack of memory
  m_treeBodies = bodyCount;
  m_deviceLevels.copyFromHost(queue, m_levels, false);
}

FindPairs::FindPairs(ComputeDevice& device)
    : m_sceneBoundsPartial(device, kFile, "sceneBoundsPartial"),
      m_sceneBoundsFinal(device, kFile, "sceneBoundsFinal"),
      m_mortonKeys(device, kFile, "mortonKeys"),
      m_bvhLow(device, kFile, "bvhLow"),
      m_bvhHigh(device, kFile, "bvhHigh"),
      m_countPairs(device, kFile, "countPairs"),
      m_emitPairs(device, kFile, "emitPairs"),
      m_sortPairs(device, "stages/30_sort_pairs.cl", "sortPairs"),
      m_sort(device),
      m_scan(device) {}

void FindPairs::sortBodies(Queue& queue, const DeviceWorld& world) {
  const size_t bodies = world.bodyCount;
  if (m_sortedBodies == bodies && m_stepsSinceSort < kStepsPerSort) {
    ++m_stepsSinceSort;
    return;
  }
  m_sortedBodies = 0;  // until all is enqueued
  const uint count = static_cast<uint>(bodies);
  const Grid boundsGrid = queue.device().chunkGrid(bodies);
  m_partialBounds.resize(queue, boundsGrid.groups());
  m_scene.resize(queue, 1);
  m_sceneBoundsPartial.launch(queue, boundsGrid, count, world.infos, world.aabbs, m_partialBounds);
  m_sceneBoundsFinal.launch(queue, {boundsGrid.local, boundsGrid.local}, static_cast<uint>(boundsGrid.groups()),
                            m_partialBounds, m_scene);
  m_mortonCodes.resize(queue, bodies);
  m_order.resize(queue, bodies);
  m_mortonKeys.launch(queue, queue.device().grid(bodies), count, world.infos, world.aabbs, m_scene, m_mortonCodes,
                      m_order);
  m_sort.pairs(queue, {bodies}, m_mortonCodes, m_order, {{0, kMortonKeyBits}});
  m_sortedBodies = bodies;
  m_stepsSinceSort = 1;
}

void FindPairs::buildTree(Queue& queue, const DeviceWorld& world) {
  const size_t bodies = world.bodyCount, local = queue.device().groupSize();
  layoutTree(queue, bodies);
  m_counts.resize(queue, bodies);
  m_bvhLow.launch(queue, queue.device().grid(bodies), static_cast<uint>(bodies), m_deviceLevels, m_order, world.aabbs,
                  m_nodes, m_counts);
  // As many as the kernel leaves.
  if (m_levels.front().levelCount > 4) m_bvhHigh.launch(queue, {local, local}, m_deviceLevels, m_nodes);
}

void FindPairs::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("30_find_pairs");
  const size_t bodies = world.bodyCount;
  const uint count = static_cast<uint>(bodies), capacity = static_cast<uint>(world.capacities.pairs);
  const Grid grid = queue.device().grid(bodies);
  sortBodies(queue, world);
  buildTree(queue, world);
  m_found.resize(queue, bodies);
  m_offsets.resize(queue, bodies);
  m_kept.resize(queue, bodies * PAIRS_KEPT);
  m_countPairs.launch(queue, grid, count, m_deviceLevels, m_nodes, m_order, world.infos, m_found, m_counts, m_kept);
  m_scan.exclusive(queue, {bodies}, m_counts, m_offsets, world.pairCount);
  m_emitPairs.launch(queue, grid, count, capacity, m_deviceLevels, m_nodes, m_order, world.infos, m_found, m_kept,
                     m_offsets, world.pairCount, world.counters, m_counts, world.keys);
  m_sorted.resize(queue, world.capacities.pairs);
  m_sortPairs.launch(queue, grid, count, world.counters, m_offsets, world.keys, m_sorted);
}

}  // namespace btgpu
