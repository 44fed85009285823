// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../opencl/kernel.h"

namespace btgpu {

// Separating axis test of all box-box pairs. Reads pairs, shapes, poses; writes axes[] by position in the bucket, and
// clears the candidates of all box-box pairs.
class FindSeparatingAxis {
 public:
  explicit FindSeparatingAxis(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_findSeparatingAxis;
};

}  // namespace btgpu
