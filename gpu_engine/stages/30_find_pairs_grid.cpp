// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_find_pairs_grid.h"

#include <algorithm>

#include "../../kernels/shared/bvh.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs_grid.cl";
constexpr size_t kSizeClasses = 1024;  // SIZE_CLASSES in kFile

// Large bodies meet all others, so that there should be few; and cells should be no larger than needed.
size_t mostLarge(size_t bodies) { return 16 + bodies / 1024; }

// About as many cells as bodies, at least four an axis.
uint cellBitsFor(size_t bodies) {
  uint bits = 6;
  while (bits < 24 && (size_t{1} << bits) < bodies) ++bits;
  return bits;
}

}  // namespace

FindPairsGrid::FindPairsGrid(ComputeDevice& device)
    : m_sizeClasses(device, kFile, "sizeClasses"),
      m_chooseGrid(device, kFile, "chooseGrid"),
      m_gridKeys(device, kFile, "gridKeys"),
      m_gridBoxes(device, kFile, "gridBoxes"),
      m_gridPairs(device, kFile, "gridPairs"),
      m_largePairs(device, kFile, "largePairs"),
      m_bounds(device),
      m_histogram(device),
      m_sort(device),
      m_fill(device),
      m_scan(device),
      m_pairs(device) {}

void FindPairsGrid::chooseGrid(Queue& queue, const DeviceWorld& world, uint cellBits) {
  const size_t bodies = world.bodyCount;
  const uint count = static_cast<uint>(bodies);
  m_bounds.enqueue(queue, bodies, world.infos, world.aabbs);
  m_classes.resize(queue, bodies);
  m_sizeClasses.launch(queue, queue.device().grid(bodies), count, world.infos, world.aabbs, m_classes);
  m_histogram.run(queue, {bodies}, m_classes, kSizeClasses + 1, m_sizes);
  m_frame.resize(queue, 1);
  m_bits.resize(queue, 3);
  m_chooseGrid.launch(queue, {1, 1}, static_cast<uint>(mostLarge(bodies)), cellBits, m_sizes, m_bounds.scene, m_frame,
                      m_bits);
}

void FindPairsGrid::sortBodies(Queue& queue, const DeviceWorld& world, uint cellBits) {
  const size_t bodies = world.bodyCount, keys = (size_t{1} << cellBits) + 2;
  const uint count = static_cast<uint>(bodies), cells = 1u << cellBits;
  const Grid grid = queue.device().grid(bodies);
  m_keys.resize(queue, bodies);
  m_order.resize(queue, bodies);
  m_inCell.resize(queue, keys);
  m_fill.run(queue, m_inCell, 0, keys, 0);
  m_gridKeys.launch(queue, grid, count, cells, world.infos, world.aabbs, m_frame, m_bits, m_keys, m_order, m_inCell);
  m_scan.exclusive(queue, {keys}, m_inCell, m_cellFirst, m_cellTotal);
  m_sort.pairs(queue, {bodies}, m_keys, m_order, {{0, cellBits + 1}});
  m_boxes.resize(queue, boxesInBlocks(count));
  m_gridBoxes.launch(queue, grid, count, m_order, world.aabbs, m_boxes);
}

void FindPairsGrid::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("30_find_pairs_grid");
  const size_t bodies = world.bodyCount;
  const uint count = static_cast<uint>(bodies), capacity = static_cast<uint>(world.capacities.pairs);
  const uint cellBits = cellBitsFor(bodies), cells = 1u << cellBits;
  m_pairs.begin(queue, world);
  chooseGrid(queue, world, cellBits);
  sortBodies(queue, world, cellBits);
  m_gridPairs.launch(queue, queue.device().grid(bodies), count, cells, capacity, m_cellFirst, m_frame, m_bits,
                     world.infos, m_boxes, m_order, m_pairs.listed, m_pairs.list);
  m_largePairs.launch(queue, queue.device().grid(bodies), count, cells, capacity, m_cellFirst, world.infos, m_boxes,
                      m_order, m_pairs.listed, m_pairs.list);
  m_pairs.finish(queue, world);
}

}  // namespace btgpu
