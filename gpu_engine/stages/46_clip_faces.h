// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Contact candidates of the box-box pairs that overlap. Reads what stage 44 wrote; writes contacts[] by pair index.
class ClipFaces {
 public:
  explicit ClipFaces(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_clipFaces;
};

}  // namespace btgpu
