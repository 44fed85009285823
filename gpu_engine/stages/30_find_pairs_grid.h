// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "30_bounds_tree.h"
#include "30_sort_pairs.h"

namespace btgpu {

// 30_find_pairs by a uniform grid; the largest bodies, and those wider than a cell, apart.
class FindPairsGrid {
 public:
  explicit FindPairsGrid(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void chooseGrid(Queue& queue, const DeviceWorld& world, uint cellBits);
  void sortBodies(Queue& queue, const DeviceWorld& world, uint cellBits);

  Kernel m_sizeClasses, m_chooseGrid;
  Kernel m_gridKeys, m_gridBoxes, m_gridPairs, m_largePairs;
  SceneBounds m_bounds;
  Histogram m_histogram;
  RadixSort<uint> m_sort;
  Fill m_fill;
  Scan m_scan;
  PairList m_pairs;
  DeviceArray<Aabb> m_boxes{"grid boxes"};
  DeviceArray<uint> m_classes{"size classes"}, m_sizes{"size histogram"}, m_bits{"grid bits"};
  DeviceArray<float4> m_frame{"grid frame"};
  DeviceArray<uint> m_keys{"grid keys"}, m_order{"grid order"}, m_inCell{"bodies in cells"};
  DeviceArray<uint> m_cellFirst{"cell starts"}, m_cellTotal{"bodies in all cells"};
};

}  // namespace btgpu
