// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Convex shapes for tests, as the device has them and as Bullet's own.
#pragma once

#include <btBulletCollisionCommon.h>

#include <memory>
#include <vector>

#include "kernels/lib/convex.h"
#include "tests/lib/double3.h"
#include "tests/support/bullet_convert.h"
#include "tests/support/prism.h"
#include "translation/hull_features.h"

namespace btgpu {

struct ConvexShape {
  Shape shape{};
  HullArrays arrays;
  std::unique_ptr<btConvexShape> bullet;

  Hulls hulls() const {
    return {arrays.vertices.data(), arrays.faces.data(), arrays.corners.data(), arrays.edges.data()};
  }
};

inline ConvexShape hullOfPoints(const std::vector<float4>& points, float margin = 0.04f) {
  ConvexShape s;
  s.shape = appendHull(makeHullFeatures(points), s.arrays);
  s.shape.type = SHAPE_HULL;
  s.shape.margin = margin;
  auto hull = std::make_unique<btConvexHullShape>();
  for (const float4& p : points) hull->addPoint(toBullet(p), false);
  hull->setMargin(margin);
  hull->recalcLocalAabb();
  btVector3 lower, upper;
  hull->getAabb(btTransform::getIdentity(), lower, upper);
  const btVector3 half = (upper - lower) / 2, centre = (upper + lower) / 2;
  s.shape.extents = {half.x(), half.y(), half.z(), 0};
  s.shape.centre = {centre.x(), centre.y(), centre.z(), 0};
  s.bullet = std::move(hull);
  return s;
}

inline ConvexShape sphereOf(float radius) {
  ConvexShape s;
  s.shape.type = SHAPE_SPHERE;
  s.shape.margin = s.shape.extents.x = radius;
  s.bullet = std::make_unique<btSphereShape>(radius);
  return s;
}

inline ConvexShape boxOf(float4 half) {
  ConvexShape s;
  s.shape.type = SHAPE_BOX;
  s.shape.extents = half;
  s.bullet = std::make_unique<btBoxShape>(toBullet(half));
  s.shape.margin = s.bullet->getMargin();
  return s;
}

inline ConvexShape capsuleOf(int axis, float radius, float halfLength) {
  ConvexShape s;
  s.shape.type = SHAPE_CAPSULE;
  s.shape.margin = radius;
  s.shape.extents = {axis == 0 ? halfLength : 0, axis == 1 ? halfLength : 0, axis == 2 ? halfLength : 0, 0};
  if (axis == 0) s.bullet = std::make_unique<btCapsuleShapeX>(radius, 2 * halfLength);
  if (axis == 1) s.bullet = std::make_unique<btCapsuleShape>(radius, 2 * halfLength);
  if (axis == 2) s.bullet = std::make_unique<btCapsuleShapeZ>(radius, 2 * halfLength);
  return s;
}

// On an ellipsoid, so that all are corners.
inline std::vector<float4> ellipsoidPoints(Random& random, int count, float4 half) {
  std::vector<float4> points;
  for (int k = 0; k < count; ++k) points.push_back(random.direction() * half);
  return points;
}

// One pair's arrays joined: what a kernel gets.
struct ConvexPair {
  Shape a, b;
  HullArrays arrays;

  ConvexPair(const ConvexShape& first, const ConvexShape& second) : a(first.shape), b(second.shape) {
    add(first, a);
    add(second, b);
  }
  Hulls hulls() const {
    return {arrays.vertices.data(), arrays.faces.data(), arrays.corners.data(), arrays.edges.data()};
  }

 private:
  void add(const ConvexShape& s, Shape& placed) {
    if (s.shape.type != SHAPE_HULL) return;
    HullFeatures f{s.arrays.vertices, s.arrays.faces, s.arrays.corners, s.arrays.edges};
    const Shape place = appendHull(f, arrays);
    placed.firstVertex = place.firstVertex;
    placed.firstFace = place.firstFace;
    placed.firstEdge = place.firstEdge;
  }
};

}  // namespace btgpu
