// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_sort_pairs.h"

#include <algorithm>

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_sort_pairs.cl";

}  // namespace

PairList::PairList(ComputeDevice& device)
    : m_count(device, kFile, "countListed"),
      m_emit(device, kFile, "emitListed"),
      m_sort(device, kFile, "sortPairs"),
      m_fill(device),
      m_scan(device) {}

void PairList::begin(Queue& queue, const DeviceWorld& world) {
  list.resize(queue, std::max<size_t>(1, world.capacities.pairs));
  listed.resize(queue, 1);
  m_counts.resize(queue, world.bodyCount);
  m_fill.run(queue, listed, 0, 1, 0);
  m_fill.run(queue, m_counts, 0, world.bodyCount, 0);
}

void PairList::finish(Queue& queue, DeviceWorld& world) {
  const size_t bodies = world.bodyCount, pairs = world.capacities.pairs;
  const uint count = static_cast<uint>(bodies), capacity = static_cast<uint>(pairs);
  const Grid pairGrid = queue.device().grid(pairs);
  m_sorted.resize(queue, std::max<size_t>(1, pairs));
  m_count.launch(queue, pairGrid, capacity, listed, list, m_counts);
  m_scan.exclusive(queue, {bodies}, m_counts, m_offsets, m_total);
  m_emit.launch(queue, pairGrid, capacity, listed, list, m_offsets, world.pairCount, world.counters, m_counts,
                world.keys);
  m_sort.launch(queue, queue.device().grid(bodies), count, world.counters, m_offsets, world.keys, m_sorted);
}

}  // namespace btgpu
