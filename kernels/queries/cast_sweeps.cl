// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Convex shapes on their way through a tree over items (lib/ray_tree.h). A work item does a sweep.
#define BTGPU_CURVED
#define BTGPU_SUPPORT_BY_CALL
#define BTGPU_TRIANGLE_CORES
#include "../lib/convex_sweep.h"
#include "../lib/ray_tree.h"

STRUCT(SweepItems) {
  __global const BodyInfo* infos;
  __global const ItemPose* poses;
  __global const ItemForm* forms;
  __global const CompoundChild* children;
};

static void sweepItem(uint item, SweepItems items, SweepShapes q, Sweep sweep, SweepHit* best) {
  const BodyInfo info = items.infos[item];
  if (!sweepMayHit(sweep, info)) return;
  const uint child = items.forms[item].child;
  if (child != NO_INDEX && !sweepMeetsChild(items.children[child], sweep)) return;
  SweepHit hit = *best;
  if (!sweepAgainstShape(sweep, q.shapes[sweep.shape], q.shapes[info.shapeIndex], items.poses[item], q,
                         best->normal.w, &hit)) {
    return;
  }
  hit.object = (uint)info.uniqueId;
  if (isBetterSweepHit(hit, *best)) *best = hit;
}

// The first hit of each sweep. The items from treeCount on have no bounds and are in no tree.
KERNEL castSweeps(CHECKS uint sweepCount, uint treeCount, uint itemCount, __constant BvhLevels* levels,
                  __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                  __global const ItemPose* poses, __global const ItemForm* forms,
                  __global const CompoundChild* children, __global const Shape* shapes,
                  __global const float4* hullVertices, __global const HullFace* hullFaces,
                  __global const uint* hullCorners, __global const HullEdge* hullEdges, __global const Mesh* meshes,
                  __global const MeshNode* meshNodes, __global const MeshTriangle* meshTriangles,
                  __global const Sweep* sweeps, __global SweepHit* hits) {
  SweepItems items;
  items.infos = infos;
  items.poses = poses;
  items.forms = forms;
  items.children = children;
  const SweepShapes q = sweepShapes(shapes, hullsOf(hullVertices, hullFaces, hullCorners, hullEdges), meshes,
                                    meshNodes, meshTriangles);
  FOR_EACH(i, sweepCount) {
    const Sweep sweep = sweeps[i];
    SweepHit best = noSweepHit();
    if (sweep.shape >= 0) {
      const Way way = wayOfBox(sweep.from, sweep.to, sweep.lower, sweep.upper);
      RayStack stack;
      float enter;
      startAtRoot(WITH_CHECKS &stack, treeCount, levels, nodes, way);
      uint unbounded = treeCount;
      while (true) {
        uint item = unbounded;
        if (unbounded < itemCount) {
          ++unbounded;
        } else {
          const uint place = nextItem(WITH_CHECKS &stack, levels, nodes, way, best.normal.w, &enter);
          if (place == NO_INDEX) break;
          item = AT(order, place);
        }
        sweepItem(item, items, q, sweep, &best);
      }
    }
    AT(hits, i) = best;
  }
}

static Asking askingSweep(Sweep sweep, float limit) {
  Asking a;
  a.way = wayOfBox(sweep.from, sweep.to, sweep.lower, sweep.upper);
  a.filterGroup = sweep.filterGroup;
  a.filterMask = sweep.filterMask;
  a.ignored = sweep.ignored;
  a.limit = limit;
  return a;
}

KERNEL countHostItems(CHECKS uint sweepCount, uint treeCount, uint itemCount, __constant BvhLevels* levels,
                      __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                      __global const Sweep* sweeps, __global const SweepHit* hits, __global uint* counts) {
  FOR_EACH(i, sweepCount) {
    const Sweep sweep = sweeps[i];
    AT(counts, i) = sweep.shape < 0 ? 0 : visitHostItems(WITH_CHECKS treeCount, itemCount, levels, nodes, order, infos,
                                                         askingSweep(sweep, hits[i].normal.w), 0, 0, 0);
  }
}

KERNEL emitHostItems(CHECKS uint sweepCount, uint treeCount, uint itemCount, __constant BvhLevels* levels,
                     __global const Aabb* nodes, __global const uint* order, __global const BodyInfo* infos,
                     __global const Sweep* sweeps, __global const SweepHit* hits, __global const uint* offsets,
                     __global uint* objects, __global float* enters) {
  FOR_EACH(i, sweepCount) {
    const Sweep sweep = sweeps[i];
    if (sweep.shape < 0) continue;
    visitHostItems(WITH_CHECKS treeCount, itemCount, levels, nodes, order, infos,
                   askingSweep(sweep, hits[i].normal.w), AT(offsets, i), objects, enters);
  }
}
