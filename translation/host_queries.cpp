// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "host_queries.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include "exact_type.h"

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

// The tree's own rayTest keeps its stack in the broadphase, one for all threads.
void castThroughTrees(btDbvtBroadphase& broadphase, const HostRay& ray, BestHit& best) {
  const btVector3 direction = (ray.to - ray.from).normalized();
  btVector3 inverse;
  unsigned int signs[3];
  for (int k = 0; k < 3; ++k) {
    inverse[k] = direction[k] == btScalar(0) ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[k];
    signs[k] = inverse[k] < btScalar(0);
  }
  const btScalar length = direction.dot(ray.to - ray.from);
  const btVector3 point(0, 0, 0);
  AskLeaf ask(ray, best);
  thread_local btAlignedObjectArray<const btDbvtNode*> stack;
  for (btDbvt& tree : broadphase.m_sets) {
    tree.rayTestInternal(tree.m_root, ray.from, ray.to, inverse, signs, length, point, point, stack, ask);
  }
}

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

}  // namespace

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
    castThroughTrees(static_cast<btDbvtBroadphase&>(*broadphase), ray, best);
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

BTGPU_TRANSLATION_END
