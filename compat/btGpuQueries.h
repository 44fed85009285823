// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batched queries of btGpuDynamicsWorld: plain structs in arrays, answered many at once. Lengths are in the
// application's units, positions and normals in world axes. Included by btGpuDynamicsWorld.h.
#ifndef BT_GPU_QUERIES_H
#define BT_GPU_QUERIES_H

#include <btBulletCollisionCommon.h>

/// A ray of btGpuDynamicsWorld::rayTestBatch. One that is not finite, or of no length, hits nothing.
ATTRIBUTE_ALIGNED16(struct)
btGpuRay {
  btVector3 m_from = btVector3(0, 0, 0), m_to = btVector3(0, 0, 0);
  /// As those of btCollisionWorld::RayResultCallback: an object is asked if each group is in the other's mask.
  int m_collisionFilterGroup = btBroadphaseProxy::DefaultFilter;
  int m_collisionFilterMask = btBroadphaseProxy::AllFilter;
  /// btTriangleRaycastCallback::EFlags. Rays with kF_UseGjkConvexCastRaytest are cast on the CPU.
  unsigned int m_flags = 0;
  /// The ray passes through this object as if it were not there: the one that casts it, mostly. Null: through none.
  const btCollisionObject* m_ignoredObject = nullptr;
};

/// The first hit of a ray: what btCollisionWorld::ClosestRayResultCallback would hold after rayTest.
ATTRIBUTE_ALIGNED16(struct)
btGpuRayHit {
  btVector3 m_hitNormalWorld = btVector3(0, 0, 0);  ///< unit; zero if nothing was hit
  const btCollisionObject* m_collisionObject = nullptr;
  btScalar m_closestHitFraction = 1;  ///< of the ray; 1 if nothing was hit
  /// Bullet's LocalShapeInfo: part and triangle of a mesh or plane, or -1 and the child of a compound; -1: none.
  int m_shapePart = -1, m_triangleIndex = -1;

  bool hasHit() const { return m_collisionObject != nullptr; }
  btVector3 hitPoint(const btGpuRay& ray) const { return ray.m_from.lerp(ray.m_to, m_closestHitFraction); }
};

/// A convex shape on its way, of btGpuDynamicsWorld::convexSweepBatch. One that is not finite, or does not move, hits
/// nothing.
ATTRIBUTE_ALIGNED16(struct)
btGpuSweep {
  btTransform m_from = btTransform::getIdentity(), m_to = btTransform::getIdentity();
  const btConvexShape* m_shape = nullptr;  ///< any; null: hits nothing
  int m_collisionFilterGroup = btBroadphaseProxy::DefaultFilter;
  int m_collisionFilterMask = btBroadphaseProxy::AllFilter;
  btScalar m_allowedCcdPenetration = 0;
  const btCollisionObject* m_ignoredObject = nullptr;  ///< as btGpuRay::m_ignoredObject
};

/// What btCollisionWorld::ClosestConvexResultCallback would hold after convexSweepTest.
ATTRIBUTE_ALIGNED16(struct)
btGpuSweepHit {
  btVector3 m_hitNormalWorld = btVector3(0, 0, 0), m_hitPointWorld = btVector3(0, 0, 0);
  const btCollisionObject* m_collisionObject = nullptr;
  btScalar m_closestHitFraction = 1;

  bool hasHit() const { return m_collisionObject != nullptr; }
};

/// Two objects, or an object and a ball, of btGpuDynamicsWorld::closestPointsBatch.
ATTRIBUTE_ALIGNED16(struct)
btGpuClosestQuery {
  btVector3 m_point = btVector3(0, 0, 0);
  const btCollisionObject *m_objectA = nullptr, *m_objectB = nullptr;
  btScalar m_radius = 0;  ///< where m_objectB is null: B is a ball of this radius, >= 0, around m_point
  btScalar m_maxDistance = BT_LARGE_FLOAT;  ///< what is farther apart is not found
};

/// The points of two surfaces that are closest, or by which they leave each other. Found is nothing of what is farther
/// apart than asked for, not finite, or the same object; then the distance is BT_LARGE_FLOAT.
ATTRIBUTE_ALIGNED16(struct)
btGpuClosestPoints {
  btVector3 m_pointOnA = btVector3(0, 0, 0), m_pointOnB = btVector3(0, 0, 0);
  btVector3 m_normalOnB = btVector3(0, 0, 0);  ///< unit, from B to A, as in a btManifoldPoint
  btScalar m_distance = BT_LARGE_FLOAT;        ///< negative: how deep one is inside the other
  bool m_found = false;
};

#endif  // BT_GPU_QUERIES_H
