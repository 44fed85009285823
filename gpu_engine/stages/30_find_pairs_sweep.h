// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "30_sort_pairs.h"

namespace btgpu {

// Ranges of places in an array of boxes, each met by one body; what both sweeps do with them.
class SweepRanges {
 public:
  explicit SweepRanges(ComputeDevice& device);
  // Makes room for the arrays below.
  void resize(Queue& queue, size_t ranges, size_t places);
  // Appends the pairs of range r = 0 ... ranges - 1.
  void enqueue(Queue& queue, const DeviceWorld& world, PairList& pairs);

  // By range: who meets, from where to where, and how many pieces (PIECE) that is.
  DeviceArray<uint> selves{"sweep bodies"}, from{"sweep from"}, end{"sweep end"}, pieces{"sweep pieces"};
  // By place: boxes, in blocks, and whose they are.
  DeviceArray<Aabb> boxes{"sweep boxes"};
  DeviceArray<uint> order{"sweep order"};

 private:
  Kernel m_sweepPieces;
  Scan m_scan;
  size_t m_ranges = 0;
  DeviceArray<uint> m_firstPiece{"sweep piece starts"}, m_pieceCount{"sweep piece count"};
};

// Along which axis the centres vary most.
class SweepAxis {
 public:
  explicit SweepAxis(ComputeDevice& device);
  void enqueue(Queue& queue, const DeviceWorld& world);

  DeviceArray<uint> axis{"sweep axis"};

 private:
  Kernel m_spreadPartial, m_sweepAxis;
  DeviceArray<float4> m_partial{"partial spreads"};
};

// 30_find_pairs by a sweep along the axis of largest variance.
class FindPairsSweep {
 public:
  explicit FindPairsSweep(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void sortBodies(Queue& queue, const DeviceWorld& world);

  Kernel m_keysOf, m_boxesOf, m_rangesOf;
  RadixSort<uint> m_sort;
  Fill m_fill;
  SweepAxis m_axis;
  SweepRanges m_ranges;
  PairList m_pairs;
  DeviceArray<uint> m_keys{"sweep keys"}, m_taking{"sweep count"};
};

}  // namespace btgpu
