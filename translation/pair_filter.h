// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

// Where the application decides which pairs may collide (btOverlapFilterCallback), the host's broadphase asks it, once
// for each new pair; what it let through is in the pair cache. That covers all that the device finds: Bullet's AABBs
// are the same or larger.
class PairFilter {
 public:
  // Makes the input's listed pairs those of the cache, but for those that it lists as ignored so far. The reader must
  // have read the world, and the host's broadphase must be current.
  void listPairs(btDiscreteDynamicsWorld& world, WorldReader& reader);

 private:
  std::vector<ulong> m_found, m_last;  // in the cache's order: of this and of the last step
  std::vector<ulong> m_sorted;         // m_last in order
};

BTGPU_TRANSLATION_END
