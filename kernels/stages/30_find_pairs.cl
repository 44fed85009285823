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

// Morton code of each body's centre; static bodies and those that take no part sort last.
KERNEL mortonKeys(uint bodyCount, __global const BodyInfo* infos, __global const Aabb* aabbs,
                  __global const Aabb* scene, __global ulong* keys, __global uint* order) {
  FOR_EACH(i, bodyCount) {
    const Aabb box = aabbs[i];
    ulong key = mortonCode((box.lower + box.upper) * 0.5f, *scene);
    if (!isCollidable(infos[i])) {
      key = 3UL << PAIR_SORT_STATIC_BIT;
    } else if (isStaticOrKinematic(infos[i].flags)) {
      key |= 1UL << PAIR_SORT_STATIC_BIT;
    }
    keys[i] = key;
    order[i] = i;
  }
}

#ifdef BTGPU_SHAPE_CPU
#define LEVEL_BARRIER
#else
#define LEVEL_BARRIER barrier(CLK_GLOBAL_MEM_FENCE)
#endif

// Nodes [begin, end) of a level, by the lanes of one group: node j bounds the children [j, j + 1) * BVH_ARITY.
static void bvhLevel(uint level, uint begin, uint end, __constant BvhLevels* levels, __global Aabb* nodes) {
  const uint childFirst = levels->first[level - 1], childCount = levels->size[level - 1];
  const uint first = levels->first[level];
  for (uint j = begin + get_local_id(0); j < min(end, levels->size[level]); j += GROUP_SIZE) {
    Aabb box = emptyAabb();
    const uint last = min(childCount, (j + 1) * BVH_ARITY);
    for (uint c = j * BVH_ARITY; c < last; ++c) box = mergeAabb(box, loadBox(nodes, childFirst + c));
    storeBox(nodes, first + j, box);
  }
}

