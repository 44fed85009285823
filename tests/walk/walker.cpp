// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "walker.h"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>

#include <numeric>
#include <utility>

namespace btgpu::test {

Walker* Walker::current = nullptr;

namespace {

std::unique_ptr<btBroadphaseInterface> makeBroadphase(Walker::Broadphase kind) {
  if (kind == Walker::Broadphase::Dbvt) return std::make_unique<btDbvtBroadphase>();
  return std::make_unique<btAxisSweep3>(btVector3(-500, -500, -500), btVector3(500, 500, 500), 1000);
}

}  // namespace

Walker::Walker(const btGpuSettings* gpu, Broadphase broadphase)
    : m_dispatcher(&m_configuration), m_broadphase(makeBroadphase(broadphase)) {
  if (gpu) {
    m_settings = *gpu;
    auto world =
        std::make_unique<btGpuDynamicsWorld>(&m_dispatcher, m_broadphase.get(), &m_solver, &m_configuration, *gpu);
    m_gpu = world.get();
    m_world = std::move(world);
  } else {
    m_world = std::make_unique<btDiscreteDynamicsWorld>(&m_dispatcher, m_broadphase.get(), &m_solver, &m_configuration);
  }
  m_world->setGravity(btVector3(0, -10, 0));
  m_world->setWorldUserInfo(this);
  m_broadphase->getOverlappingPairCache()->setInternalGhostPairCallback(&m_ghostPairs);
  m_jointOwner = std::make_unique<scenes::Objects>(*m_world);
}

Walker::~Walker() {
  current = this;
  for (auto& action : m_actions) m_world->removeAction(action.get());
  while (!m_objects.empty()) destroy(m_objects.rbegin()->first);
  m_jointOwner.reset();
  m_world.reset();
  current = nullptr;
}

void Walker::configure(const btGpuSettings& settings) {
  m_settings = settings;
  if (m_gpu) btGpuDynamicsWorld::configure(m_gpu, settings);
}

std::string Walker::apply(const Operation& operation) {
  current = this;
  const OperationKind& kind = operationKinds()[static_cast<std::size_t>(operation.kind)];
  RandomSource random(operation.seed);
  m_stepsLater = false;
  const std::string text = kind.apply(*this, random);
  if (!m_stepsLater) step(1.0 / 60);
  current = nullptr;
  return std::string(kind.name) + " " + text;
}

void Walker::step(double time, int maxSubSteps, double fixedTimeStep) {
  // Callbacks that stay when nobody needs them would keep the device from going ahead of the host.
  m_world->setInternalTickCallback(beforeStep ? preTick : nullptr, this, true);
  m_world->setInternalTickCallback(afterStep ? tick : nullptr, this, false);
  m_world->stepSimulation(static_cast<btScalar>(time), maxSubSteps, static_cast<btScalar>(fixedTimeStep));
}

void Walker::preTick(btDynamicsWorld* world, btScalar) {
  auto& walker = *static_cast<Walker*>(world->getWorldUserInfo());
  ++walker.m_calls.ticks;
  const auto call = std::exchange(walker.beforeStep, nullptr);
  if (call) call(walker);
}

void Walker::tick(btDynamicsWorld* world, btScalar) {
  auto& walker = *static_cast<Walker*>(world->getWorldUserInfo());
  ++walker.m_calls.ticks;
  const auto call = std::exchange(walker.afterStep, nullptr);
  if (call) call(walker);
}

WalkObject& Walker::makeObject(WalkKind kind, std::shared_ptr<WalkShape> shape, const btTransform& at, btScalar mass) {
  const int id = m_nextId++;
  WalkObject& made = m_objects[id];
  made.id = id;
  made.kind = kind;
  made.shape = std::move(shape);
  if (kind == WalkKind::Ghost) {
    made.object = std::make_unique<btPairCachingGhostObject>();
    made.object->setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
  } else if (kind == WalkKind::Plain) {
    made.object = std::make_unique<btCollisionObject>();
  } else {
    btVector3 inertia(0, 0, 0);
    if (kind == WalkKind::Dynamic) inertia = inertiaOf(*made.shape->shape, mass);
    made.motionState = id % 3 == 0 ? nullptr : std::make_unique<WalkMotionState>();
    if (made.motionState) made.motionState->transform = at;
    btRigidBody::btRigidBodyConstructionInfo info(kind == WalkKind::Dynamic ? mass : btScalar(0),
                                                  made.motionState.get(), made.shape->shape, inertia);
    made.object = std::make_unique<btRigidBody>(info);
    if (kind == WalkKind::Kinematic) {
      made.object->setCollisionFlags(made.object->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
      made.object->setActivationState(DISABLE_DEACTIVATION);
    }
  }
  made.object->setCollisionShape(made.shape->shape);
  made.object->setWorldTransform(at);
  made.object->setInterpolationWorldTransform(at);
  made.object->setUserIndex(id);
  made.object->setUserPointer(this);
  const bool fixed = kind == WalkKind::Static || kind == WalkKind::Kinematic || kind == WalkKind::Plain;
  made.group = fixed ? btBroadphaseProxy::StaticFilter : btBroadphaseProxy::DefaultFilter;
  made.mask = fixed ? btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter : btBroadphaseProxy::AllFilter;
  return made;
}

void Walker::add(WalkObject& object) {
  if (object.body()) {
    m_world->addRigidBody(object.body(), object.group, object.mask);
  } else {
    m_world->addCollisionObject(object.object.get(), object.group, object.mask);
  }
  object.inWorld = true;
}

void Walker::remove(WalkObject& object) {
  std::vector<int> linked;
  for (const auto& [id, joint] : m_joints) {
    if (joint.a == object.id || joint.b == object.id) linked.push_back(id);
  }
  for (const int id : linked) removeJoint(id);
  if (!object.inWorld) return;
  object.inWorld = false;
  if (object.body()) {
    m_world->removeRigidBody(object.body());
  } else {
    m_world->removeCollisionObject(object.object.get());
  }
}

void Walker::destroy(int id) {
  remove(m_objects.at(id));
  m_objects.erase(id);
}

WalkJoint& Walker::takeJoint(btTypedConstraint* joint, int a, int b) {
  const int id = m_nextId++;
  joint->setUserConstraintId(id);
  WalkJoint& made = m_joints[id];
  made.id = id;
  made.a = a;
  made.b = b;
  made.inWorld = true;
  made.joint = joint;
  return made;
}

void Walker::removeJoint(int id) {
  m_jointOwner->remove(m_joints.at(id).joint);  // in the world or not
  m_joints.erase(id);
}

std::vector<Operation> makeWalk(std::uint32_t seed, int count) {
  const auto& kinds = operationKinds();
  std::vector<int> weights;
  for (const OperationKind& kind : kinds) weights.push_back(kind.weight);
  const int all = std::accumulate(weights.begin(), weights.end(), 0);
  RandomSource random(seed);
  std::vector<Operation> walk;
  for (int i = 0; i < count; ++i) {
    int which = 0;
    if (i >= 8) {
      for (int left = static_cast<int>(random() % static_cast<unsigned>(all));
           left >= weights[static_cast<std::size_t>(which)]; ++which) {
        left -= weights[static_cast<std::size_t>(which)];
      }
    }
    walk.push_back({which, static_cast<std::uint32_t>(random()), i});
  }
  return walk;
}

}  // namespace btgpu::test
