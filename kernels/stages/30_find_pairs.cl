// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of bodies with overlapping AABBs and matching filters, by a linear BVH: bodies sorted along a Morton
// curve, and over them an implicit tree with BVH_ARITY children a node. Node j of level k bounds the sorted
// bodies [j, j + 1) * BVH_ARITY^k, so there are no pointers, no atomics and a traversal without a stack. Static
// bodies sort behind all others; a body looks only for partners behind itself, so each pair is found once, by a
// body that can move if there is one. Any order of the bodies gives the same pairs, so that one serves for some steps.
// Two passes, count and emit, so nothing is ever dropped. Pairs are counted and emitted by their lower body, in any
// order; then each body's pairs are sorted (30_sort_pairs.cl).
#include "../lib/box_blocks.h"
#include "../lib/group_scan.h"
#include "../lib/pair_list.h"

#define BVH_ARITY_BITS 3u
#define BVH_LOW 3u             // the highest level that many groups share in
#define BVH_LOW_BODIES 512u    // under a node of it: BVH_ARITY^BVH_LOW

// ---- bounds of the centres, in two launches ------------------------------------------------------------------

static void addCentre(BodyInfo body, Aabb box, REF(Aabb) scene) {
  // Planes and what takes no part say nothing about where the scene is.
  if (!isCollidable(body) || !(lengthSqr3(box.upper - box.lower) < MOVING_AABB_LIMIT_SQR)) return;
  const float4 centre = (box.lower + box.upper) * 0.5f;
  scene->lower = fmin(scene->lower, centre);
  scene->upper = fmax(scene->upper, centre);
}

#ifdef BTGPU_SHAPE_CPU
#define GROUP_BOUNDS(scene) scene
#else
static Aabb groupBounds(Aabb scene, __local Aabb* scratch) {
  const uint lane = get_local_id(0);
  scratch[lane] = scene;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint half_ = GROUP_SIZE / 2; half_ > 0; half_ /= 2) {
    if (lane < half_) scratch[lane] = mergeAabb(scratch[lane], scratch[lane + half_]);
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  return scratch[0];
}
#define GROUP_BOUNDS(scene) groupBounds(scene, scratch)
#endif

KERNEL sceneBoundsPartial(uint bodyCount, __global const BodyInfo* infos, __global const Aabb* aabbs,
                          __global Aabb* partial) {
#ifdef BTGPU_SHAPE_GPU
  __local Aabb scratch[GROUP_SIZE];
#endif
  Aabb scene = emptyAabb();
  FOR_EACH(i, bodyCount) addCentre(infos[i], aabbs[i], &scene);
  scene = GROUP_BOUNDS(scene);
  if (get_local_id(0) == 0) partial[get_group_id(0)] = scene;
}

KERNEL sceneBoundsFinal(uint groups, __global const Aabb* partial, __global Aabb* scene) {
#ifdef BTGPU_SHAPE_GPU
  __local Aabb scratch[GROUP_SIZE];
#endif
  if (get_group_id(0) != 0) return;
  Aabb all = emptyAabb();
  for (uint g = get_local_id(0); g < groups; g += GROUP_SIZE) all = mergeAabb(all, partial[g]);
  all = GROUP_BOUNDS(all);
  if (get_local_id(0) == 0) *scene = all;
}

// ---- sort keys and tree --------------------------------------------------------------------------------------

// Morton code of each body's centre. Compounds as a whole, which meet few others, sort behind what else moves, then come
// static bodies, and last those that form no pair.
KERNEL mortonKeys(uint bodyCount, __global const BodyInfo* infos, __global const Aabb* aabbs,
                  __global const Aabb* scene, __global ulong* keys, __global uint* order) {
  FOR_EACH(i, bodyCount) {
    const Aabb box = aabbs[i];
    ulong key = mortonCode((box.lower + box.upper) * 0.5f, *scene);
    const uint kind = itemKind(infos[i]);
    if (kind == 0) {
      key = 3UL << PAIR_SORT_BIT;
    } else if (isStaticOrKinematic(infos[i].flags)) {
      key |= 2UL << PAIR_SORT_BIT;
    } else if (kind == ITEM_COMPOUND) {
      key |= 1UL << PAIR_SORT_BIT;
    }
    keys[i] = key;
    order[i] = i;
  }
}

#ifdef BTGPU_SHAPE_CPU
#define LEVEL_BARRIER
#else
#define LEVEL_BARRIER barrier(CLK_GLOBAL_MEM_FENCE)
#define storeTag(boxes, place, tag) (void)(tag)
#define loadTag(boxes, place) 0
#endif

