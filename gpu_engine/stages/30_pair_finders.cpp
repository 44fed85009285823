// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_pair_finders.h"

namespace btgpu {
namespace {

template <typename Finder>
void enqueueOn(std::unique_ptr<Finder>& finder, Queue& queue, DeviceWorld& world) {
  if (!finder) finder = std::make_unique<Finder>(queue.device());
  finder->enqueue(queue, world);
}

}  // namespace

const char* PairFinders::stageOf(PairFinder finder) {
  switch (finder) {
    case PairFinder::Grid:
      return "30_find_pairs_grid";
    case PairFinder::Sweep:
      return "30_find_pairs_sweep";
    case PairFinder::IncrementalSweep:
      return "30_find_pairs_incremental";
    case PairFinder::BruteForce:
      return "30_find_pairs_brute_force";
    case PairFinder::Bvh:
      break;
  }
  return "30_find_pairs";
}

void PairFinders::enqueue(Queue& queue, DeviceWorld& world, PairFinder finder) {
  switch (finder) {
    case PairFinder::Grid:
      return enqueueOn(m_grid, queue, world);
    case PairFinder::Sweep:
      return enqueueOn(m_sweep, queue, world);
    case PairFinder::IncrementalSweep:
      return enqueueOn(m_incremental, queue, world);
    case PairFinder::BruteForce:
      return enqueueOn(m_bruteForce, queue, world);
    case PairFinder::Bvh:
      break;
  }
  m_bvh.enqueue(queue, world);
}

}  // namespace btgpu
