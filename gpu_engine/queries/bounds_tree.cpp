// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bounds_tree.h"

#include "../../kernels/lib/bounds.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs.cl";
constexpr uint kMortonKeyBits = PAIR_SORT_STATIC_BIT + 2;
constexpr uint kLowLevels = 4;  // that bvhLow makes

}  // namespace

BoundsTree::BoundsTree(ComputeDevice& device)
    : m_sceneBoundsPartial(device, kFile, "sceneBoundsPartial"),
      m_sceneBoundsFinal(device, kFile, "sceneBoundsFinal"),
      m_mortonKeys(device, kFile, "mortonKeys"),
      m_bvhLow(device, kFile, "bvhLow"),
      m_bvhHigh(device, kFile, "bvhHigh"),
      m_sort(device) {}

void BoundsTree::layout(Queue& queue, size_t count) {
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
  m_levels.assign(1, levels);
  m_deviceLevels.copyFromHost(queue, m_levels, false);
}

void BoundsTree::build(Queue& queue, size_t count, const DeviceArray<BodyInfo>& infos, const DeviceArray<Aabb>& aabbs) {
  layout(queue, count);
  const size_t room = std::max<size_t>(1, count);
  m_order.resize(queue, room);
  m_counts.resize(queue, room);
  m_mortonCodes.resize(queue, room);
  if (count == 0) return;
  const uint items = static_cast<uint>(count);
  const Grid boundsGrid = queue.device().chunkGrid(count), grid = queue.device().grid(count);
  m_partialBounds.resize(queue, boundsGrid.groups());
  m_scene.resize(queue, 1);
  m_sceneBoundsPartial.launch(queue, boundsGrid, items, infos, aabbs, m_partialBounds);
  m_sceneBoundsFinal.launch(queue, {boundsGrid.local, boundsGrid.local}, static_cast<uint>(boundsGrid.groups()),
                            m_partialBounds, m_scene);
  m_mortonKeys.launch(queue, grid, items, infos, aabbs, m_scene, m_mortonCodes, m_order);
  m_sort.pairs(queue, {count}, m_mortonCodes, m_order, {{0, kMortonKeyBits}});
  m_bvhLow.launch(queue, grid, items, m_deviceLevels, m_order, aabbs, m_nodes, m_counts);
  const size_t local = queue.device().groupSize();
  if (m_levels.front().levelCount > kLowLevels) m_bvhHigh.launch(queue, {local, local}, m_deviceLevels, m_nodes);
}

}  // namespace btgpu
