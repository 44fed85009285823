// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "05_follow_substep.h"

namespace btgpu {

FollowSubstep::FollowSubstep(ComputeDevice& device)
    : m_followSubstep(device, "stages/05_follow_substep.cl", "followSubstep") {}

void FollowSubstep::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("05_follow_substep");
  m_followSubstep.launch(queue, {1, 1}, world.counters);
}

}  // namespace btgpu
