// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Commits the activation states and advances the sleep timers.
class UpdateActivation {
 public:
  explicit UpdateActivation(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_updateActivation;
};

}  // namespace btgpu
