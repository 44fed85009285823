// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Rays through a tree over items (the tree of stage 30, kernels/shared/bvh.h): nearest children first, none that lies
// behind the best hit. A work item casts a ray; on a CPU it meets the eight children of a node at once.
#include "../lib/bounds.h"
#include "../lib/kernel.h"
#include "../lib/ray_cast.h"
#include "../shared/bvh.h"

#define STACK_SIZE (BVH_MAX_LEVELS * (BVH_ARITY - 1u) + 1u)
#define LEVEL_SHIFT 28u  // a node on the stack: its level, and below that its place in the level

// Nodes that the ray enters and that are still to be visited, the nearest last among siblings.
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

// Pushes those nodes [begin, end) of a level, siblings, that the ray enters before `limit`.
#ifdef BTGPU_SHAPE_CPU
static void pushSiblings(CHECKS RayStack* stack, uint level, uint begin, uint end, __constant BvhLevels* levels,
                         __global const Aabb* nodes, float4 from, float4 inverse, float limit) {
  __global const float* s = (__global const float*)&AT(nodes, levels->first[level] + begin);
  const float8 ax = (vload8(0, s) - from.x) * inverse.x, bx = (vload8(3, s) - from.x) * inverse.x;
  const float8 ay = (vload8(1, s) - from.y) * inverse.y, by = (vload8(4, s) - from.y) * inverse.y;
  const float8 az = (vload8(2, s) - from.z) * inverse.z, bz = (vload8(5, s) - from.z) * inverse.z;
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
                         __global const Aabb* nodes, float4 from, float4 inverse, float limit) {
  const uint base = stack->count, last = min(end, begin + BVH_ARITY);
  for (uint c = begin; c < last; ++c) {
    const float enter = enterAabb(AT(nodes, levels->first[level] + c), from, inverse, limit);
    if (enter <= limit) pushNode(stack, base, level << LEVEL_SHIFT | c, enter);
  }
}
#endif

static void startAtRoot(CHECKS RayStack* stack, uint treeCount, __constant BvhLevels* levels,
                        __global const Aabb* nodes, Ray ray, float4 inverse) {
  stack->count = 0;
  if (treeCount == 0) return;
  pushSiblings(WITH_CHECKS stack, levels->levelCount - 1, 0, 1, levels, nodes, ray.from, inverse, 1.0f);
}

// The position in order[] of the next item whose bounds the ray enters before `limit`, and where; NO_INDEX if there is
// none left.
static uint nextItem(CHECKS RayStack* stack, __constant BvhLevels* levels, __global const Aabb* nodes, Ray ray,
                     float4 inverse, float limit, float* enter) {
  while (stack->count > 0) {
    const uint top = --stack->count, node = stack->nodes[top], level = node >> LEVEL_SHIFT;
    const uint place = node & ((1u << LEVEL_SHIFT) - 1u);
    *enter = stack->enters[top];
    if (*enter > limit) continue;
    if (level == 0) return place;
    pushSiblings(WITH_CHECKS stack, level - 1, place * BVH_ARITY, levels->size[level - 1], levels, nodes, ray.from,
                 inverse, limit);
  }
  return NO_INDEX;
}

// ---- items that the device has a test for --------------------------------------------------------------------

STRUCT(Items) {
  __global const BodyInfo* infos;
  __global const ItemPose* poses;
  __global const uint* childOf;  // index in children[], or NO_INDEX
  __global const CompoundChild* children;
  __global const Shape* shapes;
  __global const float4* hullVertices;
};

static void castItem(uint item, Items items, Ray ray, uint isDouble, RayHit* best) {
  const BodyInfo info = items.infos[item];
  if (!rayMayHit(ray, info)) return;
  const uint child = items.childOf[item];
  if (child != NO_INDEX && !meetsChild(items.children[child], ray)) return;
  RayHit hit = *best;
  if (!castShape(items.shapes[info.shapeIndex], items.poses[item], items.hullVertices, ray, isDouble, best->normal.w,
                 &hit)) {
    return;
  }
  hit.object = (uint)info.uniqueId;
  if (child != NO_INDEX && hit.part < 0) hit.triangle = items.children[child].child;
  if (isBetterHit(hit, *best)) *best = hit;
}

