// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet's loops over all bodies of a world, on several threads. Each does what its namesake in btDiscreteDynamicsWorld
// or btCollisionWorld does, in the same order where order can be seen.
#pragma once

#include <vector>

#include "bullet.h"
#include "dbvt_updater.h"

BTGPU_TRANSLATION_BEGIN

using BodyArray = btAlignedObjectArray<btRigidBody*>;

void applyGravityTo(const BodyArray& bodies);
void clearForcesOf(const BodyArray& bodies);

// Positions in `objects` of the kinematic bodies that are awake, ascending: those whose velocity is to be computed.
std::vector<int> awakeKinematicBodies(const btCollisionObjectArray& objects);

// predictIntegratedTransform of every body that moves, into its interpolation transform.
void predictTransforms(const BodyArray& bodies, btScalar timeStep);

// btDiscreteDynamicsWorld::synchronizeMotionStates, of the active bodies. Motion states that are exactly
// btDefaultMotionState are written on several threads, one each; then all others are called, in the order of the
// bodies, on the calling thread.
class MotionStateWriter {
 public:
  // `bodies`: the world's own list; the application may change it while it is called.
  void write(btDiscreteDynamicsWorld& world, const BodyArray& bodies);

 private:
  std::vector<unsigned char> m_isOthers;   // by position: the motion state is not Bullet's own
  std::vector<btRigidBody*> m_bodies;      // the list as it was before the first call
  std::vector<unsigned char> m_anyOthers;  // by chunk
};

// btCollisionWorld::updateAabbs. The AABBs are computed on several threads; Bullet's own broadphase takes them all at
// once (DbvtUpdater), others one by one.
class AabbUpdater {
 public:
  void update(btDiscreteDynamicsWorld& world);

 private:
  enum class How : unsigned char { Skip, Set, AskStock };
  using Bounds = DbvtUpdater::Bounds;
  static How boundsOf(const btCollisionWorld& world, btCollisionObject& object, Bounds& bounds);
  std::vector<Bounds> m_bounds;  // by object; the proxy is null where stock is asked
  std::vector<How> m_hows;
  DbvtUpdater m_dbvt;
};

BTGPU_TRANSLATION_END
