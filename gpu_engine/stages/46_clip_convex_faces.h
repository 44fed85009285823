// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Contact candidates of the convex pairs that are near each other: faces clipped by each other, at most four points
// picked. Reads closest[] and nearPairs[] of stage 44; writes contacts[] by pair index.
class ClipConvexFaces {
 public:
  // `flat`, `curved`: as for stage 44.
  void enqueue(Queue& queue, DeviceWorld& world, bool flat = true, bool curved = true);

 private:
  static void enqueue(Queue& queue, DeviceWorld& world, Kernel& kernel, const char* options);

  Kernel m_flat, m_curved;  // built when a world first has such pairs
};

}  // namespace btgpu