// Nodes [begin, end) of a level, by the lanes of one group: node j bounds the children [j, j + 1) * BVH_ARITY. On the CPU
// shape a node's tag says of which kinds the bodies under it are.
static void bvhLevel(uint level, uint begin, uint end, __constant BvhLevels* levels, __global Aabb* nodes) {
  const uint childFirst = levels->first[level - 1], childCount = levels->size[level - 1];
  const uint first = levels->first[level];
  for (uint j = begin + get_local_id(0); j < min(end, levels->size[level]); j += GROUP_SIZE) {
    Aabb box = emptyAabb();
    uint kinds = 0;
    const uint last = min(childCount, (j + 1) * BVH_ARITY);
    for (uint c = j * BVH_ARITY; c < last; ++c) {
      box = mergeAabb(box, loadBox(nodes, childFirst + c));
      kinds |= loadTag(nodes, childFirst + c);
    }
    storeBox(nodes, first + j, box);
    storeTag(nodes, first + j, kinds);
  }
}

// Level 0, the bodies' AABBs in sorted order, and the levels up to BVH_LOW: a group does all that is below one node of
// the highest of them. counts[] is made ready for countPairs.
KERNEL bvhLow(CHECKS uint bodyCount, __constant BvhLevels* levels, __global const uint* order,
              __global const BodyInfo* infos, __global const Aabb* aabbs, __global Aabb* nodes,
              __global uint* counts) {
  const uint blocks = (bodyCount + BVH_LOW_BODIES - 1) / BVH_LOW_BODIES;
  for (uint block = get_group_id(0); block < blocks; block += get_num_groups(0)) {
    uint span = BVH_LOW_BODIES;
    for (uint i = block * span + get_local_id(0); i < min(bodyCount, (block + 1) * span); i += GROUP_SIZE) {
      storeBox(nodes, i, AT(aabbs, order[i]));
      storeTag(nodes, i, itemKind(AT(infos, order[i])));
      AT(counts, i) = 0;
    }
    LEVEL_BARRIER;
    for (uint level = 1; level <= BVH_LOW; ++level) {
      span /= BVH_ARITY;
      if (level < levels->levelCount) bvhLevel(level, block * span, (block + 1) * span, levels, nodes);
      LEVEL_BARRIER;
    }
  }
}

// All levels above, by one group.
KERNEL bvhHigh(__constant BvhLevels* levels, __global Aabb* nodes) {
  for (uint level = BVH_LOW + 1; level < levels->levelCount; ++level) {
    bvhLevel(level, 0, levels->size[level], levels, nodes);
    LEVEL_BARRIER;
  }
}

// ---- traversal -----------------------------------------------------------------------------------------------

#ifdef BTGPU_SHAPE_CPU

// The bodies at the places [BVH_ARITY * block, ...) of the order, which lie near each other, look for pairs together.
typedef struct BodyBlock {
  uint block, count, total;  // total: pairs found, of all
  uint bodies[BVH_ARITY], kindsToMeet[BVH_ARITY];
  BodyInfo infos[BVH_ARITY];
  Aabb boxes[BVH_ARITY];
} BodyBlock;

// A pair that is kept: which of the block's bodies and, in the bits below, its partner.
#define KEPT_MEMBER_SHIFT 29

// Pairs of a block's bodies with those of the same or a later one.
static void meetBodies(CHECKS BodyBlock* at, uint block, __constant BvhLevels* levels,
                       __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                       __global uint* kept, volatile __global uint* counts, __global const uint* offsets,
                       __global ulong* keys) {
  const uint first = block * BVH_ARITY;
  const uint exist = (1u << min(BVH_ARITY, levels->size[0] - first)) - 1u;
  uint members = (1u << at->count) - 1u;
  members &= overlapBlock(nodes, at->block * BVH_ARITY, loadBox(nodes, levels->first[1] + block));
  for (; members; members &= members - 1) {
    const uint m = popcount((members & (0 - members)) - 1u), self = at->bodies[m];
    const BodyInfo info = at->infos[m];
    uint mask = exist & meetBlock(nodes, first, at->boxes[m], at->kindsToMeet[m]);
    if (block == at->block) mask &= ~((2u << m) - 1u);  // only those behind itself
    for (; mask; mask &= mask - 1) {
      const uint other = AT(order, first + popcount((mask & (0 - mask)) - 1u));
      if (!mayMeet(WITH_CHECKS self, info, other, infos)) continue;
      if (keys) {
        emitPair(WITH_CHECKS self, other, offsets, counts, keys);
        continue;
      }
      atomic_inc(&AT(counts, min(self, other)));
      if (at->total < PAIRS_KEPT_OF_BLOCK) kept[at->total] = m << KEPT_MEMBER_SHIFT | other;
      ++at->total;
    }
  }
}

