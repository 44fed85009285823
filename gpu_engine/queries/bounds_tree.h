// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "../opencl/kernel.h"
#include "../primitives/primitives.h"

namespace btgpu {

// The tree of stage 30 over any AABBs (kernels/shared/bvh.h), by that stage's kernels.
class BoundsTree {
 public:
  explicit BoundsTree(ComputeDevice& device);

  // Over the first `count` AABBs, whose infos have to have BODY_PRESENT.
  void build(Queue& queue, size_t count, const DeviceArray<BodyInfo>& infos, const DeviceArray<Aabb>& aabbs);

  // Of arrays with at least one element each, if only so that kernels can be given them.
  const DeviceArray<BvhLevels>& levels() const { return m_deviceLevels; }
  const DeviceArray<Aabb>& nodes() const { return m_nodes; }
  const DeviceArray<uint>& order() const { return m_order; }

 private:
  void layout(Queue& queue, size_t count);

  Kernel m_sceneBoundsPartial, m_sceneBoundsFinal, m_mortonKeys, m_bvhLow, m_bvhHigh;
  RadixSort<ulong> m_sort;
  std::vector<BvhLevels> m_levels;
  DeviceArray<BvhLevels> m_deviceLevels{"query bvh levels"};
  DeviceArray<Aabb> m_partialBounds{"query partial bounds"}, m_scene{"query bounds"}, m_nodes{"query bvh nodes"};
  DeviceArray<ulong> m_mortonCodes{"query morton keys"};
  DeviceArray<uint> m_order{"query morton order"}, m_counts{"query pair counts"};  // m_counts: bvhLow clears them
};

}  // namespace btgpu
