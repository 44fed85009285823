// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_separating_axis.h"

namespace btgpu {
FindSeparatingAxis::FindSeparatingAxis(ComputeDevice& device)
    : m_findSeparatingAxis(device, "stages/44_find_separating_axis.cl", "findSeparatingAxis") {}

void FindSeparatingAxis::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("44_find_separating_axis");
  const size_t capacity = world.capacities.pairs;
  world.axes.resize(queue, capacity);
  m_findSeparatingAxis.launch(queue, queue.device().grid(capacity), world.counters, world.bucketFirst, world.items,
                              world.pairs, world.infos, world.shapes, world.poses, world.contacts, world.axes);
}

}  // namespace btgpu
