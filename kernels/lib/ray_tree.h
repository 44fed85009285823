// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The way of a ray, or of a shape that moves, through a tree over items (that of stage 30, kernels/shared/bvh.h):
// nearest children first, none that lies behind the best hit. On a CPU it meets the eight children of a node at once.
// OpenCL C only.
#ifndef BTGPU_LIB_RAY_TREE_H
#define BTGPU_LIB_RAY_TREE_H
#include "../shared/bvh.h"
#include "bounds.h"
#include "kernel.h"
#include "query_shapes.h"
#include "ray_bounds.h"

#define STACK_SIZE (BVH_MAX_LEVELS * (BVH_ARITY - 1u) + 1u)
#define LEVEL_SHIFT 28u  // a node on the stack: its level, and below that its place in the level

// Nodes that it enters and that are still to be visited, the nearest last among siblings.
STRUCT(RayStack) {
  uint nodes[STACK_SIZE];
  float enters[STACK_SIZE];
  uint count;
};

static void pushNode(RayStack* stack, uint base, uint node, float enter) {
  uint to = stack->count++;
  for (; to > base && stack->enters[to - 1] < enter; --to) {
    stack->enters[to] = stack->enters[to - 1];
    stack->nodes[to] = stack->nodes[to - 1];
  }
  stack->enters[to] = enter;
  stack->nodes[to] = node;
}

// Pushes those nodes [begin, end) of a level, siblings, that it enters before `limit`.
#ifdef BTGPU_SHAPE_CPU
static void pushSiblings(CHECKS RayStack* stack, uint level, uint begin, uint end, __constant BvhLevels* levels,
                         __global const Aabb* nodes, Way way, float limit) {
  const float4 from = way.fromLower, to = way.fromUpper, inverse = way.inverse;
  __global const float* s = (__global const float*)&AT(nodes, levels->first[level] + begin);
  const float8 ax = (vload8(0, s) - from.x) * inverse.x, bx = (vload8(3, s) - to.x) * inverse.x;
  const float8 ay = (vload8(1, s) - from.y) * inverse.y, by = (vload8(4, s) - to.y) * inverse.y;
  const float8 az = (vload8(2, s) - from.z) * inverse.z, bz = (vload8(5, s) - to.z) * inverse.z;
  const float8 enter = max(max(min(ax, bx), min(ay, by)), max(min(az, bz), (float8)0.0f));
  const float8 leave = min(min(max(ax, bx), max(ay, by)), min(max(az, bz), (float8)limit));
  const int8 bits = (enter <= leave) & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
  const int4 four = bits.lo | bits.hi;
  const int2 two = four.lo | four.hi;
  uint mask = (uint)(two.x | two.y) & ((1u << min(BVH_ARITY, end - begin)) - 1u);
  float enters[BVH_ARITY];
  vstore8(enter, 0, enters);
  const uint base = stack->count;
  for (; mask; mask &= mask - 1) {
    const uint c = popcount((mask & (0 - mask)) - 1u);
    pushNode(stack, base, level << LEVEL_SHIFT | (begin + c), enters[c]);
  }
}
#else
static void pushSiblings(CHECKS RayStack* stack, uint level, uint begin, uint end, __constant BvhLevels* levels,
                         __global const Aabb* nodes, Way way, float limit) {
  const uint base = stack->count, last = min(end, begin + BVH_ARITY);
  for (uint c = begin; c < last; ++c) {
    const float enter = enterOnWay(AT(nodes, levels->first[level] + c), way, limit);
    if (enter <= limit) pushNode(stack, base, level << LEVEL_SHIFT | c, enter);
  }
}
#endif

static void startAtRoot(CHECKS RayStack* stack, uint treeCount, __constant BvhLevels* levels,
                        __global const Aabb* nodes, Way way) {
  stack->count = 0;
  if (treeCount == 0) return;
  pushSiblings(WITH_CHECKS stack, levels->levelCount - 1, 0, 1, levels, nodes, way, 1.0f);
}

// The position in order[] of the next item whose bounds it enters before `limit`, and where; NO_INDEX if there is
// none left.
static uint nextItem(CHECKS RayStack* stack, __constant BvhLevels* levels, __global const Aabb* nodes, Way way,
                     float limit, float* enter) {
  while (stack->count > 0) {
    const uint top = --stack->count, node = stack->nodes[top], level = node >> LEVEL_SHIFT;
    const uint place = node & ((1u << LEVEL_SHIFT) - 1u);
    *enter = stack->enters[top];
    if (*enter > limit) continue;
    if (level == 0) return place;
    pushSiblings(WITH_CHECKS stack, level - 1, place * BVH_ARITY, levels->size[level - 1], levels, nodes, way,
                 limit);
  }
  return NO_INDEX;
}

// Who asks for host's items on its way.
STRUCT(Asking) {
  Way way;
  int filterGroup, filterMask;
  uint ignored;
  float limit;  // fraction of its way at which it ends
};

// Objects that the host has to ask: those whose bounds are entered before the limit; kept if there is where to, in the
// order in which they are found. The items from treeCount on have no bounds and are in no tree.
static uint visitHostItems(CHECKS uint treeCount, uint itemCount, __constant BvhLevels* levels,
                           __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                           Asking a, uint first, __global uint* objects, __global float* enters) {
  uint found = 0;
  for (uint k = treeCount; k < itemCount; ++k) {
    if (!mayMeet(a.filterGroup, a.filterMask, a.ignored, AT(infos, k))) continue;
    if (objects) {
      AT(objects, first + found) = (uint)infos[k].uniqueId;
      AT(enters, first + found) = 0.0f;
    }
    ++found;
  }
  RayStack stack;
  float enter;
  startAtRoot(WITH_CHECKS &stack, treeCount, levels, nodes, a.way);
  while (true) {
    const uint place = nextItem(WITH_CHECKS &stack, levels, nodes, a.way, a.limit, &enter);
    if (place == NO_INDEX) return found;
    const BodyInfo info = AT(infos, AT(order, place));
    if (!mayMeet(a.filterGroup, a.filterMask, a.ignored, info)) continue;
    if (objects) {
      AT(objects, first + found) = (uint)info.uniqueId;
      AT(enters, first + found) = enter;
    }
    ++found;
  }
}

#endif
