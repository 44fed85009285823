// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "host_items.h"

namespace btgpu {

// Batches of sweeps through the world as it is now. Waits for the device, unlike a stage of the step.
class ConvexSweeper {
 public:
  explicit ConvexSweeper(ComputeDevice& device);

  // As RayCaster::cast. The sweeps' shapes are among the world's.
  void cast(Queue& queue, QueryArrays& arrays, const QueryWorld& world, const Sweep* sweeps, size_t count,
            SweepResults& results);

 private:
  Kernel m_castSweeps;
  HostItems m_hostItems;
  DeviceArray<Sweep> m_sweeps{"sweeps"};
  DeviceArray<SweepHit> m_hits{"sweep hits"};
};

}  // namespace btgpu
