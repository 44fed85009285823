// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_find_pairs.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs.cl";
constexpr uint kMortonKeyBits = PAIR_SORT_STATIC_BIT + 2;

// Bits that hold every index below `count`.
uint bitsFor(size_t count) {
  uint bits = 1;
  while ((count >> bits) != 0) ++bits;
  return bits;
}

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
    first += size;
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
      m_bvhLeaves(device, kFile, "bvhLeaves"),
      m_bvhLevel(device, kFile, "bvhLevel"),
      m_countPairs(device, kFile, "countPairs"),
      m_checkPairs(device, kFile, "checkPairs"),
      m_emitPairs(device, kFile, "emitPairs"),
      m_sort(device),
      m_scan(device) {}

void FindPairs::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("30_find_pairs");
  const size_t bodies = world.bodyCount;
  const uint count = static_cast<uint>(bodies);
  const Grid grid = queue.device().grid(bodies);
  layoutTree(queue, bodies);

  const Grid boundsGrid = queue.device().chunkGrid(bodies);
  m_partialBounds.resize(queue, boundsGrid.groups());
  m_scene.resize(queue, 1);
  m_sceneBoundsPartial.launch(queue, boundsGrid, count, world.infos, world.aabbs, m_partialBounds);
  m_sceneBoundsFinal.launch(queue, {boundsGrid.local, boundsGrid.local}, static_cast<uint>(boundsGrid.groups()),
                            m_partialBounds, m_scene);

  m_mortonCodes.resize(queue, bodies);
  m_order.resize(queue, bodies);
  m_mortonKeys.launch(queue, grid, count, world.infos, world.aabbs, m_scene, m_mortonCodes, m_order);
  m_sort.pairs(queue, {bodies}, m_mortonCodes, m_order, {{0, kMortonKeyBits}});
  m_bvhLeaves.launch(queue, grid, count, m_order, world.aabbs, m_nodes);
  const BvhLevels& levels = m_levels.front();
  for (uint level = 1; level < levels.levelCount; ++level) {
    m_bvhLevel.launch(queue, queue.device().grid(levels.size[level]), level, m_deviceLevels, m_nodes);
  }

  m_counts.resize(queue, bodies);
  m_kept.resize(queue, bodies * PAIRS_KEPT);
  m_countPairs.launch(queue, grid, count, m_deviceLevels, m_nodes, m_order, world.infos, m_counts, m_kept);
  m_scan.exclusive(queue, {bodies}, m_counts, m_counts, world.pairCount);
  m_checkPairs.launch(queue, {1, 1}, static_cast<uint>(world.capacities.pairs), world.pairCount, world.counters);
  m_emitPairs.launch(queue, grid, count, m_deviceLevels, m_nodes, m_order, world.infos, m_counts, m_kept,
                     world.counters, world.keys);
  const uint bits = bitsFor(bodies);
  m_sort.keys(queue, {world.capacities.pairs, &world.pairCount}, world.keys, {{0, bits}, {32, bits}});
}

}  // namespace btgpu
