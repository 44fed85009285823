// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// The end of a pair finder that appends to a list: keys[] (sorted by lower, then higher body index), pairCount and the
// counters, whatever order the list is in.
class PairList {
 public:
  explicit PairList(ComputeDevice& device);
  // An empty list with room for as many pairs as keys[] has.
  void begin(Queue& queue, const DeviceWorld& world);
  void finish(Queue& queue, DeviceWorld& world);

  DeviceArray<ulong> list{"listed pairs"};
  DeviceArray<uint> listed{"listed pair count"};

 private:
  Kernel m_count, m_emit, m_sort;
  Fill m_fill;
  Scan m_scan;
  DeviceArray<uint> m_counts{"pair counts"}, m_offsets{"pair offsets"}, m_total{"listed pairs counted"};
  DeviceArray<ulong> m_sorted{"sorted pair keys"};
};

}  // namespace btgpu
