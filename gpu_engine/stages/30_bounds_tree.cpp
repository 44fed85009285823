// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_bounds_tree.h"

#include <algorithm>

#include "../../kernels/lib/bounds.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs.cl";
constexpr uint kMortonKeyBits = PAIR_SORT_BIT + 2;
constexpr uint kLowLevels = 4;  // that bvhLow makes

}  // namespace

SceneBounds::SceneBounds(ComputeDevice& device)
    : m_partialKernel(device, kFile, "sceneBoundsPartial"), m_finalKernel(device, kFile, "sceneBoundsFinal") {}

void SceneBounds::enqueue(Queue& queue, size_t count, const DeviceArray<BodyInfo>& infos,
                          const DeviceArray<Aabb>& aabbs) {
  const Grid grid = queue.device().chunkGrid(count);
  m_partial.resize(queue, grid.groups());
  scene.resize(queue, 1);
  m_partialKernel.launch(queue, grid, static_cast<uint>(count), infos, aabbs, m_partial);
  m_finalKernel.launch(queue, {grid.local, grid.local}, static_cast<uint>(grid.groups()), m_partial, scene);
}

BoundsTree::BoundsTree(ComputeDevice& device)
    : m_mortonKeys(device, kFile, "mortonKeys"),
      m_bvhLow(device, kFile, "bvhLow"),
      m_bvhHigh(device, kFile, "bvhHigh"),
      m_bounds(device),
      m_sort(device) {}

// The tree's shape depends on the number of AABBs alone.
void BoundsTree::layout(Queue& queue, size_t count) {
  if (m_count == count && !m_levels.empty()) return;
  m_levels.clear();
  BvhLevels levels{};
  size_t size = count, first = 0;
  while (true) {
    levels.first[levels.levelCount] = static_cast<uint>(first);
    levels.size[levels.levelCount] = static_cast<uint>(size);
    ++levels.levelCount;
    first += (size + BVH_ARITY - 1) / BVH_ARITY * BVH_ARITY;  // siblings lie together
    if (size <= 1) break;
    size = (size + BVH_ARITY - 1) / BVH_ARITY;
  }
  m_nodes.resize(queue, std::max<size_t>(first, BVH_ARITY));
  m_deviceLevels.resize(queue, 1);
  m_levels.assign(1, levels);  // from here on nothing throws for lack of memory
  m_count = count;
  m_deviceLevels.copyFromHost(queue, m_levels, false);
}

void BoundsTree::sort(Queue& queue, size_t count, const DeviceArray<BodyInfo>& infos, const DeviceArray<Aabb>& aabbs) {
  const size_t room = std::max<size_t>(1, count);
  m_mortonCodes.resize(queue, room);
  m_order.resize(queue, room);
  if (count == 0) return;
  m_bounds.enqueue(queue, count, infos, aabbs);
  m_mortonKeys.launch(queue, queue.device().grid(count), static_cast<uint>(count), infos, aabbs, m_bounds.scene,
                      m_mortonCodes, m_order);
  m_sort.pairs(queue, {count}, m_mortonCodes, m_order, {{0, kMortonKeyBits}});
}

void BoundsTree::refit(Queue& queue, size_t count, const DeviceArray<BodyInfo>& infos, const DeviceArray<Aabb>& aabbs) {
  layout(queue, count);
  m_counts.resize(queue, std::max<size_t>(1, count));
  if (count == 0) return;
  const size_t local = queue.device().groupSize();
  m_bvhLow.launch(queue, queue.device().grid(count), static_cast<uint>(count), m_deviceLevels, m_order, infos, aabbs,
                  m_nodes, m_counts);
  if (m_levels.front().levelCount > kLowLevels) m_bvhHigh.launch(queue, {local, local}, m_deviceLevels, m_nodes);
}

}  // namespace btgpu
