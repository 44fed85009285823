// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "48_reduce_and_match_contacts.h"

namespace btgpu {

ReduceAndMatchContacts::ReduceAndMatchContacts(ComputeDevice& device)
    : m_matchContacts(device, "stages/48_reduce_and_match_contacts.cl", "matchContacts") {}

void ReduceAndMatchContacts::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("48_reduce_and_match_contacts");
  const size_t capacity = world.capacities.pairs;
  Grid grid = queue.device().grid(capacity);
  if (queue.device().shape() == KernelShape::Gpu) grid = {grid.global / MATCH_GROUP * MATCH_GROUP, MATCH_GROUP};
  m_matchContacts.launch(queue, grid, static_cast<uint>(capacity), world.counters, world.params, world.pairs,
                         world.contacts, world.oldManifolds, world.infos, world.shapes, world.poses, world.materials,
                         world.manifolds);
}

}  // namespace btgpu
