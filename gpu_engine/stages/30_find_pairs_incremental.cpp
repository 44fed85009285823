// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_find_pairs_incremental.h"

#include <algorithm>
#include <utility>

#include "../../kernels/shared/bvh.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs_incremental.cl";

// Makes room without losing what is there.
template <typename T>
void atLeast(Queue& queue, size_t size, DeviceArray<T>& array) {
  array.resize(queue, std::max({size, array.size(), size_t{1}}));
}

}  // namespace

FindPairsIncremental::FindPairsIncremental(ComputeDevice& device)
    : m_bodyKinds(device, kFile, "bodyKinds"),
      m_endKeys(device, kFile, "endKeys"),
      m_stayingEnds(device, kFile, "stayingEnds"),
      m_rankEnds(device, kFile, "rankEnds"),
      m_clearGone(device, kFile, "clearGone"),
      m_changedPairs(device, kFile, "changedPairs"),
      m_keptPairs(device, kFile, "keptPairs"),
      m_lowerEnds(device, kFile, "lowerEnds"),
      m_freshRanges(device, kFile, "freshRanges"),
      m_freshPieces(device, kFile, "freshPieces"),
      m_rememberBodies(device, kFile, "rememberBodies"),
      m_rememberPairs(device, kFile, "rememberPairs"),
      m_sort(device),
      m_scan(device),
      m_fill(device),
      m_axis(device),
      m_ranges(device),
      m_pairs(device),
      m_oldOrder{DeviceArray<uint>("old ends x"), DeviceArray<uint>("old ends y"), DeviceArray<uint>("old ends z")},
      m_order{DeviceArray<uint>("ends x"), DeviceArray<uint>("ends y"), DeviceArray<uint>("ends z")} {}

void FindPairsIncremental::begin(Queue& queue, const DeviceWorld& world) {
  const size_t bodies = world.bodyCount, pairs = world.capacities.pairs;
  atLeast(queue, 1, m_known);
  atLeast(queue, 1, m_oldPairCount);
  if (!std::exchange(m_whole, false)) {
    m_oldCount = 0;
    m_fill.run(queue, m_known, 0, 1, 0);
    m_fill.run(queue, m_oldPairCount, 0, 1, 0);
  }
  const size_t most = std::max(bodies, m_oldCount);
  atLeast(queue, bodies, m_oldInfos);
  atLeast(queue, bodies, m_oldAabbs);
  atLeast(queue, pairs, m_oldKeys);
  atLeast(queue, m_oldKeys.size(), m_gone);
  for (auto* array : {&m_kinds, &m_keys, &m_flags, &m_offsets, &m_fresh, &m_freshOffsets, &m_ranks, &m_ranked,
                      &m_oldRanks, &m_oldRanked}) {
    atLeast(queue, 2 * most, *array);
  }
  for (auto& order : m_order) order.resize(queue, std::max<size_t>(1, 2 * bodies));
  for (auto& order : m_oldOrder) atLeast(queue, 1, order);
  m_bodyKinds.launch(queue, queue.device().grid(most), static_cast<uint>(bodies), static_cast<uint>(m_oldCount),
                     m_known, world.infos, world.aabbs, m_oldInfos, m_oldAabbs, m_kinds);
  m_clearGone.launch(queue, queue.device().grid(pairs), m_oldPairCount, m_gone);
}

void FindPairsIncremental::sortEnds(Queue& queue, const DeviceWorld& world, uint axis) {
  const size_t ends = 2 * world.bodyCount;
  m_endKeys.launch(queue, queue.device().grid(ends), static_cast<uint>(world.bodyCount), axis, world.infos, world.aabbs,
                   m_keys, m_order[axis]);
  m_sort.pairs(queue, {ends}, m_keys, m_order[axis], {{0, 32}});
}