// Level 0, the bodies' AABBs in sorted order, and the levels up to BVH_LOW: a group does all that is below one node of
// the highest of them. counts[] is made ready for countPairs.
KERNEL bvhLow(CHECKS uint bodyCount, __constant BvhLevels* levels, __global const uint* order,
              __global const Aabb* aabbs, __global Aabb* nodes, __global uint* counts) {
  const uint blocks = (bodyCount + BVH_LOW_BODIES - 1) / BVH_LOW_BODIES;
  for (uint block = get_group_id(0); block < blocks; block += get_num_groups(0)) {
    uint span = BVH_LOW_BODIES;
    for (uint i = block * span + get_local_id(0); i < min(bodyCount, (block + 1) * span); i += GROUP_SIZE) {
      storeBox(nodes, i, AT(aabbs, order[i]));
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
#ifdef BTGPU_SHAPE_CPU

static uint visitPairs(CHECKS uint position, __constant BvhLevels* levels, __global const Aabb* nodes,
                       __global const uint* order, __global const BodyInfo* infos, __global uint* kept,
                       volatile __global uint* counts, __global const uint* offsets, __global ulong* keys) {
  const uint self = AT(order, position);
  const BodyInfo info = AT(infos, self);
  const uint top = levels->levelCount - 1;
  if (!isCollidable(info) || top == 0) return 0;
  const Aabb box = loadBox(nodes, position);
  uint open[BVH_MAX_LEVELS], begin[BVH_MAX_LEVELS];  // of each level, the siblings that are still to be visited
  uint level = top, child = 0, found = 0;
  while (true) {
    // Down to the children of `child`: those that overlap, exist, and have a body behind this one.
    --level;
    begin[level] = child * BVH_ARITY;
    const uint behind = (position + 1) >> (level * BVH_ARITY_BITS);
    uint mask = overlapBlock(nodes, levels->first[level] + begin[level], box);
    mask &= (1u << min(BVH_ARITY, levels->size[level] - begin[level])) - 1u;
    if (behind > begin[level]) mask &= ~((1u << min(BVH_ARITY, behind - begin[level])) - 1u);
    if (level == 0) {
      for (; mask; mask &= mask - 1) {
        const uint other = AT(order, begin[0] + popcount((mask & (0 - mask)) - 1u));
        if (!mayMeet(WITH_CHECKS self, info, other, infos)) continue;
        meet(WITH_CHECKS self, other, found, kept, counts, offsets, keys);
        ++found;
      }
    }
    open[level] = mask;
    while (open[level] == 0) {
      if (++level == top) return found;
    }
    child = begin[level] + popcount((open[level] & (0 - open[level])) - 1u);
    open[level] &= open[level] - 1u;
  }
}

#else

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

#endif

#ifdef BTGPU_SHAPE_CPU

// countPairs of the BVH_ARITY positions under the node `own` of level 1, which go through the tree together: a block of
// bodies is looked at if that node overlaps its box, and by those of them that do.
static void countBlock(CHECKS uint own, uint bodyCount, __constant BvhLevels* levels, __global const Aabb* nodes,
                       __global const uint* order, __global const BodyInfo* infos, __global uint* found,
                       volatile __global uint* counts, __global uint* kept) {
  const uint first = own * BVH_ARITY, size = min(BVH_ARITY, bodyCount - first);
  uint selves[BVH_ARITY], founds[BVH_ARITY];
  BodyInfo selfInfos[BVH_ARITY];
  Aabb boxes[BVH_ARITY];
  uint looking = 0;  // bit k: position first + k
  for (uint k = 0; k < size; ++k) {
    selves[k] = AT(order, first + k);
    selfInfos[k] = AT(infos, selves[k]);
    boxes[k] = loadBox(nodes, first + k);
    founds[k] = 0;
    if (isCollidable(selfInfos[k])) looking |= 1u << k;
  }
  const Aabb all = loadBox(nodes, levels->first[1] + own);
  uint open[BVH_MAX_LEVELS], begin[BVH_MAX_LEVELS];
  const uint top = levels->levelCount - 1;
  uint level = top, child = 0;
  while (looking) {
    // As in visitPairs, but down to level 1 only, whose nodes are blocks of bodies: this one and those behind it.
    if (level > 1) {
      --level;
      begin[level] = child * BVH_ARITY;
      const uint behind = own >> ((level - 1) * BVH_ARITY_BITS);
      uint mask = overlapBlock(nodes, levels->first[level] + begin[level], all);
      mask &= (1u << min(BVH_ARITY, levels->size[level] - begin[level])) - 1u;
      if (behind > begin[level]) mask &= ~((1u << min(BVH_ARITY, behind - begin[level])) - 1u);
      open[level] = mask;
    } else {
      begin[1] = 0;  // level 1 is the root
      open[1] = 1;
      level = 1;
    }
    if (level == 1) {
      for (uint blocks = open[1]; blocks; blocks &= blocks - 1) {
        const uint block = begin[1] + popcount((blocks & (0 - blocks)) - 1u);
        uint near = overlapBlock(nodes, first, loadBox(nodes, levels->first[1] + block)) & looking;
        const uint there = (1u << min(BVH_ARITY, bodyCount - block * BVH_ARITY)) - 1u;
        for (; near; near &= near - 1) {
          const uint k = popcount((near & (0 - near)) - 1u);
          uint mask = overlapBlock(nodes, block * BVH_ARITY, boxes[k]) & there;
          if (block == own) mask &= ~((2u << k) - 1u);
          for (; mask; mask &= mask - 1) {
            const uint other = AT(order, block * BVH_ARITY + popcount((mask & (0 - mask)) - 1u));
            if (!mayMeet(WITH_CHECKS selves[k], selfInfos[k], other, infos)) continue;
            meet(WITH_CHECKS selves[k], other, founds[k], kept + (ulong)(first + k) * PAIRS_KEPT, counts, 0, 0);
            ++founds[k];
          }
        }
      }
      open[1] = 0;
    }
    while (level < top && open[level] == 0) ++level;
    if (level == top) break;
    child = begin[level] + popcount((open[level] & (0 - open[level])) - 1u);
    open[level] &= open[level] - 1u;
  }
  for (uint k = 0; k < size; ++k) found[first + k] = founds[k];
}

#endif

// found[i]: pairs found from position i; counts[b]: pairs whose lower body is b.
KERNEL countPairs(CHECKS uint bodyCount, __constant BvhLevels* levels, __global const Aabb* nodes,
                  __global const uint* order, __global const BodyInfo* infos, __global uint* found,
                  __global uint* counts, __global uint* kept) {
#ifdef BTGPU_SHAPE_CPU
  if (levels->levelCount < 2) {  // a single body
    FOR_EACH(i, bodyCount) found[i] = 0;
    return;
  }
  FOR_EACH(own, levels->size[1]) {
    countBlock(WITH_CHECKS own, bodyCount, levels, nodes, order, infos, found, counts, kept);
  }
#else
  FOR_EACH(i, bodyCount) {
    found[i] =
        visitPairs(WITH_CHECKS i, levels, nodes, order, infos, kept + (ulong)i * PAIRS_KEPT, counts, 0, 0);
  }
#endif
}

// Only bodies with more pairs than were kept go through the tree once more. Also notes how many pairs there are and
// whether they fit.
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
  FOR_EACH(i, bodyCount) {
    if (found[i] > PAIRS_KEPT) {
      visitPairs(WITH_CHECKS i, levels, nodes, order, infos, 0, counts, offsets, keys);
      continue;
    }
    const uint self = AT(order, i);
    for (uint k = 0; k < found[i]; ++k) {
      emitPair(WITH_CHECKS self, kept[(ulong)i * PAIRS_KEPT + k], offsets, counts, keys);
    }
  }
}
