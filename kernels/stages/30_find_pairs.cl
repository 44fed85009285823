// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of bodies with overlapping AABBs and matching filters, by a linear BVH: bodies sorted along a Morton
// curve, and over them an implicit tree with BVH_ARITY children a node. Node j of level k bounds the sorted
// bodies [j, j + 1) * BVH_ARITY^k, so there are no pointers, no atomics and a traversal without a stack. Static
// bodies sort behind all others; a body looks only for partners behind itself, so each pair is found once, by a
// body that can move if there is one. Any order of the bodies gives the same pairs, so that one serves for some steps.
// Two passes, count and emit, so nothing is ever dropped. Pairs are counted and emitted by their lower body, in any
// order; then each body's pairs are sorted.
#include "../lib/bounds.h"
#include "../lib/group_scan.h"
#include "../shared/bvh.h"
#include "../shared/contact.h"

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

// On a CPU the BVH_ARITY children of a node lie together coordinate by coordinate (lower x of all, lower y, ... upper z),
// in the memory of as many AABBs, so that a work item looks at all of them at once. Levels begin at multiples of it.
#ifdef BTGPU_SHAPE_CPU

#define LEVEL_BARRIER

static void storeNode(__global Aabb* nodes, uint place, Aabb box) {
  __global float* siblings = (__global float*)(nodes + place / BVH_ARITY * BVH_ARITY) + place % BVH_ARITY;
  siblings[0 * BVH_ARITY] = box.lower.x;
  siblings[1 * BVH_ARITY] = box.lower.y;
  siblings[2 * BVH_ARITY] = box.lower.z;
  siblings[3 * BVH_ARITY] = box.upper.x;
  siblings[4 * BVH_ARITY] = box.upper.y;
  siblings[5 * BVH_ARITY] = box.upper.z;
}

static Aabb loadNode(__global const Aabb* nodes, uint place) {
  __global const float* siblings =
      (__global const float*)(nodes + place / BVH_ARITY * BVH_ARITY) + place % BVH_ARITY;
  Aabb box;
  box.lower = vec3(siblings[0 * BVH_ARITY], siblings[1 * BVH_ARITY], siblings[2 * BVH_ARITY]);
  box.upper = vec3(siblings[3 * BVH_ARITY], siblings[4 * BVH_ARITY], siblings[5 * BVH_ARITY]);
  return box;
}

#else

#define LEVEL_BARRIER barrier(CLK_GLOBAL_MEM_FENCE)
static void storeNode(__global Aabb* nodes, uint place, Aabb box) { nodes[place] = box; }
static Aabb loadNode(__global const Aabb* nodes, uint place) { return nodes[place]; }

#endif

