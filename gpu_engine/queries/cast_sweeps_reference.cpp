// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#define BTGPU_TRIANGLE_CORES  // as in the kernel; no other file of the engine knows cores
#include "cast_sweeps_reference.h"

#include <algorithm>

#include "../../kernels/lib/convex_sweep.h"

namespace btgpu {
namespace {

SweepShapes shapesOf(const QueryWorld& world) {
  const HullArrays& h = world.shapes.hulls;
  const MeshArrays& m = world.shapes.meshes;
  return sweepShapes(world.shapes.shapes.values.data(),
                     hullsOf(h.vertices.data(), h.faces.data(), h.corners.data(), h.edges.data()), m.meshes.data(),
                     m.nodes.data(), m.triangles.data());
}

bool entersBounds(const Sweep& s, const Aabb& box, float limit) {
  return enterOnWay(box, wayOfBox(s.from, s.to, s.lower, s.upper), limit) <= limit;
}

bool sweepAtTriangles(const Sweep& s, const Shape& shape, const Shape& meshShape, const ItemPose& pose,
                      const SweepShapes& q, SweepHit& hit) {
  const Mesh& mesh = q.meshes[meshShape.firstVertex];
  bool found = false;
  for (int i = 0; i < mesh.triangleCount; ++i) {
    const SweepTarget target = triangleTarget(q.meshTriangles[mesh.firstTriangle + i], pose, meshShape);
    SweepHit there = noSweepHit();
    if (!sweepAgainst(s, shape, target, q.hulls, 1, &there)) continue;
    if (!found || there.normal.w < hit.normal.w) hit = there;
    found = true;
  }
  return found;
}

void castOne(const QueryWorld& world, size_t item, const Sweep& s, SweepHit& best) {
  const QueryItems& items = world.device;
  const BodyInfo& info = items.infos[item];
  if (!sweepMayHit(s, info)) return;
  if (item < items.treeCount && !entersBounds(s, items.aabbs[item], 1)) return;
  const std::uint32_t child = items.forms[item].child;
  if (child != NO_INDEX && !sweepMeetsChild(world.children[child], s)) return;
  const SweepShapes q = shapesOf(world);
  const Shape &shape = q.shapes[s.shape], &target = q.shapes[info.shapeIndex];
  SweepHit hit = noSweepHit();
  if (target.type == SHAPE_MESH ? !sweepAtTriangles(s, shape, target, items.poses[item], q, hit)
                                : !sweepAgainstShape(s, shape, target, items.poses[item], q, 1, &hit)) {
    return;
  }
  hit.object = static_cast<uint>(info.uniqueId);
  if (isBetterSweepHit(hit, best)) best = hit;
}

}  // namespace

std::vector<SweepHit> castSweepsReference(const QueryWorld& world, const std::vector<Sweep>& sweeps) {
  std::vector<SweepHit> hits;
  for (const Sweep& s : sweeps) {
    SweepHit best = noSweepHit();
    for (size_t k = 0; s.shape >= 0 && k < world.device.infos.size(); ++k) castOne(world, k, s, best);
    hits.push_back(best);
  }
  return hits;
}

std::vector<std::vector<std::uint32_t>> hostItemsReference(const QueryWorld& world, const std::vector<Sweep>& sweeps,
                                                           const std::vector<SweepHit>& hits) {
  std::vector<std::vector<std::uint32_t>> found(sweeps.size());
  const QueryItems& items = world.host;
  for (size_t i = 0; i < sweeps.size(); ++i) {
    for (size_t k = 0; sweeps[i].shape >= 0 && k < items.infos.size(); ++k) {
      if (!sweepMayHit(sweeps[i], items.infos[k])) continue;
      if (k < items.treeCount && !entersBounds(sweeps[i], items.aabbs[k], hits[i].normal.w)) continue;
      found[i].push_back(static_cast<std::uint32_t>(items.infos[k].uniqueId));
    }
    std::sort(found[i].begin(), found[i].end());
  }
  return found;
}

}  // namespace btgpu
