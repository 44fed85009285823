// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "90_update_activation.h"

namespace btgpu {

UpdateActivation::UpdateActivation(ComputeDevice& device)
    : m_updateActivation(device, "stages/90_update_activation.cl", "updateActivation") {}

void UpdateActivation::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("90_update_activation");
  m_updateActivation.launch(queue, queue.device().grid(world.bodyCount), static_cast<uint>(world.bodyCount),
                            world.params, world.counters, world.infos, world.dampings, world.stepActivations,
                            world.velocities, world.activations);
}

}  // namespace btgpu
