// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "65_prepare_soft_contacts.h"

namespace btgpu {

void PrepareSoftContacts::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("65_prepare_soft_contacts");
  constexpr const char* kFile = "stages/65_prepare_soft_contacts.cl";
  if (!m_prepareBodies.isBuilt()) {
    m_prepareBodies = Kernel(queue.device(), kFile, "prepareSoftBodies");
    m_prepareContacts = Kernel(queue.device(), kFile, "prepareSoftContacts");
  }
  const uint bodies = static_cast<uint>(world.bodyCount), slots = static_cast<uint>(world.capacities.slots);
  m_prepareBodies.launch(queue, queue.device().grid(bodies), bodies, world.counters, world.params, world.steps,
                         world.masses, world.solverBodies, world.solverMasses, world.substepStarts);
  m_prepareContacts.launch(queue, queue.device().grid(slots), slots, world.counters, world.params, world.slots,
                           world.infos, world.poses, world.steps, world.masses, world.materials, world.solverMasses,
                           world.manifolds, world.softRows, world.rolls);
}

}  // namespace btgpu
