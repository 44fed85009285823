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

#define TILE ((uint)GROUP_SIZE)
#define LOCAL_PAIRS 2048u                    // room of a group's append buffer
#define AT_ONCE (LOCAL_PAIRS / (2 * TILE))   // bodies met between two looks at it: at most half of it

// By all lanes. Empties a group's append buffer if it holds more than `most`; no barrier depends on that. Always inline:
// PoCL 3 loses track of local variables whose address is the same constant in every call of a function.
static inline __attribute__((always_inline)) void flushLocal(
    __local ulong* found, __local uint* foundCount, __local uint* first, uint most, uint capacity,
    volatile __global uint* listed, __global ulong* list) {
  const uint lane = get_local_id(0);
  barrier(CLK_LOCAL_MEM_FENCE);
  const uint count = *foundCount > most ? *foundCount : 0;
  if (lane == 0 && count > 0) *first = atomic_add(listed, count);
  barrier(CLK_LOCAL_MEM_FENCE);
  if (lane == 0 && count > 0) *foundCount = 0;
  const uint begin = *first, room = begin < capacity ? min(count, capacity - begin) : 0;
  for (uint k = lane; k < room; k += GROUP_SIZE) list[begin + k] = found[k];
  barrier(CLK_LOCAL_MEM_FENCE);
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

// A lane holds a body of the one tile, local memory those of the other.
KERNEL brutePairs(CHECKS uint bodyCount, uint pairCapacity, __global const BodyInfo* infos, __global const Aabb* boxes,
                  __global const uint* order, volatile __global uint* listed, __global ulong* list) {
  __local Aabb tile[GROUP_SIZE];
  __local ulong found[LOCAL_PAIRS];
  __local uint foundCount, first;
  const uint lane = get_local_id(0);
  if (lane == 0) foundCount = first = 0;
  const uint tiles = (bodyCount + TILE - 1) / TILE, units = tiles * (tiles / 2 + 1);
  for (uint u = get_group_id(0); u < units; u += get_num_groups(0)) {
    uint row, column;
    const uint there = tilesOf(u, tiles, &row, &column) ? min(TILE, bodyCount - column * TILE) : 0;
    const uint i = row * TILE + lane, j = column * TILE + lane, self = min(i, bodyCount - 1);
    const BodyInfo info = AT(infos, self);
    const Aabb box = AT(boxes, self);
    const int takesPart = i < bodyCount && isCollidable(info);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (lane < there) tile[lane] = AT(boxes, j);
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint begin = 0; begin < there; begin += AT_ONCE) {
      for (uint k = begin; takesPart && k < min(there, begin + AT_ONCE); ++k) {
        const uint other = column * TILE + k;
        if ((row == column && other <= i) || !overlapAabb(box, tile[k])) continue;
        if (mayMeet(WITH_CHECKS i, info, other, infos)) found[atomic_inc(&foundCount)] = pairKeyOf(i, other);
      }
      flushLocal(found, &foundCount, &first, LOCAL_PAIRS / 2, pairCapacity, listed, list);
    }
  }
  flushLocal(found, &foundCount, &first, 0, pairCapacity, listed, list);
}

#endif