static void openBlock(CHECKS BodyBlock* at, uint block, __constant BvhLevels* levels, __global const Aabb* nodes,
                      __global const uint* order, __global const BodyInfo* infos) {
  at->block = block;
  at->count = min(BVH_ARITY, levels->size[0] - block * BVH_ARITY);
  at->total = 0;
  for (uint m = 0; m < at->count; ++m) {
    at->bodies[m] = AT(order, block * BVH_ARITY + m);
    at->infos[m] = AT(infos, at->bodies[m]);
    at->kindsToMeet[m] = kindsToMeet(itemKind(at->infos[m]));
    at->boxes[m] = loadBox(nodes, block * BVH_ARITY + m);
  }
}

// Goes through the tree with the bodies of a block: pairs with all that are behind them in the order. Without keys[],
// counts each pair at its lower body, and writes the first PAIRS_KEPT_OF_BLOCK to kept[]; with it, emits.
static void visitPairs(CHECKS BodyBlock* at, __constant BvhLevels* levels, __global const Aabb* nodes,
                       __global const uint* order, __global const BodyInfo* infos, __global uint* kept,
                       volatile __global uint* counts, __global const uint* offsets, __global ulong* keys) {
  const uint top = levels->levelCount - 1;
  if (top == 0) return;
  if (top == 1) {
    meetBodies(WITH_CHECKS at, 0, levels, nodes, order, infos, kept, counts, offsets, keys);
    return;
  }
  const Aabb around = loadBox(nodes, levels->first[1] + at->block);
  const uint kinds = kindsToMeet(loadTag(nodes, levels->first[1] + at->block));
  uint open[BVH_MAX_LEVELS], begin[BVH_MAX_LEVELS];  // of each level, the siblings that are still to be visited
  uint level = top, child = 0;
  while (true) {
    // Down to the children of `child`: those that overlap, exist, and have bodies that are not before these.
    --level;
    begin[level] = child * BVH_ARITY;
    const uint behind = at->block >> ((level - 1) * BVH_ARITY_BITS);
    uint mask = meetBlock(nodes, levels->first[level] + begin[level], around, kinds);
    mask &= (1u << min(BVH_ARITY, levels->size[level] - begin[level])) - 1u;
    if (behind > begin[level]) mask &= ~((1u << min(BVH_ARITY, behind - begin[level])) - 1u);
    if (level == 1) {
      for (; mask; mask &= mask - 1) {
        meetBodies(WITH_CHECKS at, begin[1] + popcount((mask & (0 - mask)) - 1u), levels, nodes, order, infos,
                   kept, counts, offsets, keys);
      }
    }
    open[level] = mask;
    while (open[level] == 0) {
      if (++level == top) return;
    }
    child = begin[level] + popcount((open[level] & (0 - open[level])) - 1u);
    open[level] &= open[level] - 1u;
  }
}

// found[i]: pairs found from block i of the order; counts[b]: pairs whose lower body is b.
KERNEL countPairs(CHECKS uint bodyCount, __constant BvhLevels* levels, __global const Aabb* nodes,
                  __global const uint* order, __global const BodyInfo* infos, __global uint* found,
                  __global uint* counts, __global uint* kept) {
  FOR_EACH(block, (bodyCount + BVH_ARITY - 1) / BVH_ARITY) {
    BodyBlock at;
    openBlock(WITH_CHECKS &at, block, levels, nodes, order, infos);
    visitPairs(WITH_CHECKS &at, levels, nodes, order, infos, kept + (ulong)block * PAIRS_KEPT_OF_BLOCK, counts, 0, 0);
    AT(found, block) = at.total;
  }
}

// Of a block; only with more pairs than were kept it goes through the tree once more.
static void emitPairsOf(CHECKS uint block, __constant BvhLevels* levels, __global const Aabb* nodes,
                        __global const uint* order, __global const BodyInfo* infos, __global const uint* found,
                        __global const uint* kept, __global const uint* offsets, __global uint* counts,
                        __global ulong* keys) {
  if (AT(found, block) > PAIRS_KEPT_OF_BLOCK) {
    BodyBlock at;
    openBlock(WITH_CHECKS &at, block, levels, nodes, order, infos);
    visitPairs(WITH_CHECKS &at, levels, nodes, order, infos, 0, counts, offsets, keys);
    return;
  }
  for (uint k = 0; k < AT(found, block); ++k) {
    const uint pair = kept[(ulong)block * PAIRS_KEPT_OF_BLOCK + k];
    emitPair(WITH_CHECKS AT(order, block * BVH_ARITY + (pair >> KEPT_MEMBER_SHIFT)),
             pair & ((1u << KEPT_MEMBER_SHIFT) - 1u), offsets, counts, keys);
  }
}
#define EMIT_ITEMS(bodyCount) ((bodyCount + BVH_ARITY - 1) / BVH_ARITY)

