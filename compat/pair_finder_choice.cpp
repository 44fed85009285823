// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "pair_finder_choice.h"

#include <cstdio>
#include <mutex>

#include "environment.h"

namespace btgpu {
namespace {

PairFinder engineFinder(btGpuPairFinder finder) {
  switch (finder) {
    case btGpuPairFinder::Grid:
      return PairFinder::Grid;
    case btGpuPairFinder::Sweep:
      return PairFinder::Sweep;
    case btGpuPairFinder::IncrementalSweep:
      return PairFinder::IncrementalSweep;
    case btGpuPairFinder::BruteForce:
      return PairFinder::BruteForce;
    case btGpuPairFinder::Bvh:
      break;
  }
  return PairFinder::Bvh;
}

}  // namespace

const std::vector<std::pair<std::string, PairFinder>>& pairFinderNames() {
  static const std::vector<std::pair<std::string, PairFinder>> names = {{"bvh", PairFinder::Bvh},
                                                                        {"grid", PairFinder::Grid},
                                                                        {"sweep", PairFinder::Sweep},
                                                                        {"incremental", PairFinder::IncrementalSweep},
                                                                        {"brute_force", PairFinder::BruteForce}};
  return names;
}

PairFinder pairFinderOf(const btGpuSettings& settings) {
  if (settings.m_pairFinder) return engineFinder(*settings.m_pairFinder);
  const char* wanted = environment("BTGPU_PAIR_FINDER");
  if (!wanted) return PairFinder::Bvh;
  for (const auto& [name, value] : pairFinderNames()) {
    if (name == wanted) return value;
  }
  static std::once_flag said;
  std::call_once(said, [wanted] {
    std::fprintf(stderr,
                 "btgpu: BTGPU_PAIR_FINDER=%s is no pair finder; bvh, grid, sweep, incremental, brute_force are\n",
                 wanted);
  });
  return PairFinder::Bvh;
}

}  // namespace btgpu
