// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "60_batch_constraints.h"

#include <algorithm>

#include "../../kernels/lib/batches.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/60_batch_constraints.cl";
constexpr size_t kBodiesPerGroup = 128;  // docs/decisions/0018-mass-splitting-and-two-level-batching.md
constexpr uint kMostBits = 10;           // log2 of the groups of a phase

}  // namespace

std::vector<uint> splitForGroups(GroupSplit by, size_t bodyCount) {
  std::vector<uint> split(BATCH_SPLIT_SIZE, 0);
  const size_t wanted = std::max<size_t>(1, bodyCount / kBodiesPerGroup);
  uint bits = 0;
  if (by == GroupSplit::Index) {
    // 2^n sets make 2^n (2^n + 1) / 2 groups.
    while (bits < kMostBits && (size_t{1} << bits) * ((size_t{1} << bits) + 1) / 2 < wanted) ++bits;
    split[SPLIT_KIND] = SPLIT_BY_INDEX;
    split[SPLIT_PHASES] = split[SPLIT_GROUPS] = 1u << bits;
    return split;
  }
  while (bits < kMostBits && (size_t{SPACE_LONG} << bits) < wanted) ++bits;
  split[SPLIT_KIND] = SPLIT_BY_SPACE;
  split[SPLIT_PHASES] = SPACE_PHASES;
  split[SPLIT_GROUPS] = 1u << bits;
  // Worlds are wider than they are high.
  split[SPLIT_BITS_X] = (bits + 2) / 3;
  split[SPLIT_BITS_Z] = (bits + 1) / 3;
  split[SPLIT_BITS_Y] = bits / 3;
  return split;
}

BatchConstraints::BatchConstraints(ComputeDevice& device)
    : m_list(device, kFile, "listConstraints"),
      m_assign(device, kFile, "assignGroups"),
      m_batch(device, kFile, "batchGroups"),
      m_begin(device, kFile, "beginBatches"),
      m_clear(device, kFile, "clearSlots"),
      m_fill(device, kFile, "fillBatches"),
      m_histogram(device),
      m_sort(device),
      m_search(device),
      m_scan(device) {}

void BatchConstraints::assignGroups(Queue& queue, DeviceWorld& world) {
  const uint capacity = static_cast<uint>(world.capacities.pairs);
  const Grid grid = queue.device().grid(capacity);
  m_list.launch(queue, grid, capacity, world.counters, world.constraints, world.manifolds, world.steps, world.poses,
                m_headers, m_bins);
  m_histogram.run(queue, {capacity, &world.constraintCount}, m_bins, DISTANCE_BINS, m_distances);
  m_assign.launch(queue, grid, capacity, world.counters, world.batches.split, m_distances, m_headers, world.poses,
                  m_keys, m_order);
  const Count count{capacity, &world.constraintCount};
  m_sort.pairs(queue, count, m_keys, m_order, {{0, indexBits(static_cast<uint>(m_groups))}});
  m_search.lower(queue, count, m_keys, m_groups + 1, m_groupFirst);
}

void BatchConstraints::enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings) {
  queue.enterStage("60_batch_constraints");
  BatchArrays& out = world.batches;
  std::vector<uint> split = splitForGroups(settings.groupSplit, world.bodyCount);
  if (split != m_split || out.split.empty()) {
    out.split.copyFromHost(queue, split, true);
    m_split = std::move(split);
  }
  m_groups = size_t{m_split[SPLIT_PHASES]} * m_split[SPLIT_GROUPS];
  const uint capacity = static_cast<uint>(world.capacities.pairs), slots = static_cast<uint>(world.capacities.slots);
  m_headers.resize(queue, capacity);
  for (auto* array : {&m_bins, &m_keys, &m_order, &m_batchOf, &m_ranks, &m_left}) array->resize(queue, capacity);
  const size_t batches = m_groups * (BATCH_LIMIT + 1);  // with a serial one for each group
  m_sizes.resize(queue, batches);
  out.groupBatches.resize(queue, m_groups);
  out.batchFirst.resize(queue, batches);
  m_total.resize(queue, 1);
  assignGroups(queue, world);
  const size_t local = queue.device().groupSize();
  const size_t groups = std::min(m_groups, queue.device().maxGroups());
  m_batch.launch(queue, {groups * local, local}, world.counters, out.split, m_groupFirst, m_order, m_headers, m_batchOf,
                 m_ranks, m_left, m_sizes, out.groupBatches);
  m_scan.exclusive(queue, {batches}, m_sizes, out.batchFirst, m_total);
  m_begin.launch(queue, {1, 1}, slots, world.counters, out.split, out.batchFirst, m_total, world.slotFirst);
  m_clear.launch(queue, queue.device().grid(slots), slots, world.counters, world.slots);
  m_fill.launch(queue, queue.device().grid(capacity), capacity, world.counters, out.split, m_keys, m_order, m_batchOf,
                m_ranks, out.batchFirst, m_headers, world.slots);
}

}  // namespace btgpu
