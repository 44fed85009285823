// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>

#include "../step_settings.h"
#include "30_find_pairs.h"
#include "30_find_pairs_brute_force.h"
#include "30_find_pairs_grid.h"
#include "30_find_pairs_incremental.h"
#include "30_find_pairs_sweep.h"

namespace btgpu {

// The variants of stage 30. All leave the same; each is built when it is first wanted, the default at once.
class PairFinders {
 public:
  explicit PairFinders(ComputeDevice& device) : m_bvh(device) {}
  void enqueue(Queue& queue, DeviceWorld& world, PairFinder finder);
  // What is left of earlier steps on the device may be lost.
  void forget() { m_incremental.reset(); }

  static const char* stageOf(PairFinder finder);  // "30_find_pairs_grid"

 private:
  FindPairs m_bvh;
  std::unique_ptr<FindPairsGrid> m_grid;
  std::unique_ptr<FindPairsSweep> m_sweep;
  std::unique_ptr<FindPairsIncremental> m_incremental;
  std::unique_ptr<FindPairsBruteForce> m_bruteForce;
};

}  // namespace btgpu
