// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "10_apply_forces.h"

namespace btgpu {

ApplyForces::ApplyForces(ComputeDevice& device) : m_applyForces(device, "stages/10_apply_forces.cl", "applyForces") {}

void ApplyForces::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("10_apply_forces");
  m_applyForces.launch(queue, queue.device().grid(world.bodyCount), static_cast<uint>(world.bodyCount), world.params,
                       world.infos, world.poses, world.velocities, world.forces, world.masses, world.dampings,
                       world.steps);
}

}  // namespace btgpu
