// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "30_bounds_tree.h"

namespace btgpu {

// Pairs of bodies with overlapping AABBs and matching filters, by a linear BVH over the Morton curve.
// Reads infos and aabbs; writes keys[] (sorted by lower, then higher body index) and pairCount.
class FindPairs {
 public:
  explicit FindPairs(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void sortBodies(Queue& queue, const DeviceWorld& world);

  Kernel m_countPairs, m_emitPairs, m_sortPairs;
  Scan m_scan;
  BoundsTree m_tree;
  size_t m_sortedBodies = 0;  // that the tree has an order of
  uint m_stepsSinceSort = 0;
  DeviceArray<ulong> m_sorted{"sorted pair keys"};
  DeviceArray<uint> m_found{"pairs found"}, m_kept{"pairs kept"}, m_offsets{"pair offsets"};
};

}  // namespace btgpu
