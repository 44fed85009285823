// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "80_integrate_poses.h"

namespace btgpu {

IntegratePoses::IntegratePoses(ComputeDevice& device)
    : m_integratePoses(device, "stages/80_integrate_poses.cl", "integratePoses") {}

void IntegratePoses::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("80_integrate_poses");
  m_integratePoses.launch(queue, queue.device().grid(world.bodyCount), static_cast<uint>(world.bodyCount), world.params,
                          world.counters, world.steps, world.solverBodies, world.solved, world.stepActivations,
                          world.infos, world.poses, world.velocities);
}

}  // namespace btgpu
