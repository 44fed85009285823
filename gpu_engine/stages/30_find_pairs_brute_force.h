// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "30_sort_pairs.h"

namespace btgpu {

// 30_find_pairs by trying each body with every other. For tests and small worlds.
class FindPairsBruteForce {
 public:
  explicit FindPairsBruteForce(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  const DeviceArray<Aabb>& layBoxes(Queue& queue, const DeviceWorld& world);

  Kernel m_layBoxes, m_brutePairs;
  PairList m_pairs;
  DeviceArray<Aabb> m_boxes{"boxes in blocks"};
  DeviceArray<uint> m_order{"bodies in blocks"};
};

}  // namespace btgpu
