// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "65_prepare_contacts.h"

namespace btgpu {

PrepareContacts::PrepareContacts(ComputeDevice& device)
    : m_prepareBodies(device, "stages/65_prepare_contacts.cl", "prepareBodies"),
      m_prepareContacts(device, "stages/65_prepare_contacts.cl", "prepareContacts") {}

void PrepareContacts::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("65_prepare_contacts");
  const uint bodies = static_cast<uint>(world.bodyCount), slots = static_cast<uint>(world.capacities.slots);
  m_prepareBodies.launch(queue, queue.device().grid(bodies), bodies, world.counters, world.steps, world.masses,
                         world.solverBodies, world.solverMasses);
  m_prepareContacts.launch(queue, queue.device().grid(slots), slots, world.counters, world.params, world.slots,
                           world.infos, world.poses, world.steps, world.masses, world.materials, world.manifolds,
                           world.rows, world.tangent2, world.torsion);
}

}  // namespace btgpu
