// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of bodies by trying each with every other (the paper's first way). Bodies in tiles; tile t meets itself and the
// half of all tiles that follows it in a ring, so that every pair is tried once and every tile has as much to do.
#include "../lib/pair_list.h"

// ---- the pairs of one tile and another -----------------------------------------------------------------------------

#ifdef BTGPU_SHAPE_CPU

#define TILE 64u  // whole blocks

// Boxes in blocks.
KERNEL layBoxes(uint bodyCount, __global const Aabb* aabbs, __global Aabb* boxes, __global uint* order) {
  FOR_EACH(i, bodyCount) {
    storeBox(boxes, i, aabbs[i]);
    order[i] = i;
  }
}

static inline void tilePairs(CHECKS PairAppender* to, uint bodyCount, uint row, uint column,
                             __global const BodyInfo* infos, __global const Aabb* boxes,
                             __global const uint* order) {
  const uint end = min(bodyCount, (column + 1) * TILE);
  for (uint i = row * TILE; i < min(bodyCount, (row + 1) * TILE); ++i) {
    const BodyInfo info = AT(infos, i);
    if (!isCollidable(info)) continue;
    const uint from = row == column ? i + 1 : column * TILE;
    appendOverlaps(WITH_CHECKS to, i, info, loadBox(boxes, i), from, end, boxes, order, infos);
  }
}

#else

#define TILE GROUP_SIZE
#define LOCAL_PAIRS 1024u                    // room of a group's append buffer
#define AT_ONCE (LOCAL_PAIRS / (2 * TILE))   // bodies met between two looks at it: at most half of it

// The append buffer of a group, in local memory.
typedef struct LocalPairs {
  uint count, first;
  ulong keys[LOCAL_PAIRS];
} LocalPairs;

// By all lanes; between barriers.
static inline void flushLocal(__local LocalPairs* pairs, uint capacity, volatile __global uint* listed,
                              __global ulong* list) {
  const uint count = pairs->count;
  if (get_local_id(0) == 0) pairs->first = atomic_add(listed, count);
  barrier(CLK_LOCAL_MEM_FENCE);
  const uint first = pairs->first;
  for (uint k = get_local_id(0); k < count; k += GROUP_SIZE) {
    if (first < capacity && k < capacity - first) list[first + k] = pairs->keys[k];
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (get_local_id(0) == 0) pairs->count = 0;
  barrier(CLK_LOCAL_MEM_FENCE);
}

static inline void tilePairs(CHECKS uint bodyCount, uint row, uint column, __global const BodyInfo* infos,
                             __global const Aabb* aabbs, __local Aabb* tile, __local LocalPairs* pairs,
                             uint capacity, volatile __global uint* listed, __global ulong* list) {
  const uint lane = get_local_id(0), i = row * TILE + lane, j = column * TILE + lane;
  BodyInfo info;
  Aabb box = emptyAabb();
  int takesPart = 0;
  if (i < bodyCount) {
    info = infos[i];
    box = aabbs[i];
    takesPart = isCollidable(info);
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (j < bodyCount) tile[lane] = aabbs[j];
  barrier(CLK_LOCAL_MEM_FENCE);
  const uint there = min(TILE, bodyCount - column * TILE);
  for (uint begin = 0; begin < there; begin += AT_ONCE) {
    for (uint k = begin; takesPart && k < min(there, begin + AT_ONCE); ++k) {
      const uint other = column * TILE + k;
      if ((row == column && other <= i) || !overlapAabb(box, tile[k])) continue;
      if (mayMeet(WITH_CHECKS i, info, other, infos)) pairs->keys[atomic_inc(&pairs->count)] = pairKeyOf(i, other);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    const uint full = pairs->count > LOCAL_PAIRS / 2;
    barrier(CLK_LOCAL_MEM_FENCE);
    if (full) flushLocal(pairs, capacity, listed, list);
  }
}

#endif

// ---- all of them ---------------------------------------------------------------------------------------------------

// Unit u: which tile, and which of those that follow it in the ring. False if that pair of tiles is another unit's.
static inline int tilesOf(uint u, uint tiles, REF(uint) row, REF(uint) column) {
  const uint each = tiles / 2 + 1, step = u % each;
  *row = u / each;
  *column = (*row + step) % tiles;
  return !(tiles % 2 == 0 && step == tiles / 2 && *row >= tiles / 2);
}

#ifdef BTGPU_SHAPE_CPU

KERNEL brutePairs(CHECKS uint bodyCount, uint pairCapacity, __global const BodyInfo* infos, __global const Aabb* boxes,
                  __global const uint* order, volatile __global uint* listed, __global ulong* list) {
  PairAppender found;
  beginPairs(&found, pairCapacity, listed, list);
  const uint tiles = (bodyCount + TILE - 1) / TILE, units = tiles * (tiles / 2 + 1);
  FOR_EACH(u, units) {
    uint row, column;
    if (!tilesOf(u, tiles, &row, &column)) continue;
    tilePairs(WITH_CHECKS &found, bodyCount, row, column, infos, boxes, order);
  }
  flushPairs(&found);
}

#else

KERNEL brutePairs(CHECKS uint bodyCount, uint pairCapacity, __global const BodyInfo* infos, __global const Aabb* boxes,
                  __global const uint* order, volatile __global uint* listed, __global ulong* list) {
  __local Aabb tile[TILE];
  __local LocalPairs pairs;
  if (get_local_id(0) == 0) pairs.count = 0;
  const uint tiles = (bodyCount + TILE - 1) / TILE, units = tiles * (tiles / 2 + 1);
  for (uint u = get_group_id(0); u < units; u += get_num_groups(0)) {
    uint row, column;
    if (!tilesOf(u, tiles, &row, &column)) continue;
    tilePairs(WITH_CHECKS bodyCount, row, column, infos, boxes, tile, &pairs, pairCapacity, listed, list);
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  flushLocal(&pairs, pairCapacity, listed, list);
}

#endif
