// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "65_prepare_contacts.h"

#include <algorithm>

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/65_prepare_contacts.cl";

}  // namespace

PrepareContacts::PrepareContacts(ComputeDevice& device) {
  if (device.shape() == KernelShape::Cpu) {
    m_both = Kernel(device, kFile, "prepareBodiesAndContacts");
  } else {
    m_prepareBodies = Kernel(device, kFile, "prepareBodies");
    m_prepareContacts = Kernel(device, kFile, "prepareContacts");
  }
}

void PrepareContacts::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("65_prepare_contacts");
  const uint bodies = static_cast<uint>(world.bodyCount), slots = static_cast<uint>(world.capacities.slots);
  if (m_both.isBuilt()) {
    m_both.launch(queue, queue.device().grid(std::max(bodies, slots)), bodies, slots, world.counters, world.params,
                  world.slots, world.infos, world.poses, world.steps, world.masses, world.materials, world.manifolds,
                  world.rows, world.tangent2, world.torsion, world.solverBodies, world.solverMasses);
    return;
  }
  m_prepareBodies.launch(queue, queue.device().grid(bodies), bodies, world.counters, world.steps, world.masses,
                         world.solverBodies, world.solverMasses);
  m_prepareContacts.launch(queue, queue.device().grid(slots), slots, world.counters, world.params, world.slots,
                           world.infos, world.poses, world.steps, world.masses, world.materials, world.manifolds,
                           world.rows, world.tangent2, world.torsion);
}

}  // namespace btgpu
