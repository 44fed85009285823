// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Commits velocities and poses: the first stage that changes the state of the world.
class IntegratePoses {
 public:
  explicit IntegratePoses(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_integratePoses;
};

}  // namespace btgpu
