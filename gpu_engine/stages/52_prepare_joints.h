// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Completes the rows that the host made of the joints. Reads joints, jointRows, steps; writes jointEffects[] and
// jointImpulses[] by row. Built when a world first has joints.
class PrepareJoints {
 public:
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_prepare;
};

}  // namespace btgpu
