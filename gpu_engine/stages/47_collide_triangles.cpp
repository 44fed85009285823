// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "47_collide_triangles.h"

namespace btgpu {
namespace {

constexpr uint kFlat = 1u << SHAPE_BOX | 1u << SHAPE_CAPSULE | 1u << SHAPE_HULL;
constexpr uint kCurved = 1u << SHAPE_CYLINDER | 1u << SHAPE_CONE | 1u << SHAPE_MULTI_SPHERE | 1u << SHAPE_SUM;

}  // namespace

void CollideTriangles::enqueue(Queue& queue, DeviceWorld& world, uint shapeTypes) {
  queue.enterStage("47_collide_triangles");
  constexpr const char* kFile = "stages/47_collide_triangles.cl";
  DeviceWorld& w = world;
  w.triangleTouches.resize(queue, w.capacities.triangleHits);
  if (shapeTypes >> SHAPE_SPHERE & 1u) {
    if (!m_collideSpheres.isBuilt()) {
      m_collideSpheres = Kernel(queue.device(), kFile, "collideTriangles", "-DBTGPU_SPHERES");
    }
    collide(queue, w, m_collideSpheres);
  }
  if (shapeTypes & kFlat) {
    if (!m_collideConvex.isBuilt()) m_collideConvex = Kernel(queue.device(), kFile, "collideTriangles");
    collide(queue, w, m_collideConvex);
  }
  if (shapeTypes & kCurved) {
    if (!m_collideCurved.isBuilt()) {
      m_collideCurved = Kernel(queue.device(), kFile, "collideTriangles", "-DBTGPU_CURVED");
    }
    collide(queue, w, m_collideCurved);
  }
  if (!m_pickTouches.isBuilt()) m_pickTouches = Kernel(queue.device(), "stages/47_pick_touches.cl", "pickTouches");
  m_pickTouches.launch(queue, queue.device().grid(w.capacities.pairs), w.counters, w.triangleGroups, w.bucketFirst,
                       w.items, w.pairs, w.infos, w.shapes, w.oldManifolds, w.meshes, w.triangleFound, w.triangleFirst,
                       w.triangleHits, w.triangleTouches, w.contacts);
}

void CollideTriangles::collide(Queue& queue, DeviceWorld& w, Kernel& kernel) {
  kernel.launch(queue, queue.device().grid(w.capacities.triangleHits), w.counters, w.bucketFirst, w.items, w.pairs,
                w.infos, w.shapes, w.poses, w.oldManifolds, w.hullVertices, w.hullFaces, w.hullCorners, w.hullEdges,
                w.meshTriangles, w.triangleHits, w.triangleTouches);
}

}  // namespace btgpu
