// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// Separating axis test of all box-box pairs; those that overlap are listed by stream compaction.
// Reads pairs, shapes, poses; writes axes[] by position in the bucket, overlapping[] (ascending positions) with
// overlapCount, and clears the candidates of all box-box pairs.
class FindSeparatingAxis {
 public:
  explicit FindSeparatingAxis(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_findSeparatingAxis, m_countBoxPairs;
  Compact m_compact;
  DeviceArray<uint> m_overlap{"box overlap flags"}, m_boxPairCount{"box pair count"};
};

}  // namespace btgpu
