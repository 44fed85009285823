// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_find_pairs_reference.h"

namespace btgpu {
namespace {

bool takesPart(const BodyInfo& b) {
  return (b.flags & BODY_PRESENT) && !(b.flags & BODY_QUARANTINED) && b.shapeIndex >= 0;
}

bool overlap(const Aabb& a, const Aabb& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x &&  //
         a.lower.y <= b.upper.y && b.lower.y <= a.upper.y &&  //
         a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

// btOverlappingPairCache::needsBroadphaseCollision without a callback; shapes of one compound don't meet.
bool filtersMatch(const BodyInfo& a, const BodyInfo& b) {
  if ((a.flags & BODY_CHILD) && (b.flags & BODY_CHILD) && a.parent == b.parent) return false;
  return (a.filterGroup & b.filterMask) && (b.filterGroup & a.filterMask);
}

}  // namespace

std::vector<ulong> findPairsReference(const std::vector<BodyInfo>& infos, const std::vector<Aabb>& aabbs) {
  std::vector<ulong> keys;
  for (size_t a = 0; a < infos.size(); ++a) {
    if (!takesPart(infos[a])) continue;
    for (size_t b = a + 1; b < infos.size(); ++b) {
      if (overlap(aabbs[a], aabbs[b]) && takesPart(infos[b]) && filtersMatch(infos[a], infos[b])) {
        keys.push_back(static_cast<ulong>(a) << 32 | b);
      }
    }
  }
  return keys;
}

}  // namespace btgpu
