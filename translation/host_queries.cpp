// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "host_queries.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <LinearMath/btTransformUtil.h>

#include "../kernels/lib/closest_points.h"
#include "exact_type.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

// As btCollisionWorld::ClosestRayResultCallback, with what that drops.
struct BestHit : btCollisionWorld::RayResultCallback {
  BestHit(const HostRay& ray, const HostRayHit& known) : hit(known), ignored(ray.ignored) {
    m_collisionFilterGroup = ray.filterGroup;
    m_collisionFilterMask = ray.filterMask;
    m_flags = ray.flags;
    m_closestHitFraction = known.fraction;
  }
  bool needsCollision(btBroadphaseProxy* proxy) const override {
    return proxy->m_clientObject != ignored && RayResultCallback::needsCollision(proxy);
  }
  btScalar addSingleResult(btCollisionWorld::LocalRayResult& result, bool normalInWorldSpace) override {
    m_closestHitFraction = result.m_hitFraction;
    m_collisionObject = result.m_collisionObject;
    hit.object = result.m_collisionObject;
    hit.fraction = result.m_hitFraction;
    hit.normal = normalInWorldSpace
                     ? result.m_hitNormalLocal
                     : result.m_collisionObject->getWorldTransform().getBasis() * result.m_hitNormalLocal;
    hit.part = result.m_localShapeInfo ? result.m_localShapeInfo->m_shapePart : -1;
    hit.triangle = result.m_localShapeInfo ? result.m_localShapeInfo->m_triangleIndex : -1;
    return result.m_hitFraction;
  }
  HostRayHit hit;
  const btCollisionObject* ignored;
};

btTransform at(const btVector3& position) { return btTransform(btQuaternion::getIdentity(), position); }

// What btCollisionWorld::rayTest asks of each leaf of the tree that the ray meets.
struct AskLeaf : btDbvt::ICollide {
  AskLeaf(const HostRay& ray, BestHit& best) : from(at(ray.from)), to(at(ray.to)), result(best) {}
  void Process(const btDbvtNode* leaf) override {
    auto* proxy = static_cast<btBroadphaseProxy*>(leaf->data);
    auto* object = static_cast<btCollisionObject*>(proxy->m_clientObject);
    if (result.m_closestHitFraction == btScalar(0) || !result.needsCollision(proxy)) return;
    btCollisionWorld::rayTestSingle(from, to, object, object->getCollisionShape(), object->getWorldTransform(), result);
  }
  btTransform from, to;
  BestHit& result;
};

// The trees' own rayTest keeps its stack in the broadphase, one for all threads. `lower`, `upper`: of what moves along
// the ray.
void visitTrees(btDbvtBroadphase& broadphase, const btVector3& from, const btVector3& to, const btVector3& lower,
                const btVector3& upper, btDbvt::ICollide& visitor) {
  const btVector3 direction = (to - from).normalized();
  btVector3 inverse;
  unsigned int signs[3];
  for (int k = 0; k < 3; ++k) {
    inverse[k] = direction[k] == btScalar(0) ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[k];
    signs[k] = inverse[k] < btScalar(0);
  }
  const btScalar length = direction.dot(to - from);
  thread_local btAlignedObjectArray<const btDbvtNode*> stack;
  for (btDbvt& tree : broadphase.m_sets) {
    tree.rayTestInternal(tree.m_root, from, to, inverse, signs, length, lower, upper, stack, visitor);
  }
}

struct BestSweep : btCollisionWorld::ClosestConvexResultCallback {
  explicit BestSweep(const HostSweep& sweep)
      : ClosestConvexResultCallback(sweep.from.getOrigin(), sweep.to.getOrigin()), ignored(sweep.ignored) {
    m_collisionFilterGroup = sweep.filterGroup;
    m_collisionFilterMask = sweep.filterMask;
  }
  bool needsCollision(btBroadphaseProxy* proxy) const override {
    return proxy->m_clientObject != ignored && ConvexResultCallback::needsCollision(proxy);
  }
  const btCollisionObject* ignored;
};

