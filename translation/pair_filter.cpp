// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "pair_filter.h"

#include <algorithm>
#include <iterator>

#include "../gpu_engine/zone.h"
#include "host_contacts.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN

void PairFilter::listPairs(btDiscreteDynamicsWorld& world, WorldReader& reader) {
  const Zone zone("listPairs");
  constexpr std::size_t kGrain = 1024;
  const btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
  m_found.resize(static_cast<std::size_t>(pairs.size()));
  parallelFor(m_found.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const auto [a, b] = slotsOf(reader, pairs[static_cast<int>(i)]);
      // An object that is not in the world's list: no pair that the device could find.
      m_found[i] = a == kNoSlot || b == kNoSlot ? 0 : pairKeyOf(a, b);
    }
  });
  // The cache changes little from step to step, and most steps not at all.
  if (m_found != m_last) {
    m_sorted = m_found;
    std::sort(m_sorted.begin(), m_sorted.end());
    m_last.swap(m_found);
  }
  std::vector<ulong>& listed = reader.input().listedPairs;
  if (listed.empty()) {
    listed = m_sorted;
    return;
  }
  std::vector<ulong> allowed, kept;
  std::set_difference(m_sorted.begin(), m_sorted.end(), listed.begin(), listed.end(), std::back_inserter(allowed));
  std::set_intersection(m_sorted.begin(), m_sorted.end(), listed.begin(), listed.end(), std::back_inserter(kept));
  for (const ulong key : kept) allowed.push_back(key | PAIR_KEEPS_CONTACTS);
  listed.swap(allowed);
}

BTGPU_TRANSLATION_END
