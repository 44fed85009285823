// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Rays through a tree over items (lib/ray_tree.h). A work item casts a ray.
#include "../lib/ray_cast.h"
#include "../lib/ray_tree.h"

// ---- items that the device has a test for --------------------------------------------------------------------

STRUCT(Items) {
  __global const BodyInfo* infos;
  __global const ItemPose* poses;
  __global const ItemForm* forms;
  __global const CompoundChild* children;
};

static void castItem(uint item, Items items, QueryShapes q, Ray ray, uint isDouble, RayHit* best) {
  const BodyInfo info = items.infos[item];
  if (!rayMayHit(ray, info)) return;
  const ItemForm form = items.forms[item];
  if (form.child != NO_INDEX && !meetsChild(items.children[form.child], ray)) return;
  RayHit hit = *best;
  if (!castShape(q.shapes[info.shapeIndex], form, items.poses[item], q, ray, isDouble, best->normal.w, &hit)) return;
  hit.object = (uint)info.uniqueId;
  if (form.child != NO_INDEX && hit.part < 0) hit.triangle = items.children[form.child].child;
  if (isBetterHit(hit, *best)) *best = hit;
}

// The first hit of each ray. The items from treeCount on have no bounds and are in no tree.
KERNEL castRays(CHECKS uint rayCount, uint treeCount, uint itemCount, uint isDouble, __constant BvhLevels* levels,
                __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                __global const ItemPose* poses, __global const ItemForm* forms, __global const CompoundChild* children,
                __global const Shape* shapes, __global const float4* hullVertices, __global const float4* spheres,
                __global const Mesh* meshes, __global const MeshNode* meshNodes,
                __global const MeshTriangle* meshTriangles, __global const Ray* rays, __global RayHit* hits) {
  Items items;
  items.infos = infos;
  items.poses = poses;
  items.forms = forms;
  items.children = children;
  const QueryShapes q = queryShapes(shapes, hullVertices, spheres, meshes, meshNodes, meshTriangles);
  FOR_EACH(i, rayCount) {
    const Ray ray = rays[i];
    RayHit best = noRayHit();
    if (!(ray.flags & RAY_OFF)) {
      for (uint k = treeCount; k < itemCount; ++k) castItem(k, items, q, ray, isDouble, &best);
      const Way way = wayOfPoint(ray.from, ray.to);
      RayStack stack;
      float enter;
      startAtRoot(WITH_CHECKS &stack, treeCount, levels, nodes, way);
      while (true) {
        const uint place = nextItem(WITH_CHECKS &stack, levels, nodes, way, best.normal.w, &enter);
        if (place == NO_INDEX) break;
        castItem(AT(order, place), items, q, ray, isDouble, &best);
      }
    }
    AT(hits, i) = best;
  }
}

// ---- items that the host has to ask --------------------------------------------------------------------------

static Asking askingRay(Ray ray, float limit) {
  Asking a;
  a.way = wayOfPoint(ray.from, ray.to);
  a.filterGroup = ray.filterGroup;
  a.filterMask = ray.filterMask;
  a.ignored = ray.ignored;
  a.limit = limit;
  return a;
}

KERNEL countHostItems(CHECKS uint rayCount, uint treeCount, uint itemCount, __constant BvhLevels* levels,
                      __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                      __global const Ray* rays, __global const RayHit* hits, __global uint* counts) {
  FOR_EACH(i, rayCount) {
    const Ray ray = rays[i];
    AT(counts, i) = ray.flags & RAY_OFF ? 0 : visitHostItems(WITH_CHECKS treeCount, itemCount, levels, nodes, order,
                                                             infos, askingRay(ray, hits[i].normal.w), 0, 0, 0);
  }
}

KERNEL emitHostItems(CHECKS uint rayCount, uint treeCount, uint itemCount, __constant BvhLevels* levels,
                     __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                     __global const Ray* rays, __global const RayHit* hits, __global const uint* offsets,
                     __global uint* objects, __global float* enters) {
  FOR_EACH(i, rayCount) {
    const Ray ray = rays[i];
    if (ray.flags & RAY_OFF) continue;
    visitHostItems(WITH_CHECKS treeCount, itemCount, levels, nodes, order, infos, askingRay(ray, hits[i].normal.w),
                   AT(offsets, i), objects, enters);
  }
}
