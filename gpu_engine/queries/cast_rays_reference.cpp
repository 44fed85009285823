// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "cast_rays_reference.h"

#include <algorithm>

#include "../../kernels/lib/ray_cast.h"

namespace btgpu {
namespace {

bool entersBounds(const Ray& ray, const Aabb& box, float limit) {
  return enterAabb(box, ray.from, inverseDirection(ray.to - ray.from), limit) <= limit;
}

void castOne(const QueryWorld& world, size_t item, const Ray& ray, RayHit& best) {
  const QueryItems& items = world.device;
  const BodyInfo& info = items.infos[item];
  if (!rayMayHit(ray, info)) return;
  if (item < items.treeCount && !entersBounds(ray, items.aabbs[item], 1)) return;
  const std::uint32_t child = items.childOf[item];
  if (child != NO_INDEX && !meetsChild(world.children[child], ray)) return;
  RayHit hit = noRayHit();
  const Shape& shape = world.shapes.shapes.values[static_cast<size_t>(info.shapeIndex)];
  if (!castShape(shape, items.poses[item], world.shapes.hulls.vertices.data(), ray, world.isDouble, 1, &hit)) return;
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