// Nodes [begin, end) of a level, by the lanes of one group: node j bounds the children [j, j + 1) * BVH_ARITY.
static void bvhLevel(uint level, uint begin, uint end, __constant BvhLevels* levels, __global Aabb* nodes) {
  const uint childFirst = levels->first[level - 1], childCount = levels->size[level - 1];
  const uint first = levels->first[level];
  for (uint j = begin + get_local_id(0); j < min(end, levels->size[level]); j += GROUP_SIZE) {
    Aabb box = emptyAabb();
    const uint last = min(childCount, (j + 1) * BVH_ARITY);
    for (uint c = j * BVH_ARITY; c < last; ++c) box = mergeAabb(box, loadNode(nodes, childFirst + c));
    storeNode(nodes, first + j, box);
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
      storeNode(nodes, i, AT(aabbs, order[i]));
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

// Where a pair goes: behind the pairs of lower bodies, at any free place among those of its own. counts[] says how many
// places of the body are still free.
static void emitPair(CHECKS uint a, uint b, __global const uint* offsets, volatile __global uint* counts,
                     __global ulong* keys) {
  const uint lower = min(a, b), left = atomic_dec(&AT(counts, lower));
  ASSERT(left > 0, left, lower);
  AT(keys, AT(offsets, lower) + left - 1) = pairKeyOf(a, b);
}

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

// Bit c: child c of the siblings from `place` on overlaps the box.
static uint overlapSiblings(__global const Aabb* nodes, uint place, Aabb box) {
  __global const float* siblings = (__global const float*)(nodes + place);
  const int8 overlap = (vload8(0, siblings) <= box.upper.x) & (vload8(3, siblings) >= box.lower.x) &
                       (vload8(1, siblings) <= box.upper.y) & (vload8(4, siblings) >= box.lower.y) &
                       (vload8(2, siblings) <= box.upper.z) & (vload8(5, siblings) >= box.lower.z);
  const int8 bits = overlap & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
  const int4 four = bits.lo | bits.hi;
  const int2 two = four.lo | four.hi;
  return (uint)(two.x | two.y);
}

static uint visitPairs(CHECKS uint position, __constant BvhLevels* levels, __global const Aabb* nodes,
                       __global const uint* order, __global const BodyInfo* infos, __global uint* kept,
                       volatile __global uint* counts, __global const uint* offsets, __global ulong* keys) {
  const uint self = AT(order, position);
  const BodyInfo info = AT(infos, self);
  const uint top = levels->levelCount - 1;
  if (!isCollidable(info) || top == 0) return 0;
  const Aabb box = loadNode(nodes, position);
  uint open[BVH_MAX_LEVELS], begin[BVH_MAX_LEVELS];  // of each level, the siblings that are still to be visited
  uint level = top, child = 0, found = 0;
  while (true) {
    // Down to the children of `child`: those that overlap, exist, and have a body behind this one.
    --level;
    begin[level] = child * BVH_ARITY;
    const uint behind = (position + 1) >> (level * BVH_ARITY_BITS);
    uint mask = overlapSiblings(nodes, levels->first[level] + begin[level], box);
    mask &= (1u << min(BVH_ARITY, levels->size[level] - begin[level])) - 1u;
    if (behind > begin[level]) mask &= ~((1u << min(BVH_ARITY, behind - begin[level])) - 1u);
    if (level == 0) {
      for (; mask; mask &= mask - 1) {
        const uint other = AT(order, begin[0] + popcount((mask & (0 - mask)) - 1u));
        if (!filtersMatch(info, AT(infos, other))) continue;
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
      if (filtersMatch(info, AT(infos, other))) {
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

// found[i]: pairs found from position i; counts[b]: pairs whose lower body is b.
KERNEL countPairs(CHECKS uint bodyCount, __constant BvhLevels* levels, __global const Aabb* nodes,
                  __global const uint* order, __global const BodyInfo* infos, __global uint* found,
                  __global uint* counts, __global uint* kept) {
  FOR_EACH(i, bodyCount) {
    found[i] =
        visitPairs(WITH_CHECKS i, levels, nodes, order, infos, kept + (ulong)i * PAIRS_KEPT, counts, 0, 0);
  }
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

// ---- each body's pairs in order ------------------------------------------------------------------------------

#define FEW_PAIRS 32u  // that one work item sorts by insertion

static void sortFew(__global ulong* keys, uint count) {
  for (uint i = 1; i < count; ++i) {
    const ulong key = keys[i];
    uint to = i;
    for (; to > 0 && keys[to - 1] > key; --to) keys[to] = keys[to - 1];
    keys[to] = key;
  }
}

// Of more pairs the higher bodies become bits of a window over all bodies, which are then read out in order. Several
// windows need room for the result.
#ifdef BTGPU_SHAPE_CPU

#define WINDOW_WORDS 1024u

static void sortMany(CHECKS uint bodyCount, uint body, uint first, uint last, __global ulong* keys,
                     __global ulong* sorted) {
  uint bits[WINDOW_WORDS];
  const uint window = WINDOW_WORDS * 32, several = bodyCount - body > window;
  uint to = first;
  for (uint begin = body; begin < bodyCount; begin += min(window, bodyCount - begin)) {
    const uint words = min(WINDOW_WORDS, (bodyCount - begin + 31) / 32);
    for (uint w = 0; w < words; ++w) bits[w] = 0;
    for (uint k = first; k < last; ++k) {
      const uint place = (uint)keys[k] - begin;  // wraps below the window
      if (place < window) bits[place / 32] |= 1u << (place % 32);
    }
    for (uint w = 0; w < words; ++w) {
      for (uint left = bits[w]; left; left &= left - 1) {
        const ulong key = pairKeyOf(body, begin + w * 32 + (31 - clz(left & (0 - left))));
        if (several) {
          AT(sorted, to) = key;
        } else {
          AT(keys, to) = key;
        }
        ++to;
      }
    }
  }
  for (uint k = first; several && k < last; ++k) keys[k] = sorted[k];
}

KERNEL sortPairs(CHECKS uint bodyCount, __global const StepCounters* counters, __global const uint* offsets,
                 __global ulong* keys, __global ulong* sorted) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    const uint first = offsets[i], last = i + 1 < bodyCount ? offsets[i + 1] : counters->pairCount;
    ASSERT(first <= last && last <= LENGTH(keys), first, last);
    if (last - first <= FEW_PAIRS) {
      sortFew(keys + first, last - first);
    } else {
      sortMany(WITH_CHECKS bodyCount, i, first, last, keys, sorted);
    }
  }
}

#else

#define WINDOW_WORDS 4096u

// By all lanes of a group.
static void sortMany(CHECKS uint bodyCount, uint body, uint first, uint last, __global ulong* keys,
                     __global ulong* sorted, __local uint* bits, __local uint* scratch) {
  const uint lane = get_local_id(0);
  const uint window = WINDOW_WORDS * 32, several = bodyCount - body > window;
  uint to = first;
  for (uint begin = body; begin < bodyCount; begin += min(window, bodyCount - begin)) {
    const uint words = min(WINDOW_WORDS, (bodyCount - begin + 31) / 32);
    for (uint w = lane; w < words; w += GROUP_SIZE) bits[w] = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint k = first + lane; k < last; k += GROUP_SIZE) {
      const uint place = (uint)keys[k] - begin;  // wraps below the window
      if (place < window) atomic_or(&bits[place / 32], 1u << (place % 32));
    }
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    for (uint tile = 0; tile < words; tile += GROUP_SIZE) {
      uint left = tile + lane < words ? bits[tile + lane] : 0, total;
      uint mine = to + groupExclusiveScan(popcount(left), scratch, &total);
      for (; left; left &= left - 1) {
        const ulong key = pairKeyOf(body, begin + (tile + lane) * 32 + (31 - clz(left & (0 - left))));
        if (several) {
          AT(sorted, mine) = key;
        } else {
          AT(keys, mine) = key;
        }
        ++mine;
      }
      to += total;
    }
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
  }
  for (uint k = first + lane; several && k < last; k += GROUP_SIZE) keys[k] = sorted[k];
}

KERNEL sortPairs(CHECKS uint bodyCount, __global const StepCounters* counters, __global const uint* offsets,
                 __global ulong* keys, __global ulong* sorted) {
  __local uint bits[WINDOW_WORDS], scratch[GROUP_SIZE], many[GROUP_SIZE], manyCount;
  RETURN_ON_OVERFLOW(counters);
  const uint lane = get_local_id(0);
  for (uint base = get_group_id(0) * GROUP_SIZE; base < bodyCount; base += get_global_size(0)) {
    if (lane == 0) manyCount = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    const uint i = base + lane;
    if (i < bodyCount) {
      const uint first = offsets[i], last = i + 1 < bodyCount ? offsets[i + 1] : counters->pairCount;
      ASSERT(first <= last && last <= LENGTH(keys), first, last);
      if (last - first <= FEW_PAIRS) {
        sortFew(keys + first, last - first);
      } else {
        many[atomic_inc(&manyCount)] = i;
      }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    const uint n = manyCount;
    for (uint k = 0; k < n; ++k) {
      const uint body = many[k];
      const uint first = offsets[body], last = body + 1 < bodyCount ? offsets[body + 1] : counters->pairCount;
      sortMany(WITH_CHECKS bodyCount, body, first, last, keys, sorted, bits, scratch);
      barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}

#endif
