// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "35_group_pairs.h"

namespace btgpu {
namespace {

constexpr uint kBucketBits = 5;
static_assert(BUCKET_COUNT <= 1u << kBucketBits);

}  // namespace

GroupPairs::GroupPairs(ComputeDevice& device)
    : m_describePairs(device, "stages/35_group_pairs.cl", "describePairs"), m_sort(device), m_boundSearch(device) {}

void GroupPairs::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("35_group_pairs");
  const size_t capacity = world.capacities.pairs;
  const Count count{capacity, &world.pairCount};
  m_buckets.resize(queue, capacity);
  m_describePairs.launch(queue, queue.device().grid(capacity), static_cast<uint>(capacity), world.counters,
                         static_cast<uint>(world.oldKeys.size()), world.oldPairCount, world.keys, world.oldKeys,
                         world.infos, world.shapes, world.stepActivations, world.born, world.listed(),
                         world.listedPairs, world.pairs, m_buckets, world.items);
  m_sort.pairs(queue, count, m_buckets, world.items, {{0, kBucketBits}});
  m_boundSearch.lower(queue, count, m_buckets, BUCKET_COUNT + 1, world.bucketFirst);
}

}  // namespace btgpu
