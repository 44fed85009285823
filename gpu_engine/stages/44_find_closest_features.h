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
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void build(ComputeDevice& device);  // when a world first has such pairs

  Kernel m_countConvexPairs, m_findClosestFeatures, m_findWaysOut;
  Compact m_compact;
  DeviceArray<uint> m_convexCount{"convex pair count"}, m_near{"near pair flags"}, m_overlap{"core overlap flags"};
  DeviceArray<uint> m_overlapping{"overlapping cores"}, m_overlapCount{"overlapping core count"};
};

}  // namespace btgpu
