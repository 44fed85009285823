// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>

#include "parts.h"
#include "scene.h"

namespace scenes {

namespace {

// For each body that leaves Bullet goes through all pairs, and through its list of bodies up to that body: a world of
// many is emptied in an order that spares it that.
void emptyLargeWorld(btDiscreteDynamicsWorld& world) {
  constexpr int kLarge = 20000;  // bodies: below, the order that they were added in does
  if (world.getNumCollisionObjects() < kLarge) return;
  btOverlappingPairCache& cache = *world.getPairCache();
  btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
  while (pairs.size() > 0) {
    const btBroadphasePair last = pairs[pairs.size() - 1];
    cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, world.getDispatcher());
  }
  while (world.getNonStaticRigidBodies().size() > 0) world.removeRigidBody(world.getNonStaticRigidBodies()[0]);
}

}  // namespace

struct Objects::Character {
  btPairCachingGhostObject ghost;
  std::unique_ptr<btKinematicCharacterController> controller;
};

Objects::Objects(btDiscreteDynamicsWorld& world) : m_world(world) {}

Objects::~Objects() {
  if (!m_beforeSubsteps.empty()) m_world.setInternalTickCallback(nullptr, nullptr, true);
  for (const auto& character : m_characters) {
    m_world.removeCharacter(character->controller.get());
    m_world.removeCollisionObject(&character->ghost);
  }
  for (const auto& vehicle : m_vehicles) m_world.removeVehicle(vehicle.get());
  for (const auto& joint : m_joints) m_world.removeConstraint(joint.get());
  if (m_world.getNumCollisionObjects() == static_cast<int>(m_bodies.size())) emptyLargeWorld(m_world);
  for (btRigidBody* body : m_bodies) {
    if (body->getWorldArrayIndex() >= 0) m_world.removeRigidBody(body);
    delete body;
  }
  if (m_ghostPairs) m_world.getPairCache()->setInternalGhostPairCallback(nullptr);
}

btBoxShape* Objects::box(const btVector3& halfExtents) { return shape<btBoxShape>(halfExtents); }

btSphereShape* Objects::sphere(btScalar radius) { return shape<btSphereShape>(radius); }

btStaticPlaneShape* Objects::plane(const btVector3& normal, btScalar constant) {
  return shape<btStaticPlaneShape>(normal, constant);
}

btCapsuleShape* Objects::capsule(btScalar radius, btScalar height) { return shape<btCapsuleShape>(radius, height); }

btConvexHullShape* Objects::hull(const std::vector<btVector3>& points) {
  auto* hull = shape<btConvexHullShape>();
  for (const btVector3& p : points) hull->addPoint(p, false);
  hull->recalcLocalAabb();
  return hull;
}

btRigidBody* Objects::add(btScalar mass, btCollisionShape* shape, const btTransform& at) {
  btVector3 inertia(0, 0, 0);
  if (mass != btScalar(0)) shape->calculateLocalInertia(mass, inertia);
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
  info.m_startWorldTransform = at;
  return addToWorld(new btRigidBody(info));
}

btRigidBody* Objects::addToWorld(btRigidBody* body) {
  m_bodies.push_back(body);
  m_world.addRigidBody(body);
  return body;
}

btRigidBody* Objects::add(btScalar mass, btCollisionShape* shape, const btVector3& at) {
  return add(mass, shape, btTransform(btQuaternion::getIdentity(), at));
}

btRigidBody* Objects::addKinematic(btCollisionShape* shape, const btTransform& at) {
  btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shape);
  info.m_startWorldTransform = at;
  auto* body = new btRigidBody(info);
  body->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  body->setActivationState(DISABLE_DEACTIVATION);  // one that sleeps has no velocity
  return addToWorld(body);
}

void Objects::beforeSubsteps(std::function<void(btScalar)> call) {
  m_beforeSubsteps.push_back(std::move(call));
  m_world.setInternalTickCallback(preTick, this, true);
}

void Objects::preTick(btDynamicsWorld* world, btScalar timeStep) {
  for (const auto& call : static_cast<Objects*>(world->getWorldUserInfo())->m_beforeSubsteps) call(timeStep);
}

void Objects::remove(btTypedConstraint* joint) {
  m_world.removeConstraint(joint);
  for (auto& owned : m_joints) {
    if (owned.get() == joint) std::swap(owned, m_joints.back());
  }
  m_joints.pop_back();
}

btRaycastVehicle* Objects::vehicle(btRigidBody* chassis, btScalar halfTrack) {
  btRaycastVehicle::btVehicleTuning tuning;
  m_raycasters.push_back(std::make_unique<btDefaultVehicleRaycaster>(&m_world));
  m_vehicles.push_back(std::make_unique<btRaycastVehicle>(tuning, chassis, m_raycasters.back().get()));
  btRaycastVehicle* vehicle = m_vehicles.back().get();
  m_world.addVehicle(vehicle);
  vehicle->setCoordinateSystem(0, 1, 2);
  for (int i = 0; i < 4; ++i) {
    const btVector3 at(i % 2 ? halfTrack : -halfTrack, s(-0.3), s(i < 2 ? 1.5 : -1.5));
    btWheelInfo& wheel = vehicle->addWheel(at, btVector3(0, -1, 0), btVector3(-1, 0, 0), s(0.6), s(0.5), tuning, i < 2);
    wheel.m_suspensionStiffness = 20;
    wheel.m_wheelsDampingRelaxation = s(2.3);
    wheel.m_wheelsDampingCompression = s(4.4);
    wheel.m_rollInfluence = s(0.1);
  }
  return vehicle;
}

btKinematicCharacterController* Objects::character(btConvexShape* shape, double stepHeight, const btVector3& at) {
  if (!m_ghostPairs) {  // without it ghosts don't know what they overlap
    m_ghostPairs = std::make_unique<btGhostPairCallback>();
    m_world.getPairCache()->setInternalGhostPairCallback(m_ghostPairs.get());
  }
  m_characters.push_back(std::make_unique<Character>());
  Character& made = *m_characters.back();
  made.ghost.setCollisionShape(shape);
  made.ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
  made.ghost.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
  m_world.addCollisionObject(&made.ghost, btBroadphaseProxy::CharacterFilter,
                             btBroadphaseProxy::StaticFilter | btBroadphaseProxy::DefaultFilter);
  made.controller =
      std::make_unique<btKinematicCharacterController>(&made.ghost, shape, s(stepHeight), btVector3(0, 1, 0));
  made.controller->setGravity(m_world.getGravity());
  m_world.addCharacter(made.controller.get());
  return made.controller.get();
}

}  // namespace scenes
