// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet's loops over all bodies of a world, on several threads. Each does what its namesake in btDiscreteDynamicsWorld
// or btCollisionWorld does, in the same order where order can be seen.
#pragma once

#include <vector>

#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

using BodyArray = btAlignedObjectArray<btRigidBody*>;

void applyGravityTo(const BodyArray& bodies);
void clearForcesOf(const BodyArray& bodies);

// Positions in `objects` of the kinematic bodies that are awake, ascending: those whose velocity is to be computed.
std::vector<int> awakeKinematicBodies(const btCollisionObjectArray& objects);

// predictIntegratedTransform of every body that moves, into its interpolation transform.
void predictTransforms(const BodyArray& bodies, btScalar timeStep);

// btCollisionWorld::updateAabbs. The AABBs are computed on several threads; the broadphase takes them one by one.
class AabbUpdater {
 public:
  void update(btCollisionWorld& world);

 private:
  struct Bounds {
    btVector3 lower, upper;
    enum { Skip, Set, AskStock } what;
  };
  static Bounds boundsOf(const btCollisionWorld& world, btCollisionObject& object);
  std::vector<Bounds> m_bounds;
};

BTGPU_TRANSLATION_END