#else

// Counts a pair that was found, the found'th of its body, or emits it if there are keys[].
static void meet(CHECKS uint self, uint other, uint found, __global uint* kept, volatile __global uint* counts,
                 __global const uint* offsets, __global ulong* keys) {
  if (keys) {
    emitPair(WITH_CHECKS self, other, offsets, counts, keys);
  } else {
    atomic_inc(&AT(counts, min(self, other)));
    if (found < PAIRS_KEPT) kept[found] = other;
  }
}

// Visits the sorted bodies behind `position` whose AABB overlaps its own. Returns how many pass the filters. Without
// keys[], counts each pair at its lower body, and writes the first PAIRS_KEPT partners to kept[]; with it, emits.
static uint visitPairs(CHECKS uint position, __constant BvhLevels* levels, __global const Aabb* nodes,
                       __global const uint* order, __global const BodyInfo* infos, __global uint* kept,
                       volatile __global uint* counts, __global const uint* offsets, __global ulong* keys) {
  const uint self = AT(order, position);
  const BodyInfo info = AT(infos, self);
  if (!isCollidable(info)) return 0;
  const Aabb box = nodes[position];
  const uint top = levels->levelCount - 1;
  uint level = top, node = 0, span = 1, found = 0;
  for (uint k = 0; k < top; ++k) span *= BVH_ARITY;  // bodies under a node of this level
  while (true) {
    const int behind = (ulong)(node + 1) * span > position + 1;
    if (behind && overlapAabb(box, AT(nodes, levels->first[level] + node))) {
      if (level > 0) {
        --level;
        span /= BVH_ARITY;
        node *= BVH_ARITY;
        continue;
      }
      const uint other = AT(order, node);
      if (mayMeet(WITH_CHECKS self, info, other, infos)) {
        meet(WITH_CHECKS self, other, found, kept, counts, offsets, keys);
        ++found;
      }
    }
    // On to the next sibling; behind the last one, to the parent's.
    ++node;
    while (level < top && (node % BVH_ARITY == 0 || node >= levels->size[level])) {
      node = (node + BVH_ARITY - 1) / BVH_ARITY;
      ++level;
      span *= BVH_ARITY;
    }
    if (level == top && node >= levels->size[top]) return found;
  }
}

// found[i]: pairs found from position i; counts[b]: pairs whose lower body is b.
KERNEL countPairs(CHECKS uint bodyCount, __constant BvhLevels* levels, __global const Aabb* nodes,
                  __global const uint* order, __global const BodyInfo* infos, __global uint* found,
                  __global uint* counts, __global uint* kept) {
  FOR_EACH(i, bodyCount) {
    found[i] =
        visitPairs(WITH_CHECKS i, levels, nodes, order, infos, kept + (ulong)i * PAIRS_KEPT, counts, 0, 0);
  }
}

// Of a position; only with more pairs than were kept it goes through the tree once more.
static void emitPairsOf(CHECKS uint i, __constant BvhLevels* levels, __global const Aabb* nodes,
                        __global const uint* order, __global const BodyInfo* infos, __global const uint* found,
                        __global const uint* kept, __global const uint* offsets, __global uint* counts,
                        __global ulong* keys) {
  if (found[i] > PAIRS_KEPT) {
    visitPairs(WITH_CHECKS i, levels, nodes, order, infos, 0, counts, offsets, keys);
    return;
  }
  const uint self = AT(order, i);
  for (uint k = 0; k < found[i]; ++k) {
    emitPair(WITH_CHECKS self, kept[(ulong)i * PAIRS_KEPT + k], offsets, counts, keys);
  }
}
#define EMIT_ITEMS(bodyCount) (bodyCount)

#endif

// Emits what was counted. Also notes how many pairs there are and whether they fit.
KERNEL emitPairs(CHECKS uint bodyCount, uint pairCapacity, __constant BvhLevels* levels, __global const Aabb* nodes,
                 __global const uint* order, __global const BodyInfo* infos, __global const uint* found,
                 __global const uint* kept, __global const uint* offsets, __global const uint* total,
                 __global StepCounters* counters, __global uint* counts, __global ulong* keys) {
  if (get_global_id(0) == 0) counters->pairCount = *total;
  if (*total > pairCapacity) {
    if (get_global_id(0) == 0) counters->overflow |= OVERFLOW_PAIRS;
    return;
  }
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, EMIT_ITEMS(bodyCount)) {
    emitPairsOf(WITH_CHECKS i, levels, nodes, order, infos, found, kept, offsets, counts, keys);
  }
}