// The first hit of each ray. The items from treeCount on have no bounds and are in no tree.
KERNEL castRays(CHECKS uint rayCount, uint treeCount, uint itemCount, uint isDouble, __constant BvhLevels* levels,
                __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                __global const ItemPose* poses, __global const uint* childOf, __global const CompoundChild* children,
                __global const Shape* shapes, __global const float4* hullVertices, __global const Ray* rays,
                __global RayHit* hits) {
  Items items;
  items.infos = infos;
  items.poses = poses;
  items.childOf = childOf;
  items.children = children;
  items.shapes = shapes;
  items.hullVertices = hullVertices;
  FOR_EACH(i, rayCount) {
    const Ray ray = rays[i];
    RayHit best = noRayHit();
    if (!(ray.flags & RAY_OFF)) {
      for (uint k = treeCount; k < itemCount; ++k) castItem(k, items, ray, isDouble, &best);
      const float4 inverse = inverseDirection(ray.to - ray.from);
      RayStack stack;
      float enter;
      startAtRoot(WITH_CHECKS &stack, treeCount, levels, nodes, ray, inverse);
      while (true) {
        const uint place = nextItem(WITH_CHECKS &stack, levels, nodes, ray, inverse, best.normal.w, &enter);
        if (place == NO_INDEX) break;
        castItem(AT(order, place), items, ray, isDouble, &best);
      }
    }
    AT(hits, i) = best;
  }
}

// ---- items that the host has to ask --------------------------------------------------------------------------

// Objects whose bounds a ray enters before its hit; kept if there is where to, in the order in which they are found.
static uint visitHostItems(CHECKS uint treeCount, uint itemCount, __constant BvhLevels* levels,
                           __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                           Ray ray, float limit, uint first, __global uint* objects, __global float* enters) {
  uint found = 0;
  if (ray.flags & RAY_OFF) return 0;
  for (uint k = treeCount; k < itemCount; ++k) {
    if (!rayMayHit(ray, AT(infos, k))) continue;
    if (objects) {
      AT(objects, first + found) = (uint)infos[k].uniqueId;
      AT(enters, first + found) = 0.0f;
    }
    ++found;
  }
  const float4 inverse = inverseDirection(ray.to - ray.from);
  RayStack stack;
  float enter;
  startAtRoot(WITH_CHECKS &stack, treeCount, levels, nodes, ray, inverse);
  while (true) {
    const uint place = nextItem(WITH_CHECKS &stack, levels, nodes, ray, inverse, limit, &enter);
    if (place == NO_INDEX) return found;
    const BodyInfo info = AT(infos, AT(order, place));
    if (!rayMayHit(ray, info)) continue;
    if (objects) {
      AT(objects, first + found) = (uint)info.uniqueId;
      AT(enters, first + found) = enter;
    }
    ++found;
  }
}

KERNEL countHostItems(CHECKS uint rayCount, uint treeCount, uint itemCount, __constant BvhLevels* levels,
                      __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                      __global const Ray* rays, __global const RayHit* hits, __global uint* counts) {
  FOR_EACH(i, rayCount) {
    AT(counts, i) = visitHostItems(WITH_CHECKS treeCount, itemCount, levels, nodes, order, infos, rays[i],
                                   hits[i].normal.w, 0, 0, 0);
  }
}

KERNEL emitHostItems(CHECKS uint rayCount, uint treeCount, uint itemCount, __constant BvhLevels* levels,
                     __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                     __global const Ray* rays, __global const RayHit* hits, __global const uint* offsets,
                     __global uint* objects, __global float* enters) {
  FOR_EACH(i, rayCount) {
    visitHostItems(WITH_CHECKS treeCount, itemCount, levels, nodes, order, infos, rays[i], hits[i].normal.w,
                   AT(offsets, i), objects, enters);
  }
}
