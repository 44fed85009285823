// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <array>

#include "30_find_pairs_sweep.h"

namespace btgpu {

// 30_find_pairs by an incremental sweep along three axes. Keeps the bodies, the order of their ends and the pairs of
// the last step that it was asked for, whichever that was: any that found room for its pairs will do.
class FindPairsIncremental {
 public:
  explicit FindPairsIncremental(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void begin(Queue& queue, const DeviceWorld& world);
  void sortEnds(Queue& queue, const DeviceWorld& world, uint axis);
  void rank(Queue& queue, size_t bodies, const DeviceArray<uint>& order, DeviceArray<uint>& ranks,
            DeviceArray<uint>& ranked);
  void findChanges(Queue& queue, const DeviceWorld& world, uint axis);
  void findFresh(Queue& queue, const DeviceWorld& world);
  void remember(Queue& queue, const DeviceWorld& world);

  Kernel m_bodyKinds, m_endKeys, m_stayingEnds, m_rankEnds, m_clearGone, m_changedPairs, m_keptPairs;
  Kernel m_lowerEnds, m_freshRanges, m_freshPieces, m_rememberBodies, m_rememberPairs;
  RadixSort<uint> m_sort;
  Scan m_scan;
  Fill m_fill;
  SweepAxis m_axis;
  SweepRanges m_ranges;
  PairList m_pairs;

  // Of the last step. m_known: 0 if nothing is.
  bool m_whole = false;  // all of it was enqueued
  size_t m_oldCount = 0;
  DeviceArray<uint> m_known{"old step known"}, m_oldPairCount{"old swept pair count"};
  DeviceArray<BodyInfo> m_oldInfos{"old infos"};
  DeviceArray<Aabb> m_oldAabbs{"old aabbs"};
  DeviceArray<ulong> m_oldKeys{"old swept keys"};
  std::array<DeviceArray<uint>, 3> m_oldOrder;  // of ends, by axis

  std::array<DeviceArray<uint>, 3> m_order;
  DeviceArray<uint> m_kinds{"body kinds"}, m_keys{"end keys"}, m_gone{"pairs gone"};
  DeviceArray<uint> m_flags{"end flags"}, m_offsets{"end offsets"}, m_total{"end total"};
  DeviceArray<uint> m_fresh{"fresh flags"}, m_freshOffsets{"fresh offsets"};
  DeviceArray<uint> m_ranks{"end ranks"}, m_ranked{"ranked ends"};
  DeviceArray<uint> m_oldRanks{"old end ranks"}, m_oldRanked{"old ranked ends"};
};

}  // namespace btgpu
