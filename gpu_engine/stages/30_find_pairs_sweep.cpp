// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_find_pairs_sweep.h"

#include "../../kernels/shared/bvh.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs_sweep.cl";

}  // namespace

// ---- ranges

SweepRanges::SweepRanges(ComputeDevice& device) : m_sweepPieces(device, kFile, "sweepPieces"), m_scan(device) {}

void SweepRanges::resize(Queue& queue, size_t ranges, size_t places) {
  m_ranges = ranges;
  for (auto* array : {&selves, &from, &end, &pieces}) array->resize(queue, ranges);
  boxes.resize(queue, boxesInBlocks(static_cast<uint>(places)));
  order.resize(queue, places);
}

void SweepRanges::enqueue(Queue& queue, const DeviceWorld& world, PairList& pairs) {
  m_scan.exclusive(queue, {m_ranges}, pieces, m_firstPiece, m_pieceCount);
  // A range is a piece or several, and a piece is work enough for a work item of its own.
  constexpr size_t kPieceWork = 16;
  m_sweepPieces.launch(queue, queue.device().grid(m_ranges * kPieceWork), static_cast<uint>(m_ranges),
                       static_cast<uint>(world.capacities.pairs), m_pieceCount, m_firstPiece, selves, from, end,
                       world.infos, world.aabbs, boxes, order, pairs.listed, pairs.list);
}

// ---- axis

SweepAxis::SweepAxis(ComputeDevice& device)
    : m_spreadPartial(device, kFile, "spreadPartial"), m_sweepAxis(device, kFile, "sweepAxis") {}

void SweepAxis::enqueue(Queue& queue, const DeviceWorld& world) {
  const Grid grid = queue.device().chunkGrid(world.bodyCount);
  m_partial.resize(queue, 2 * grid.groups());
  axis.resize(queue, 1);
  m_spreadPartial.launch(queue, grid, static_cast<uint>(world.bodyCount), world.infos, world.aabbs, m_partial);
  m_sweepAxis.launch(queue, {grid.local, grid.local}, static_cast<uint>(grid.groups()), m_partial, axis);
}

// ---- the stage

FindPairsSweep::FindPairsSweep(ComputeDevice& device)
    : m_keysOf(device, kFile, "sweepKeys"),
      m_boxesOf(device, kFile, "sweepBoxes"),
      m_rangesOf(device, kFile, "sweepRanges"),
      m_sort(device),
      m_fill(device),
      m_axis(device),
      m_ranges(device),
      m_pairs(device) {}

void FindPairsSweep::sortBodies(Queue& queue, const DeviceWorld& world) {
  const size_t bodies = world.bodyCount;
  m_axis.enqueue(queue, world);
  m_keys.resize(queue, bodies);
  m_keysOf.launch(queue, queue.device().grid(bodies), static_cast<uint>(bodies), m_axis.axis, world.infos, world.aabbs,
                  m_keys, m_ranges.order);
  m_sort.pairs(queue, {bodies}, m_keys, m_ranges.order, {{0, 32}});
}

void FindPairsSweep::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("30_find_pairs_sweep");
  const size_t bodies = world.bodyCount;
  const uint count = static_cast<uint>(bodies);
  const Grid grid = queue.device().grid(bodies);
  m_pairs.begin(queue, world);
  m_ranges.resize(queue, bodies, bodies);
  m_taking.resize(queue, 1);
  m_fill.run(queue, m_taking, 0, 1, 0);
  sortBodies(queue, world);
  m_boxesOf.launch(queue, grid, count, m_keys, m_ranges.order, world.aabbs, m_ranges.boxes, m_taking);
  m_rangesOf.launch(queue, grid, count, m_axis.axis, m_taking, m_keys, m_ranges.order, world.aabbs, m_ranges.selves,
                    m_ranges.from, m_ranges.end, m_ranges.pieces);
  m_ranges.enqueue(queue, world, m_pairs);
  m_pairs.finish(queue, world);
}

}  // namespace btgpu
