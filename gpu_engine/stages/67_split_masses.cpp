// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "67_split_masses.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/67_split_masses.cl";

}  // namespace

SplitMasses::SplitMasses(ComputeDevice& device)
    : m_bodies(device, kFile, "splitBodies"),
      m_contacts(device, kFile, "splitContacts"),
      m_joints(device, kFile, "splitJointRows") {}

void SplitMasses::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("67_split_masses");
  SplitArrays& split = world.split;
  const uint bodies = static_cast<uint>(world.bodyCount), slots = static_cast<uint>(world.capacities.slots);
  const size_t copies = 2 * (size_t{slots} + world.jointCount);
  split.copies.resize(queue, copies);
  split.copyMasses.resize(queue, copies);
  m_bodies.launch(queue, queue.device().grid(bodies), bodies, world.counters, split.copyFirst, world.solverMasses,
                  split.copies, split.copyMasses);
  m_contacts.launch(queue, queue.device().grid(slots), slots, world.counters, world.params, world.slots,
                    split.copyFirst, world.manifolds, world.steps, world.masses, world.rows, world.tangent2,
                    world.torsion);
  if (world.jointCount == 0) return;
  split.jointRows.resize(queue, world.jointRows.size());
  m_joints.launch(queue, queue.device().grid(world.jointCount), world.jointCount, world.counters, world.joints,
                  world.jointRows, split.joints, split.copyFirst, world.steps, world.jointEffects, split.jointRows);
}

}  // namespace btgpu
