// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// World AABBs, grown by the contact threshold and the predicted motion; bodies out of bounds are disabled.
// Reads shapes, poses, steps; writes aabbs[] and stepActivations[] by body index.
class UpdateAabbs {
 public:
  explicit UpdateAabbs(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_updateAabbs;
};

}  // namespace btgpu
