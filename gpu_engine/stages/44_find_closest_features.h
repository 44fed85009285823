// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// Where the shapes of all convex pairs (BUCKET_FIRST_CONVEX to BUCKET_LAST_CONVEX) are closest, or by which axis they
// leave each other. Reads pairs, shapes, hulls, poses, oldManifolds; writes closest[] by position among the convex
// pairs, nearPairs[] (ascending positions of those that may touch) with nearCount, and clears the candidates of all
// convex pairs.
class FindClosestFeatures {
 public:
  explicit FindClosestFeatures(ComputeDevice& device) : m_compact(device) {}
  // `flat`, `curved`: whether the world may have pairs of BUCKET_FIRST_CONVEX to BUCKET_HULL_HULL, and of
  // BUCKET_CURVED.
  void enqueue(Queue& queue, DeviceWorld& world, bool flat = true, bool curved = true);

 private:
  struct Kernels {
    Kernel findClosestFeatures, findWaysOut;
  };
  // Built when a world first has such pairs.
  static void build(ComputeDevice& device, Kernels& kernels, const char* options);
  void enqueueSearch(Queue& queue, DeviceWorld& world, Kernels& kernels);
  void enqueueWaysOut(Queue& queue, DeviceWorld& world, Kernels& kernels);

  Kernel m_countConvexPairs;
  Kernels m_flat, m_curved;
  Compact m_compact;
  DeviceArray<uint> m_convexCount{"convex pair count"}, m_near{"near pair flags"}, m_overlap{"core overlap flags"};
  DeviceArray<uint> m_overlapping{"overlapping cores"}, m_overlapCount{"overlapping core count"};
};

}  // namespace btgpu
