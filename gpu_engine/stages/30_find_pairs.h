// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../../kernels/lib/bounds.h"
#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// Pairs of bodies with overlapping AABBs and matching filters, by a linear BVH over the Morton curve.
// Reads infos and aabbs; writes keys[] (sorted by lower, then higher body index) and pairCount.
class FindPairs {
 public:
  explicit FindPairs(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void sortBodies(Queue& queue, const DeviceWorld& world);
  void layoutTree(Queue& queue, size_t bodyCount);
  void buildTree(Queue& queue, const DeviceWorld& world);

  Kernel m_sceneBoundsPartial, m_sceneBoundsFinal, m_mortonKeys, m_bvhLow, m_bvhHigh;
  Kernel m_countPairs, m_emitPairs, m_sortPairs;
  RadixSort<ulong> m_sort;
  Scan m_scan;
  size_t m_sortedBodies = 0;  // that m_order is an order of
  uint m_stepsSinceSort = 0;
  size_t m_treeBodies = 0;  // that the levels were laid out for
  std::vector<BvhLevels> m_levels;
  DeviceArray<BvhLevels> m_deviceLevels{"bvh levels"};
  DeviceArray<Aabb> m_partialBounds{"partial scene bounds"}, m_scene{"scene bounds"}, m_nodes{"bvh nodes"};
  DeviceArray<ulong> m_mortonCodes{"morton keys"}, m_sorted{"sorted pair keys"};
  DeviceArray<uint> m_order{"morton order"}, m_found{"pairs found"}, m_kept{"pairs kept"};
  DeviceArray<uint> m_counts{"pair counts"}, m_offsets{"pair offsets"};
};

}  // namespace btgpu
