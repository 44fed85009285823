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

#endif  // BT_GPU_QUERIES_H