HostSweepHit hitOf(const BestSweep& best) {
  if (!best.hasHit()) return {};
  return {best.m_hitCollisionObject, best.m_hitNormalWorld, best.m_hitPointWorld, best.m_closestHitFraction};
}

// What btCollisionWorld::convexSweepTest asks of each leaf.
struct SweepLeaf : btDbvt::ICollide {
  SweepLeaf(const HostSweep& s, BestSweep& best) : sweep(s), result(best) {}
  void Process(const btDbvtNode* leaf) override {
    auto* proxy = static_cast<btBroadphaseProxy*>(leaf->data);
    auto* object = static_cast<btCollisionObject*>(proxy->m_clientObject);
    if (result.m_closestHitFraction == btScalar(0) || !result.needsCollision(proxy)) return;
    btCollisionWorld::objectQuerySingle(sweep.shape, sweep.from, sweep.to, object, object->getCollisionShape(),
                                        object->getWorldTransform(), result, sweep.allowedPenetration);
  }
  const HostSweep& sweep;
  BestSweep& result;
};

struct DeepestContact : btCollisionWorld::ContactResultCallback {
  explicit DeepestContact(const btCollisionObject& objectA, btScalar limit) : a(objectA) {
    closest.distance = limit;
    m_closestDistanceThreshold = limit;
  }
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* first, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    if (point.getDistance() > closest.distance) return 0;
    const bool swapped = first->getCollisionObject() != &a;
    closest.found = true;
    closest.distance = point.getDistance();
    closest.onA = swapped ? point.getPositionWorldOnB() : point.getPositionWorldOnA();
    closest.onB = swapped ? point.getPositionWorldOnA() : point.getPositionWorldOnB();
    closest.normalOnB = swapped ? -point.m_normalWorldOnB : point.m_normalWorldOnB;
    return 0;
  }
  const btCollisionObject& a;
  HostClosest closest;
};

}  // namespace

bool bearsThreads(const btCollisionShape& shape) {
  if (isExactly<btCompoundShape>(shape)) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      if (!bearsThreads(*compound.getChildShape(i))) return false;
    }
    return true;
  }
  if (isExactly<btBvhTriangleMeshShape>(shape)) {
    const auto* mesh = static_cast<const btBvhTriangleMeshShape&>(shape).getMeshInterface();
    return isExactly<btTriangleMesh, btTriangleIndexVertexArray>(*mesh);
  }
  return isExactly<btSphereShape, btBoxShape, btStaticPlaneShape, btCapsuleShape, btCapsuleShapeX, btCapsuleShapeZ,
                   btCylinderShape, btCylinderShapeX, btCylinderShapeZ, btConeShape, btConeShapeX, btConeShapeZ,
                   btConvexHullShape, btMultiSphereShape, btTriangleShape, btEmptyShape, btHeightfieldTerrainShape>(
      shape);
}

bool bearsThreads(const btCollisionObjectArray& objects) {
  const btCollisionShape* last = nullptr;
  for (int i = 0; i < objects.size(); ++i) {
    const btCollisionShape* shape = objects[i]->getCollisionShape();
    if (!shape || shape == last) continue;
    if (!bearsThreads(*shape)) return false;
    last = shape;
  }
  return true;
}

bool canCastAtOnce(const btDiscreteDynamicsWorld& world) {
  return isExactly<btDbvtBroadphase>(*world.getBroadphase()) && bearsThreads(world.getCollisionObjectArray());
}

HostRayHit castThroughWorld(const btDiscreteDynamicsWorld& world, const HostRay& ray) {
  BestHit best(ray, HostRayHit());
  // Bullet's interface is not const where nothing changes.
  auto* broadphase = const_cast<btBroadphaseInterface*>(world.getBroadphase());
  if (isExactly<btDbvtBroadphase>(*broadphase)) {
    const btVector3 point(0, 0, 0);
    AskLeaf ask(ray, best);
    visitTrees(static_cast<btDbvtBroadphase&>(*broadphase), ray.from, ray.to, point, point, ask);
  } else {
    world.rayTest(ray.from, ray.to, best);
  }
  return best.hit;
}

