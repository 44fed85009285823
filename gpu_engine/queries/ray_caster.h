// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "host_items.h"

namespace btgpu {

// Batches of rays through the world as it is now. Waits for the device, unlike a stage of the step.
class RayCaster {
 public:
  explicit RayCaster(ComputeDevice& device);

  // One hit a ray, and which of the host's objects it has to be tried against besides.
  void cast(Queue& queue, QueryArrays& arrays, const QueryWorld& world, const Ray* rays, size_t count,
            RayResults& results);

 private:
  Kernel m_castRays;
  HostItems m_hostItems;
  DeviceArray<Ray> m_rays{"rays"};
  DeviceArray<RayHit> m_hits{"ray hits"};
};

}  // namespace btgpu
