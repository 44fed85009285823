// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "35_group_pairs.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/35_group_pairs.cl";
constexpr uint kBucketBits = 5;
static_assert(BUCKET_COUNT <= 1u << kBucketBits);

}  // namespace

GroupPairs::GroupPairs(ComputeDevice& device)
    : m_describePairs(device, kFile, "describePairs"), m_sort(device), m_boundSearch(device) {
  if (device.shape() == KernelShape::Cpu) m_listPairs = Kernel(device, kFile, "listPairs");
}

void GroupPairs::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("35_group_pairs");
  const size_t capacity = world.capacities.pairs;
  const uint limit = static_cast<uint>(capacity);
  const bool cpu = m_listPairs.isBuilt();
  const Grid grid = queue.device().grid(capacity);
  m_buckets.resize(queue, capacity);
  m_tables.resize(queue, cpu ? grid.groups() * BUCKET_COUNT : 0);
  m_describePairs.launch(queue, grid, limit, world.counters, static_cast<uint>(world.oldKeys.size()),
                         world.oldPairCount, world.keys, world.oldKeys, world.infos, world.shapes,
                         world.stepActivations, world.born, world.listed(), world.listedPairs, world.pairs, m_buckets,
                         cpu ? m_tables : world.items);
  if (cpu) {
    m_listPairs.launch(queue, grid, limit, world.counters, m_buckets, m_tables, world.items, world.bucketFirst);
    return;
  }
  const Count count{capacity, &world.pairCount};
  m_sort.pairs(queue, count, m_buckets, world.items, {{0, kBucketBits}});
  m_boundSearch.lower(queue, count, m_buckets, BUCKET_COUNT + 1, world.bucketFirst);
}

}  // namespace btgpu
