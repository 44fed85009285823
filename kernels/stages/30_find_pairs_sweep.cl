// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of bodies by a sweep along one axis: that along which their centres vary most. Bodies sorted by the lower ends of
// their intervals; each meets those behind it whose intervals begin before its own ends. Such a range is cut into pieces
// of PIECE, so that one huge body is the work of many.
#include "../lib/group_scan.h"
#include "../lib/pair_list.h"
#include "../lib/sweep.h"

// ---- the axis, in two launches -------------------------------------------------------------------------------------

// Of a set of points: how many, their mean, and per axis the sum of squares of the distances from it.
typedef struct Spread {
  float4 mean, squares;
  float count;
} Spread;

static inline Spread noSpread(void) {
  Spread s;
  s.mean = s.squares = vec3(0.0f, 0.0f, 0.0f);
  s.count = 0.0f;
  return s;
}

// Of both sets together (Chan, Golub and LeVeque 1979). Sums of squares alone would cancel far from the origin.
static inline Spread mergeSpread(Spread a, Spread b) {
  if (b.count == 0.0f) return a;
  if (a.count == 0.0f) return b;
  Spread m;
  m.count = a.count + b.count;
  const float share = b.count / m.count;
  const float4 apart = b.mean - a.mean;
  m.mean = a.mean + apart * share;
  m.squares = a.squares + b.squares + scale3(apart, apart) * (a.count * share);
  return m;
}

static inline Spread spreadOf(BodyInfo body, Aabb box) {
  Spread s = noSpread();
  // Planes and what takes no part say nothing about where the scene is.
  if (!isCollidable(body) || !(lengthSqr3(box.upper - box.lower) < MOVING_AABB_LIMIT_SQR)) return s;
  s.mean = (box.lower + box.upper) * 0.5f;
  s.count = 1.0f;
  return s;
}

#ifdef BTGPU_SHAPE_CPU
#define GROUP_SPREAD(s) s
#else
static inline Spread groupSpread(Spread s, __local Spread* scratch) {
  const uint lane = get_local_id(0);
  scratch[lane] = s;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint half_ = GROUP_SIZE / 2; half_ > 0; half_ /= 2) {
    if (lane < half_) scratch[lane] = mergeSpread(scratch[lane], scratch[lane + half_]);
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  return scratch[0];
}
#define GROUP_SPREAD(s) groupSpread(s, scratch)
#endif

// partial: two a group; mean and count, squares.
KERNEL spreadPartial(uint bodyCount, __global const BodyInfo* infos, __global const Aabb* aabbs,
                     __global float4* partial) {
#ifdef BTGPU_SHAPE_GPU
  __local Spread scratch[GROUP_SIZE];
#endif
  Spread spread = noSpread();
  FOR_EACH(i, bodyCount) spread = mergeSpread(spread, spreadOf(infos[i], aabbs[i]));
  spread = GROUP_SPREAD(spread);
  if (get_local_id(0) != 0) return;
  partial[2 * get_group_id(0)] = withW(spread.mean, spread.count);
  partial[2 * get_group_id(0) + 1] = spread.squares;
}

KERNEL sweepAxis(uint groups, __global const float4* partial, __global uint* axis) {
#ifdef BTGPU_SHAPE_GPU
  __local Spread scratch[GROUP_SIZE];
#endif
  if (get_group_id(0) != 0) return;
  Spread all = noSpread();
  for (uint g = get_local_id(0); g < groups; g += GROUP_SIZE) {
    Spread s;
    s.mean = xyz(partial[2 * g]);
    s.count = partial[2 * g].w;
    s.squares = partial[2 * g + 1];
    all = mergeSpread(all, s);
  }
  all = GROUP_SPREAD(all);
  if (get_local_id(0) != 0) return;
  const float x = all.squares.x, y = all.squares.y, z = all.squares.z;
  *axis = x >= y && x >= z ? 0 : (y >= z ? 1 : 2);
}

// ---- order and ranges ----------------------------------------------------------------------------------------------

// What takes no part sorts last.
KERNEL sweepKeys(uint bodyCount, __global const uint* axis, __global const BodyInfo* infos,
                 __global const Aabb* aabbs, __global uint* keys, __global uint* order) {
  FOR_EACH(i, bodyCount) {
    keys[i] = isCollidable(infos[i]) ? floatKey(component(aabbs[i].lower, *axis)) : NO_INDEX;
    order[i] = i;
  }
}

// Boxes in sorted order; how many of the sorted bodies take part.
KERNEL sweepBoxes(CHECKS uint bodyCount, __global const uint* keys, __global const uint* order,
                  __global const Aabb* aabbs, __global Aabb* boxes, __global uint* taking) {
  FOR_EACH(p, bodyCount) {
    storeBox(boxes, p, AT(aabbs, AT(order, p)));
    if (keys[p] != NO_INDEX && (p + 1 == bodyCount || keys[p + 1] == NO_INDEX)) *taking = p + 1;
  }
}

// The body at place p meets those at [from[p], end[p]); pieces[p]: of this range.
KERNEL sweepRanges(CHECKS uint bodyCount, __global const uint* axis, __global const uint* taking,
                   __global const uint* keys, __global const uint* order, __global const Aabb* aabbs,
                   __global uint* selves, __global uint* from, __global uint* end, __global uint* pieces) {
  FOR_EACH(p, bodyCount) {
    uint first = p + 1, last = *taking;
    if (p < last) {
      const uint upper = floatKey(component(AT(aabbs, AT(order, p)).upper, *axis));
      while (first < last) {
        const uint middle = first + (last - first) / 2;
        if (AT(keys, middle) <= upper) {
          first = middle + 1;
        } else {
          last = middle;
        }
      }
    }
    selves[p] = order[p];
    from[p] = p + 1;
    end[p] = first;
    pieces[p] = (first - (p + 1) + PIECE - 1) / PIECE;
  }
}

// ---- pairs ---------------------------------------------------------------------------------------------------------

// Range r: body selves[r] meets the places [from[r], end[r]) of boxes[], which are the bodies of order[]. firstPiece[r]:
// pieces of the ranges before it.
KERNEL sweepPieces(CHECKS uint rangeCount, uint pairCapacity, __global const uint* pieceCount,
                   __global const uint* firstPiece, __global const uint* selves, __global const uint* from,
                   __global const uint* end, __global const BodyInfo* infos, __global const Aabb* aabbs,
                   __global const Aabb* boxes, __global const uint* order, volatile __global uint* listed,
                   __global ulong* list) {
  PairAppender found;
  beginPairs(&found, pairCapacity, listed, list);
  FOR_EACH(piece, *pieceCount) {
    const uint r = rangeOf(piece, rangeCount, firstPiece);
    const uint self = AT(selves, r), begin = AT(from, r) + (piece - AT(firstPiece, r)) * PIECE;
    appendOverlaps(WITH_CHECKS &found, self, AT(infos, self), AT(aabbs, self), begin, min(AT(end, r), begin + PIECE),
                   boxes, order, infos);
  }
  flushPairs(&found);
}
