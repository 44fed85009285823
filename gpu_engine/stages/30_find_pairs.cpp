// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_find_pairs.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs.cl";

// Steps that one order of the bodies serves for. They don't move far in so few, and no result depends on it.
constexpr uint kStepsPerSort = 8;

}  // namespace

FindPairs::FindPairs(ComputeDevice& device)
    : m_countPairs(device, kFile, "countPairs"),
      m_emitPairs(device, kFile, "emitPairs"),
      m_sortPairs(device, "stages/30_sort_pairs.cl", "sortPairs"),
      m_scan(device),
      m_tree(device) {}

void FindPairs::sortBodies(Queue& queue, const DeviceWorld& world) {
  const size_t bodies = world.bodyCount;
  if (m_sortedBodies == bodies && m_stepsSinceSort < kStepsPerSort) {
    ++m_stepsSinceSort;
    return;
  }
  m_sortedBodies = 0;  // until all is enqueued
  m_tree.sort(queue, bodies, world.infos, world.aabbs);
  m_sortedBodies = bodies;
  m_stepsSinceSort = 1;
}

void FindPairs::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("30_find_pairs");
  const size_t bodies = world.bodyCount;
  const uint count = static_cast<uint>(bodies), capacity = static_cast<uint>(world.capacities.pairs);
  const Grid grid = queue.device().grid(bodies);
  sortBodies(queue, world);
  m_tree.refit(queue, bodies, world.infos, world.aabbs);
  m_found.resize(queue, bodies);
  m_offsets.resize(queue, bodies);
  const bool inBlocks = queue.device().shape() == KernelShape::Cpu;
  m_kept.resize(queue, inBlocks ? size_t{boxesInBlocks(count)} / BVH_ARITY * PAIRS_KEPT_OF_BLOCK : bodies * PAIRS_KEPT);
  m_countPairs.launch(queue, grid, count, m_tree.levels(), m_tree.nodes(), m_tree.order(), world.infos, m_found,
                      m_tree.counts(), m_kept);
  m_scan.exclusive(queue, {bodies}, m_tree.counts(), m_offsets, world.pairCount);
  m_emitPairs.launch(queue, grid, count, capacity, m_tree.levels(), m_tree.nodes(), m_tree.order(), world.infos,
                     m_found, m_kept, m_offsets, world.pairCount, world.counters, m_tree.counts(), world.keys);
  m_sorted.resize(queue, world.capacities.pairs);
  m_sortPairs.launch(queue, grid, count, world.counters, m_offsets, world.keys, m_sorted);
}

}  // namespace btgpu
