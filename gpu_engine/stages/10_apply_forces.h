// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Damping, forces and gyroscopic terms of the step, world inertia, predicted pose.
// Reads the bodies' state, writes steps[] by body index; the state itself stays as it is.
class ApplyForces {
 public:
  explicit ApplyForces(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_applyForces;
};

}  // namespace btgpu
