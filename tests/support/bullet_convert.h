// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Our records as Bullet's types, for tests that compare a reference with Bullet itself.
#pragma once

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <memory>

#include "kernels/shared/body.h"
#include "kernels/shared/shape.h"

namespace btgpu {

inline btVector3 toBullet(float4 v) { return {v.x, v.y, v.z}; }

inline btTransform toBullet(const BodyPose& p) {
  const float4 q = p.orientation;
  return btTransform({q.x, q.y, q.z, q.w}, toBullet(p.position));
}

// With Bullet's own margin: see Shape::margin.
inline std::unique_ptr<btCollisionShape> bulletShapeOf(const Shape& s) {
  if (s.type == SHAPE_SPHERE) return std::make_unique<btSphereShape>(s.extents.x);
  if (s.type == SHAPE_BOX) return std::make_unique<btBoxShape>(toBullet(s.extents));
  return std::make_unique<btStaticPlaneShape>(toBullet(s.extents), s.extents.w);
}

}  // namespace btgpu
