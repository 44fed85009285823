// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/bvh.h"
#include "../opencl/kernel.h"
#include "../primitives/primitives.h"

namespace btgpu {

// Bounds of the centres of AABBs, in two launches. What takes no part, and what is boundless, says nothing.
class SceneBounds {
 public:
  explicit SceneBounds(ComputeDevice& device);
  void enqueue(Queue& queue, size_t count, const DeviceArray<BodyInfo>& infos, const DeviceArray<Aabb>& aabbs);
  DeviceArray<Aabb> scene{"scene bounds"};  // 1

 private:
  Kernel m_partialKernel, m_finalKernel;
  DeviceArray<Aabb> m_partial{"partial scene bounds"};
};

// The linear BVH over AABBs (kernels/shared/bvh.h) of bodies, or of a query's items. No result depends on the order
// that it was sorted in.
class BoundsTree {
 public:
  explicit BoundsTree(ComputeDevice& device);

  // Orders the first `count` AABBs along the Morton curve.
  void sort(Queue& queue, size_t count, const DeviceArray<BodyInfo>& infos, const DeviceArray<Aabb>& aabbs);
  // The tree over them in the order of the last sort(), which was one of as many; the AABBs may be others by now.
  void refit(Queue& queue, size_t count, const DeviceArray<BodyInfo>& infos, const DeviceArray<Aabb>& aabbs);

  // Of arrays with at least one element each, if only so that kernels can be given them.
  const DeviceArray<BvhLevels>& levels() const { return m_deviceLevels; }
  const DeviceArray<Aabb>& nodes() const { return m_nodes; }
  const DeviceArray<uint>& order() const { return m_order; }
  DeviceArray<uint>& counts() { return m_counts; }  // one an AABB: zero after refit(), for who finds pairs

 private:
  void layout(Queue& queue, size_t count);

  Kernel m_mortonKeys, m_bvhLow, m_bvhHigh;
  SceneBounds m_bounds;
  RadixSort<ulong> m_sort;
  size_t m_count = 0;               // that the levels were laid out for
  std::vector<BvhLevels> m_levels;  // 1, once they were
  DeviceArray<BvhLevels> m_deviceLevels{"bvh levels"};
  DeviceArray<Aabb> m_nodes{"bvh nodes"};
  DeviceArray<ulong> m_mortonCodes{"morton keys"};
  DeviceArray<uint> m_order{"morton order"}, m_counts{"pair counts"};
};

}  // namespace btgpu
