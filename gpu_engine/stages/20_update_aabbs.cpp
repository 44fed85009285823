// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "20_update_aabbs.h"

namespace btgpu {

UpdateAabbs::UpdateAabbs(ComputeDevice& device) : m_updateAabbs(device, "stages/20_update_aabbs.cl", "updateAabbs") {}

void UpdateAabbs::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("20_update_aabbs");
  m_updateAabbs.launch(queue, queue.device().grid(world.bodyCount), static_cast<uint>(world.bodyCount), world.params,
                       world.infos, world.shapes, world.hullVertices, world.poses, world.steps, world.hostAabbs,
                       world.activations, world.oldAabbs, world.aabbs, world.stepActivations, world.counters);
}

}  // namespace btgpu
