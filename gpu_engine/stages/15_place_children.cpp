// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "15_place_children.h"

namespace btgpu {

void PlaceChildren::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("15_place_children");
  if (!m_placeChildren.isBuilt()) {
    m_placeChildren = Kernel(queue.device(), "stages/15_place_children.cl", "placeChildren");
  }
  m_placeChildren.launch(queue, queue.device().grid(world.bodyCount), static_cast<uint>(world.bodyCount),
                         world.counters, world.childPoses, world.infos, world.poses, world.steps, world.activations);
}

}  // namespace btgpu