void castAgainst(const btCollisionObjectArray& objects, const std::uint32_t* positions, const float* enters,
                 std::size_t count, const HostRay& ray, HostRayHit& hit) {
  BestHit best(ray, hit);
  for (std::size_t i = 0; i < count; ++i) {
    if (btScalar(enters[i]) > best.m_closestHitFraction) continue;
    btCollisionObject* object = objects[static_cast<int>(positions[i])];
    btCollisionWorld::rayTestSingle(at(ray.from), at(ray.to), object, object->getCollisionShape(),
                                    object->getWorldTransform(), best);
  }
  hit = best.hit;
}

void boundsOfSweep(const HostSweep& sweep, btVector3& lower, btVector3& upper) {
  btVector3 linear, angular;
  btTransformUtil::calculateVelocity(sweep.from, sweep.to, btScalar(1), linear, angular);
  btTransform turned = btTransform::getIdentity();
  turned.setRotation(sweep.from.getRotation());
  sweep.shape->calculateTemporalAabb(turned, btVector3(0, 0, 0), angular, btScalar(1), lower, upper);
}

HostSweepHit sweepThroughWorld(const btDiscreteDynamicsWorld& world, const HostSweep& sweep) {
  BestSweep best(sweep);
  auto* broadphase = const_cast<btBroadphaseInterface*>(world.getBroadphase());
  if (isExactly<btDbvtBroadphase>(*broadphase)) {
    btVector3 lower, upper;
    boundsOfSweep(sweep, lower, upper);
    SweepLeaf ask(sweep, best);
    visitTrees(static_cast<btDbvtBroadphase&>(*broadphase), sweep.from.getOrigin(), sweep.to.getOrigin(), lower, upper,
               ask);
  } else {
    world.convexSweepTest(sweep.shape, sweep.from, sweep.to, best, sweep.allowedPenetration);
  }
  return hitOf(best);
}

void sweepAgainst(const btCollisionObjectArray& objects, const std::uint32_t* positions, const float* enters,
                  std::size_t count, const HostSweep& sweep, HostSweepHit& hit) {
  BestSweep best(sweep);
  best.m_hitCollisionObject = hit.object;
  best.m_hitNormalWorld = hit.normal;
  best.m_hitPointWorld = hit.point;
  best.m_closestHitFraction = hit.fraction;
  for (std::size_t i = 0; i < count; ++i) {
    if (btScalar(enters[i]) > best.m_closestHitFraction) continue;
    btCollisionObject* object = objects[static_cast<int>(positions[i])];
    btCollisionWorld::objectQuerySingle(sweep.shape, sweep.from, sweep.to, object, object->getCollisionShape(),
                                        object->getWorldTransform(), best, sweep.allowedPenetration);
  }
  hit = hitOf(best);
}

void closestOnHost(const QueryWorld& world, const std::vector<ClosestQuery>& queries,
                   std::vector<ClosestAnswer>& answers) {
  constexpr std::size_t kGrain = 64;
  answers.resize(queries.size());
  const HullArrays& h = world.shapes.hulls;
  const Hulls hulls{h.vertices.data(), h.faces.data(), h.corners.data(), h.edges.data()};
  parallelFor(queries.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      answers[i] = closestPointsOf(queries[i], world.shapes.shapes.values.data(), hulls);
    }
  });
}

HostClosest closestByContactTest(btDiscreteDynamicsWorld& world, const btCollisionObject& a, const btCollisionObject& b,
                                 btScalar limit) {
  DeepestContact deepest(a, limit);
  world.contactPairTest(const_cast<btCollisionObject*>(&a), const_cast<btCollisionObject*>(&b), deepest);
  return deepest.closest;
}

BTGPU_TRANSLATION_END
