// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "world_loops.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <algorithm>
#include <cstring>

#include "../gpu_engine/zone.h"
#include "exact_type.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kGrain = 1024;

template <typename Work>
void forEach(const BodyArray& bodies, const Work& work) {
  parallelFor(static_cast<std::size_t>(bodies.size()), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) work(*bodies[static_cast<int>(i)]);
  });
}

// Zeros with a positive sign, the fourth number included.
bool isPlainZero(const btVector3& v) {
  static const btVector3 zero(0, 0, 0);
  return std::memcmp(&v, &zero, sizeof v) == 0;
}

// Shapes whose getAabb only reads. A shape of the application's own may do anything.
bool isBulletsOwn(const btCollisionShape& shape) {
  return isExactly<btBoxShape, btSphereShape, btStaticPlaneShape, btCapsuleShape, btCapsuleShapeX, btCapsuleShapeZ,
                   btConvexHullShape, btCompoundShape, btCylinderShape, btCylinderShapeX, btCylinderShapeZ, btConeShape,
                   btMultiSphereShape, btBvhTriangleMeshShape, btHeightfieldTerrainShape>(shape);
}

}  // namespace

void applyGravityTo(const BodyArray& bodies) {
  forEach(bodies, [](btRigidBody& body) {
    if (body.isActive()) body.applyGravity();
  });
}

void clearForcesOf(const BodyArray& bodies) {
  forEach(bodies, [](btRigidBody& body) {
    // Of bodies at rest it is so already; what is not written need not go back to memory.
    const bool clear = isPlainZero(body.getTotalForce()) && isPlainZero(body.getTotalTorque());
    if (!clear) body.clearForces();
  });
}

void predictTransforms(const BodyArray& bodies, btScalar timeStep) {
  forEach(bodies, [timeStep](btRigidBody& body) {
    if (!body.isStaticOrKinematicObject()) {
      body.predictIntegratedTransform(timeStep, body.getInterpolationWorldTransform());
    }
  });
}

std::vector<int> awakeKinematicBodies(const btCollisionObjectArray& objects) {
  const auto count = static_cast<std::size_t>(objects.size());
  std::vector<std::vector<int>> found(chunkCount(count, kGrain));
  parallelChunks(count, kGrain, [&](std::size_t chunk, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const btRigidBody* body = btRigidBody::upcast(objects[static_cast<int>(i)]);
      if (body && body->getActivationState() != ISLAND_SLEEPING && body->isKinematicObject()) {
        found[chunk].push_back(static_cast<int>(i));
      }
    }
  });
  std::vector<int> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  return all;
}

void MotionStateWriter::write(btDiscreteDynamicsWorld& world, const BodyArray& bodies) {
  const auto count = static_cast<std::size_t>(bodies.size());
  m_isOthers.resize(count);
  m_anyOthers.assign(chunkCount(count, kGrain), 0);
  parallelChunks(count, kGrain, [&](std::size_t chunk, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      btRigidBody& body = *bodies[static_cast<int>(i)];
      const btMotionState* state = body.isActive() ? body.getMotionState() : nullptr;
      m_isOthers[i] = state && !isExactly<btDefaultMotionState>(*state);
      if (m_isOthers[i]) m_anyOthers[chunk] = 1;
      if (state && !m_isOthers[i]) world.synchronizeSingleMotionState(&body);
    }
  });
  if (std::find(m_anyOthers.begin(), m_anyOthers.end(), 1) == m_anyOthers.end()) return;
  m_bodies.clear();
  for (std::size_t i = 0; i < count; ++i) m_bodies.push_back(bodies[static_cast<int>(i)]);
  for (int i = 0; i < bodies.size(); ++i) {
    const auto position = static_cast<std::size_t>(i);
    const bool known = position < count && bodies[i] == m_bodies[position];
    if ((!known || m_isOthers[position]) && bodies[i]->isActive()) world.synchronizeSingleMotionState(bodies[i]);
  }
}

AabbUpdater::How AabbUpdater::boundsOf(const btCollisionWorld& world, btCollisionObject& object, Bounds& b) {
  b.proxy = nullptr;
  if (!world.getForceUpdateAllAabbs() && !object.isActive()) return How::Skip;
  const btCollisionShape& shape = *object.getCollisionShape();
  if (!isBulletsOwn(shape)) return How::AskStock;
  const btVector3 threshold(gContactBreakingThreshold, gContactBreakingThreshold, gContactBreakingThreshold);
  shape.getAabb(object.getWorldTransform(), b.lower, b.upper);
  b.lower -= threshold;
  b.upper += threshold;
  if (world.getDispatchInfo().m_useContinuous && object.getInternalType() == btCollisionObject::CO_RIGID_BODY &&
      !object.isStaticOrKinematicObject()) {
    btVector3 lower, upper;
    shape.getAabb(object.getInterpolationWorldTransform(), lower, upper);
    b.lower.setMin(lower - threshold);
    b.upper.setMax(upper + threshold);
  }
  // What is too large stock takes out of the world, and says so.
  if (!object.isStaticObject() && !((b.upper - b.lower).length2() < btScalar(1e12))) return How::AskStock;
  b.proxy = object.getBroadphaseHandle();
  return How::Set;
}

void AabbUpdater::update(btDiscreteDynamicsWorld& world) {
  const Zone zone("updateAabbs");
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  const auto count = static_cast<std::size_t>(objects.size());
  m_bounds.resize(count);
  m_hows.resize(count);
  parallelFor(count, kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      m_hows[i] = boundsOf(world, *objects[static_cast<int>(i)], m_bounds[i]);
    }
  });
  btDbvtBroadphase* dbvt = DbvtUpdater::updatable(world);
  if (dbvt) m_dbvt.update(*dbvt, m_bounds, world.getDispatcher());
  for (std::size_t i = 0; i < count; ++i) {
    if (m_hows[i] == How::AskStock) {
      world.updateSingleAabb(objects[static_cast<int>(i)]);
    } else if (m_hows[i] == How::Set && !dbvt) {
      world.getBroadphase()->setAabb(m_bounds[i].proxy, m_bounds[i].lower, m_bounds[i].upper, world.getDispatcher());
    }
  }
}

BTGPU_TRANSLATION_END
