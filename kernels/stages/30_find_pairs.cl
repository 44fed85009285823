// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of bodies with overlapping AABBs and matching filters, by a linear BVH: bodies sorted along a Morton
// curve, and over them an implicit tree with BVH_ARITY children a node. Node j of level k bounds the sorted
// bodies [j, j + 1) * BVH_ARITY^k, so there are no pointers, no atomics and a traversal without a stack. Static
// bodies sort behind all others; a body looks only for partners behind itself, so each pair is found once, by a
// body that can move if there is one. Two passes, count and emit, so nothing is ever dropped.
#include "../lib/bounds.h"
#include "../lib/group_scan.h"
#include "../shared/bvh.h"
#include "../shared/contact.h"

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

// Level 0: the bodies' AABBs in sorted order.
KERNEL bvhLeaves(CHECKS uint bodyCount, __global const uint* order, __global const Aabb* aabbs, __global Aabb* nodes) {
  FOR_EACH(i, bodyCount) AT(nodes, i) = AT(aabbs, order[i]);
}

// One level: node j bounds the children [j, j + 1) * BVH_ARITY of the level below.
KERNEL bvhLevel(uint level, __constant BvhLevels* levels, __global Aabb* nodes) {
  const uint childFirst = levels->first[level - 1], childCount = levels->size[level - 1];
  const uint first = levels->first[level];
  FOR_EACH(j, levels->size[level]) {
    Aabb box = emptyAabb();
    const uint end = min(childCount, (j + 1) * BVH_ARITY);
    for (uint c = j * BVH_ARITY; c < end; ++c) box = mergeAabb(box, nodes[childFirst + c]);
    nodes[first + j] = box;
  }
}

// ---- traversal -----------------------------------------------------------------------------------------------

// Visits the sorted bodies behind `position` whose AABB overlaps its own. Returns how many pass the filters; writes the
// first PAIRS_KEPT of them to kept[], or the keys of all pairs to keys[]; either may be null.
static uint visitPairs(CHECKS uint position, __constant BvhLevels* levels, __global const Aabb* nodes,
                       __global const uint* order, __global const BodyInfo* infos, __global uint* kept,
                       __global ulong* keys) {
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
      if (filtersMatch(info, AT(infos, other))) {
        if (kept && found < PAIRS_KEPT) kept[found] = other;
        if (keys) keys[found] = pairKeyOf(self, other);
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

KERNEL countPairs(CHECKS uint bodyCount, __constant BvhLevels* levels, __global const Aabb* nodes,
                  __global const uint* order, __global const BodyInfo* infos, __global uint* counts,
                  __global uint* kept) {
  FOR_EACH(i, bodyCount) {
    counts[i] = visitPairs(WITH_CHECKS i, levels, nodes, order, infos, kept + (ulong)i * PAIRS_KEPT, 0);
  }
}

// Single work item: notes the number of pairs and whether they fit.
SINGLE_KERNEL checkPairs(uint pairCapacity, __global const uint* total, __global StepCounters* counters) {
  counters->pairCount = *total;
  if (*total > pairCapacity) counters->overflow |= OVERFLOW_PAIRS;
}

// Only bodies with more pairs than were kept go through the tree once more.
KERNEL emitPairs(CHECKS uint bodyCount, __constant BvhLevels* levels, __global const Aabb* nodes,
                 __global const uint* order, __global const BodyInfo* infos, __global const uint* offsets,
                 __global const uint* kept, __global const StepCounters* counters, __global ulong* keys) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    const uint first = offsets[i], end = i + 1 < bodyCount ? offsets[i + 1] : counters->pairCount;
    ASSERT(first <= end && end <= LENGTH(keys), first, end);
    if (end - first > PAIRS_KEPT) {
      visitPairs(WITH_CHECKS i, levels, nodes, order, infos, 0, keys + first);
      continue;
    }
    for (uint k = first; k < end; ++k) AT(keys, k) = pairKeyOf(AT(order, i), kept[(ulong)i * PAIRS_KEPT + (k - first)]);
  }
}
