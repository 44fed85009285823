// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Completes the rows that the host made of the joints. Reads joints, jointRows, steps; writes jointEffects[] and
// jointImpulses[] by row. Built when a world first has joints.
class PrepareJoints {
 public:
  explicit PrepareJoints(ComputeDevice& device) : m_device(device) {}
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  ComputeDevice& m_device;
  Kernel m_prepare;
  bool m_built = false;
};

}  // namespace btgpu
