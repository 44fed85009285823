// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Starts a substep on top of one that may still run: its counters, in which the fate of the one before is lost. After
// an overflow or a quarantine there OVERFLOW_BEFORE is set, and nothing of the substep happens.
class FollowSubstep {
 public:
  explicit FollowSubstep(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_followSubstep;
};

}  // namespace btgpu
