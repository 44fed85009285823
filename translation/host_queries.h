// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batched queries by Bullet's own tests, on several threads where all that they meet bears it.
#pragma once

#include "../gpu_engine/query_world.h"
#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

// A ray for Bullet, and its first hit.
struct HostRay {
  btVector3 from, to;
  int filterGroup, filterMask;
  unsigned int flags;
  const btCollisionObject* ignored;
};
struct HostRayHit {
  const btCollisionObject* object = nullptr;
  btVector3 normal = btVector3(0, 0, 0);
  btScalar fraction = 1;
  int part = -1, triangle = -1;
};

// False if some object's shape keeps state while it is asked (GImpact's meshes), or is the application's own.
bool bearsThreads(const btCollisionObjectArray& objects);

// One ray through the whole world: btCollisionWorld::rayTest. Several may be cast at once if the broadphase is a
// btDbvtBroadphase.
HostRayHit castThroughWorld(const btDiscreteDynamicsWorld& world, const HostRay& ray);
bool canCastAtOnce(const btDiscreteDynamicsWorld& world);

// Tries some more objects: `enters` says where the ray enters the bounds of each. `hit`: the best so far.
void castAgainst(const btCollisionObjectArray& objects, const std::uint32_t* positions, const float* enters,
                 std::size_t count, const HostRay& ray, HostRayHit& hit);

// A sweep for Bullet, and its first hit.
struct HostSweep {
  const btConvexShape* shape;
  btTransform from, to;
  int filterGroup, filterMask;
  btScalar allowedPenetration;
  const btCollisionObject* ignored;
};
struct HostSweepHit {
  const btCollisionObject* object = nullptr;
  btVector3 normal = btVector3(0, 0, 0), point = btVector3(0, 0, 0);
  btScalar fraction = 1;
};
// btCollisionWorld::convexSweepTest; at once as castThroughWorld, if the shapes that move bear it, too.
HostSweepHit sweepThroughWorld(const btDiscreteDynamicsWorld& world, const HostSweep& sweep);
bool bearsThreads(const btCollisionShape& shape);

// The bounds of the shape that moves, turning included, around its position.
void boundsOfSweep(const HostSweep& sweep, btVector3& lower, btVector3& upper);

// As castAgainst.
void sweepAgainst(const btCollisionObjectArray& objects, const std::uint32_t* positions, const float* enters,
                  std::size_t count, const HostSweep& sweep, HostSweepHit& hit);

// What the device's kernel does, on several threads.
void closestOnHost(const QueryWorld& world, const std::vector<ClosestQuery>& queries,
                   std::vector<ClosestAnswer>& answers);

// The closest points of two objects, by contactPairTest. One after the other: the world's dispatcher takes part.
struct HostClosest {
  bool found = false;
  btVector3 onA, onB, normalOnB;
  btScalar distance;
};
HostClosest closestByContactTest(btDiscreteDynamicsWorld& world, const btCollisionObject& a, const btCollisionObject& b,
                                 btScalar limit);

BTGPU_TRANSLATION_END