void FindPairsIncremental::rank(Queue& queue, size_t bodies, const DeviceArray<uint>& order, DeviceArray<uint>& ranks,
                                DeviceArray<uint>& ranked) {
  const Grid grid = queue.device().grid(2 * bodies);
  const uint ends = static_cast<uint>(2 * bodies);
  m_stayingEnds.launch(queue, grid, ends, order, m_kinds, m_flags);
  m_scan.exclusive(queue, {2 * bodies}, m_flags, m_offsets, m_total);
  m_rankEnds.launch(queue, grid, ends, order, m_flags, m_offsets, ranks, ranked);
}

void FindPairsIncremental::findChanges(Queue& queue, const DeviceWorld& world, uint axis) {
  sortEnds(queue, world, axis);
  if (m_oldCount == 0) return;
  rank(queue, m_oldCount, m_oldOrder[axis], m_oldRanks, m_oldRanked);
  rank(queue, world.bodyCount, m_order[axis], m_ranks, m_ranked);
  m_changedPairs.launch(queue, queue.device().grid(2 * world.bodyCount), static_cast<uint>(world.bodyCount), axis,
                        static_cast<uint>(world.capacities.pairs), m_kinds, m_oldRanks, m_ranks, m_oldRanked, m_ranked,
                        world.infos, m_oldAabbs, world.aabbs, m_oldPairCount, m_oldKeys, m_gone, m_pairs.listed,
                        m_pairs.list);
}

void FindPairsIncremental::findFresh(Queue& queue, const DeviceWorld& world) {
  const size_t bodies = world.bodyCount, ends = 2 * bodies;
  const uint count = static_cast<uint>(bodies), freshFirst = boxesInBlocks(count);
  const Grid grid = queue.device().grid(ends);
  m_axis.enqueue(queue, world);
  m_ranges.resize(queue, bodies, 2 * freshFirst);
  m_lowerEnds.launch(queue, grid, count, m_axis.axis, m_order[0], m_order[1], m_order[2], m_kinds, m_flags, m_fresh);
  m_scan.exclusive(queue, {ends}, m_flags, m_offsets, m_total);
  m_scan.exclusive(queue, {ends}, m_fresh, m_freshOffsets, m_total);
  m_freshRanges.launch(queue, grid, count, freshFirst, m_axis.axis, m_order[0], m_order[1], m_order[2], m_kinds,
                       m_offsets, m_freshOffsets, world.aabbs, m_ranges.selves, m_ranges.from, m_ranges.end,
                       m_ranges.boxes, m_ranges.order);
  m_freshPieces.launch(queue, queue.device().grid(bodies), count, m_kinds, m_ranges.from, m_ranges.end,
                       m_ranges.pieces);
  m_ranges.enqueue(queue, world, m_pairs);
}

void FindPairsIncremental::remember(Queue& queue, const DeviceWorld& world) {
  m_rememberBodies.launch(queue, queue.device().grid(world.bodyCount), static_cast<uint>(world.bodyCount), world.infos,
                          world.aabbs, m_oldInfos, m_oldAabbs);
  m_rememberPairs.launch(queue, queue.device().grid(world.capacities.pairs), world.counters, world.pairCount,
                         world.keys, m_oldKeys, m_oldPairCount, m_known);
  for (size_t axis = 0; axis < 3; ++axis) swap(m_oldOrder[axis], m_order[axis]);
  m_oldCount = world.bodyCount;
  m_whole = true;
}

void FindPairsIncremental::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("30_find_pairs_incremental");
  m_pairs.begin(queue, world);
  begin(queue, world);
  for (uint axis = 0; axis < 3; ++axis) findChanges(queue, world, axis);
  m_keptPairs.launch(queue, queue.device().grid(world.capacities.pairs), static_cast<uint>(world.capacities.pairs),
                     m_oldPairCount, m_oldKeys, m_gone, m_kinds, m_pairs.listed, m_pairs.list);
  findFresh(queue, world);
  m_pairs.finish(queue, world);
  remember(queue, world);
}

}  // namespace btgpu
