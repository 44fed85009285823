// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The implicit tree over the bodies sorted along a Morton curve: node j of level k bounds the sorted bodies
// [j, j + 1) * BVH_ARITY^k. Level 0 are the bodies themselves, the top level is one node.
#ifndef BTGPU_SHARED_BVH_H
#define BTGPU_SHARED_BVH_H
#include "types.h"

BTGPU_BEGIN

#define BVH_ARITY 8u
#define BVH_MAX_LEVELS 12
#define PAIRS_KEPT 16u  // pairs of a body that are kept from counting them to writing them
#define PAIRS_KEPT_OF_BLOCK 256u  // CPU shape: of BVH_ARITY bodies together

// Where each level begins in the array of node bounds, and how many nodes it has.
STRUCT(BvhLevels) {
  uint levelCount;
  uint first[BVH_MAX_LEVELS], size[BVH_MAX_LEVELS];
  uint unused[7];
};

// AABBs that an array of them in blocks has room for (lib/box_blocks.h).
LIB uint boxesInBlocks(uint count) { return (count + BVH_ARITY - 1u) / BVH_ARITY * BVH_ARITY; }

BTGPU_END
#endif
