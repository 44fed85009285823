// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What all pair finders share: which items may form a pair, the list that they append to in any order, and where a pair
// goes behind those of lower items. An item is what has an AABB; item i is body i. OpenCL C only.
#ifndef BTGPU_LIB_PAIR_LIST_H
#define BTGPU_LIB_PAIR_LIST_H
#include "../shared/contact.h"
#include "bounds.h"
#include "box_blocks.h"
#include "kernel.h"

// The filter: `info` is that of item i.
static inline int mayMeet(CHECKS uint i, BodyInfo info, uint j, __global const BodyInfo* infos) {
  const BodyInfo other = AT(infos, j);
  return i != j && isCollidable(other) && filtersMatch(info, other);
}

// Nothing that mayMeet() asks an item for has changed.
static inline int sameFilter(BodyInfo a, BodyInfo b) {
  return isCollidable(a) == isCollidable(b) && a.filterGroup == b.filterGroup && a.filterMask == b.filterMask &&
         ((a.flags ^ b.flags) & (BODY_CHILD | BODY_COMPOUND | BODY_STATIC | BODY_KINEMATIC)) == 0 && a.parent == b.parent;
}

// Where a pair goes: behind the pairs of lower bodies, at any free place among those of its own. counts[] says how many
// places of the body are still free.
static inline void emitPair(CHECKS uint a, uint b, __global const uint* offsets, volatile __global uint* counts,
                     __global ulong* keys) {
  const uint lower = min(a, b), left = atomic_dec(&AT(counts, lower));
  ASSERT(left > 0, left, lower);
  AT(keys, AT(offsets, lower) + left - 1) = pairKeyOf(a, b);
}

// ---- the list: an append buffer, with a small one of the work item's own before it --------------------------------

#ifdef BTGPU_SHAPE_CPU
#define PAIRS_BUFFERED 128u
#else
#define PAIRS_BUFFERED 8u
#endif

typedef struct PairAppender {
  volatile __global uint* listed;  // how many pairs were appended, also those that there is no room for
  __global ulong* list;
  uint capacity, count;
  ulong keys[PAIRS_BUFFERED];
} PairAppender;

static inline void beginPairs(PairAppender* to, uint capacity, volatile __global uint* listed, __global ulong* list) {
  to->listed = listed;
  to->list = list;
  to->capacity = capacity;
  to->count = 0;
}

// To be called at the end, too.
static inline void flushPairs(PairAppender* to) {
  if (to->count == 0) return;
  const uint first = atomic_add(to->listed, to->count);
  const uint room = first < to->capacity ? min(to->count, to->capacity - first) : 0;
  for (uint k = 0; k < room; ++k) to->list[first + k] = to->keys[k];
  to->count = 0;
}

static inline void appendPair(PairAppender* to, uint a, uint b) {
  if (to->count == PAIRS_BUFFERED) flushPairs(to);
  to->keys[to->count++] = pairKeyOf(a, b);
}

// Appends the pairs of an item with those at the places [from, end) of boxes[], which are the items of order[].
static inline void appendOverlaps(CHECKS PairAppender* to, uint self, BodyInfo info, Aabb box, uint from, uint end,
                           __global const Aabb* boxes, __global const uint* order, __global const BodyInfo* infos) {
#ifdef BTGPU_SHAPE_CPU
  for (uint block = from / BVH_ARITY * BVH_ARITY; block < end; block += BVH_ARITY) {
    uint mask = overlapBlock(boxes, block, box);
    if (block < from) mask &= ~((1u << (from - block)) - 1u);
    if (end - block < BVH_ARITY) mask &= (1u << (end - block)) - 1u;
    for (; mask; mask &= mask - 1) {
      const uint other = AT(order, block + popcount((mask & (0 - mask)) - 1u));
      if (mayMeet(WITH_CHECKS self, info, other, infos)) appendPair(to, self, other);
    }
  }
#else
  for (uint place = from; place < end; ++place) {
    if (!overlapAabb(box, AT(boxes, place))) continue;
    const uint other = AT(order, place);
    if (mayMeet(WITH_CHECKS self, info, other, infos)) appendPair(to, self, other);
  }
#endif
}

#endif
