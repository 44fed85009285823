// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "52_prepare_joints.h"

namespace btgpu {

void PrepareJoints::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("52_prepare_joints");
  if (!m_prepare.isBuilt()) m_prepare = Kernel(queue.device(), "stages/52_prepare_joints.cl", "prepareJoints");
  m_prepare.launch(queue, queue.device().grid(world.jointCount), world.jointCount, world.counters, world.joints,
                   world.jointRows, world.steps, world.jointEffects, world.jointImpulses);
}

}  // namespace btgpu
