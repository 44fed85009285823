// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "cast_rays_reference.h"

#include <algorithm>
#include <utility>

#include "../../kernels/lib/ray_cast.h"

namespace btgpu {
namespace {

bool entersBounds(const Ray& ray, const Aabb& box, float limit) {
  return enterAabb(box, ray.from, inverseDirection(ray.to - ray.from), limit) <= limit;
}

QueryShapes shapesOf(const QueryWorld& world) {
  const MeshArrays& m = world.shapes.meshes;
  return queryShapes(world.shapes.shapes.values.data(), world.shapes.hulls.vertices.data(), world.spheres.data(),
                     m.meshes.data(), m.nodes.data(), m.triangles.data());
}

float4 dividedBy(const float4& v, const float4& by) { return {v.x / by.x, v.y / by.y, v.z / by.z, 0}; }

// Every triangle of a mesh.
bool castAtTriangles(const Mesh& mesh, const ItemForm& form, const ItemPose& pose, const QueryShapes& q, const Ray& ray,
                     RayHit& hit) {
  const float4 from = dividedBy(toLocalDirection(pose, ray.from - originOf(pose)), form.scaling);
  const float4 to = dividedBy(toLocalDirection(pose, ray.to - originOf(pose)), form.scaling);
  const bool cells = (form.flags & FORM_HEIGHT_FIELD) && !(ray.flags & RAY_ALL_TRIANGLES);
  const bool turned = cells && (form.flags & FORM_OTHER_WINDING);
  const MeshTriangle* best = nullptr;
  for (int i = 0; i < mesh.triangleCount; ++i) {
    const MeshTriangle& t = q.meshTriangles[mesh.firstTriangle + i];
    float fraction = 1;
    float4 normal;
    if (!castTriangle(t.a, turned ? t.c : t.b, turned ? t.b : t.c, from, to, ray.flags, &fraction, &normal)) continue;
    if (!(fraction < 1) || (best && fraction > hit.normal.w)) continue;
    if (best && fraction == hit.normal.w &&
        std::make_pair(t.part, t.index) >= std::make_pair(best->part, best->index)) {
      continue;
    }
    best = &t;
    hit.normal = withW(toWorldPoint(pose, {0, 0, 0, 0}, normal), fraction);
    hit.part = cells ? t.part / 2 : t.part;
    hit.triangle = t.index;
  }
  return best != nullptr;
}

void castOne(const QueryWorld& world, size_t item, const Ray& ray, RayHit& best) {
  const QueryItems& items = world.device;
  const BodyInfo& info = items.infos[item];
  if (!rayMayHit(ray, info)) return;
  if (item < items.treeCount && !entersBounds(ray, items.aabbs[item], 1)) return;
  const ItemForm& form = items.forms[item];
  const std::uint32_t child = form.child;
  if (child != NO_INDEX && !meetsChild(world.children[child], ray)) return;
  RayHit hit = noRayHit();
  const QueryShapes q = shapesOf(world);
  const Shape& shape = q.shapes[info.shapeIndex];
  if (shape.type == SHAPE_MESH ? !castAtTriangles(q.meshes[shape.firstVertex], form, items.poses[item], q, ray, hit)
                               : !castShape(shape, form, items.poses[item], q, ray, world.isDouble, 1, &hit)) {
    return;
  }
  hit.object = static_cast<uint>(info.uniqueId);
  if (child != NO_INDEX && hit.part < 0) hit.triangle = world.children[child].child;
  if (isBetterHit(hit, best)) best = hit;
}

}  // namespace

std::vector<RayHit> castRaysReference(const QueryWorld& world, const std::vector<Ray>& rays) {
  std::vector<RayHit> hits;
  for (const Ray& ray : rays) {
    RayHit best = noRayHit();
    for (size_t k = 0; !(ray.flags & RAY_OFF) && k < world.device.infos.size(); ++k) castOne(world, k, ray, best);
    hits.push_back(best);
  }
  return hits;
}

std::vector<std::vector<std::uint32_t>> hostItemsReference(const QueryWorld& world, const std::vector<Ray>& rays,
                                                           const std::vector<RayHit>& hits) {
  std::vector<std::vector<std::uint32_t>> found(rays.size());
  const QueryItems& items = world.host;
  for (size_t i = 0; i < rays.size(); ++i) {
    for (size_t k = 0; !(rays[i].flags & RAY_OFF) && k < items.infos.size(); ++k) {
      if (!rayMayHit(rays[i], items.infos[k])) continue;
      if (k < items.treeCount && !entersBounds(rays[i], items.aabbs[k], hits[i].normal.w)) continue;
      found[i].push_back(static_cast<std::uint32_t>(items.infos[k].uniqueId));
    }
    std::sort(found[i].begin(), found[i].end());
  }
  return found;
}

}  // namespace btgpu
