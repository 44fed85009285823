// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_separating_axis.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/44_find_separating_axis.cl";

}  // namespace

FindSeparatingAxis::FindSeparatingAxis(ComputeDevice& device)
    : m_findSeparatingAxis(device, kFile, "findSeparatingAxis"),
      m_countBoxPairs(device, kFile, "countBoxPairs"),
      m_compact(device) {}

void FindSeparatingAxis::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("44_find_separating_axis");
  const size_t capacity = world.capacities.pairs;
  world.axes.resize(queue, capacity);
  m_overlap.resize(queue, capacity);
  m_boxPairCount.resize(queue, 1);
  m_findSeparatingAxis.launch(queue, queue.device().grid(capacity), world.counters, world.bucketFirst, world.items,
                              world.pairs, world.infos, world.shapes, world.poses, world.contacts, world.axes,
                              m_overlap);
  m_countBoxPairs.launch(queue, {1, 1}, world.counters, world.bucketFirst, m_boxPairCount);
  m_compact.run(queue, {capacity, &m_boxPairCount}, m_overlap, world.overlapping, world.overlapCount);
}

}  // namespace btgpu
