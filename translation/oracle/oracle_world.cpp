// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "oracle_world.h"

#include <algorithm>
#include <cmath>

#include "../../gpu_engine/slots.h"
#include "../contacts.h"
#include "../convert.h"
#include "joint_motors.h"

BTGPU_TRANSLATION_BEGIN

bool OracleDispatcher::needsCollision(const btCollisionObject* a, const btCollisionObject* b) {
  return btCollisionDispatcher::needsCollision(a, b) &&
         !(m_world.m_sweeps ? m_world.passes(*a, *b) : m_world.leavesOut(*a, *b));
}

void TightBroadphase::setAabb(btBroadphaseProxy* proxy, const btVector3& lower, const btVector3& upper,
                              btDispatcher* dispatcher) {
  // What did not move goes to the tree of fixed objects, as in Bullet's own when nobody updates it.
  if (proxy->m_aabbMin == lower && proxy->m_aabbMax == upper) return;
  setAabbForceUpdate(proxy, lower, upper, dispatcher);
}

BodyState captureState(const btCollisionObject& o) {
  BodyState s{o.getWorldTransform(),
              o.getInterpolationWorldTransform(),
              btVector3(0, 0, 0),
              btVector3(0, 0, 0),
              o.getInterpolationLinearVelocity(),
              o.getInterpolationAngularVelocity(),
              o.getActivationState(),
              o.getDeactivationTime()};
  if (const btRigidBody* body = btRigidBody::upcast(&o)) {
    s.linear = body->getLinearVelocity();
    s.angular = body->getAngularVelocity();
  }
  return s;
}

void takeKinematicStates(const btCollisionWorld& world, const WorldInput& input, std::vector<BodyState>& states) {
  for (size_t i = 0; i < states.size(); ++i) {
    if (!world.getCollisionObjectArray()[static_cast<int>(i)]->isKinematicObject()) continue;
    const BodyVelocity& v = input.velocities.values[i];
    BodyState& s = states[i];
    s.transform = s.interpolation = toTransform(input.poses.values[i], input.regionOrigin);
    s.linear = s.interpolationLinear = toBullet(v.linear);
    s.angular = s.interpolationAngular = toBullet(v.angular);
  }
}

// Bullet's joints have no const functions that tell their settings.
static btTypedConstraint* jointOf(const btDynamicsWorld& world, int i) {
  return const_cast<btTypedConstraint*>(world.getConstraint(i));
}

std::vector<JointState> captureJoints(const btDynamicsWorld& world) {
  std::vector<JointState> states;
  for (int i = 0; i < world.getNumConstraints(); ++i) {
    btTypedConstraint* joint = jointOf(world, i);
    if (!joint) continue;  // what the base class answers
    auto* hinge = dynamic_cast<btHingeAccumulatedAngleConstraint*>(joint);
    const btScalar angle = hinge ? hinge->getAccumulatedHingeAngle() : btScalar(0);
    states.push_back({joint->isEnabled(), angle, motorsOf(*joint)});
  }
  return states;
}

void takeMotors(const btDynamicsWorld& world, std::vector<JointState>& states) {
  for (size_t i = 0; i < states.size(); ++i) states[i].motors = motorsOf(*jointOf(world, static_cast<int>(i)));
}

void OracleWorld::setObjects(std::vector<btCollisionObject*> bySlot) {
  m_objects = std::move(bySlot);
  m_slots.assign(static_cast<size_t>(getNumCollisionObjects()), NO_INDEX);
  for (size_t slot = 0; slot < m_objects.size(); ++slot) {
    if (m_objects[slot]) m_slots[static_cast<size_t>(m_objects[slot]->getWorldArrayIndex())] = static_cast<uint>(slot);
  }
}

uint OracleWorld::slotOf(const btCollisionObject& object) const {
  const int position = object.getWorldArrayIndex();
  return position < 0 ? NO_INDEX : m_slots[static_cast<size_t>(position)];
}

std::vector<BodyState> OracleWorld::states() const {
  std::vector<BodyState> states(m_objects.size());
  for (size_t i = 0; i < states.size(); ++i) {
    if (m_objects[i]) states[i] = captureState(*m_objects[i]);
  }
  return states;
}

void OracleWorld::setJoints(const std::vector<JointState>& states) {
  for (int i = 0; i < getNumConstraints(); ++i) {
    const JointState& state = states[static_cast<size_t>(i)];
    getConstraint(i)->setEnabled(state.enabled);
    if (auto* hinge = dynamic_cast<btHingeAccumulatedAngleConstraint*>(getConstraint(i))) {
      hinge->setAccumulatedHingeAngle(state.accumulatedAngle);
    }
    setMotors(*getConstraint(i), state.motors);
  }
}

void OracleWorld::reverseJoints() {
  for (int i = 0; i < m_constraints.size() / 2; ++i) m_constraints.swap(i, m_constraints.size() - 1 - i);
}

void OracleWorld::restore(const std::vector<BodyState>& states) {
  for (size_t i = 0; i < states.size(); ++i) {
    if (!m_objects[i]) continue;
    const BodyState& s = states[i];
    btCollisionObject& o = *m_objects[i];
    o.setWorldTransform(s.transform);
    o.setInterpolationWorldTransform(s.interpolation);
    o.setInterpolationLinearVelocity(s.interpolationLinear);
    o.setInterpolationAngularVelocity(s.interpolationAngular);
    o.forceActivationState(s.activation);
    o.setDeactivationTime(s.deactivationTime);
    if (btRigidBody* body = btRigidBody::upcast(&o)) {
      body->setLinearVelocity(s.linear);
      body->setAngularVelocity(s.angular);
      body->updateInertiaTensor();
    }
  }
}

void OracleWorld::setForces() {
  clearForces();
  applyGravity();
}

namespace {

// Of the nearest points of two manifolds of the same bodies.
double distanceSqrOf(const Manifold& ours, const btPersistentManifold& stock) {
  double least = HUGE_VAL;
  for (int i = 0; i < ours.pointCount; ++i) {
    for (int k = 0; k < stock.getNumContacts(); ++k) {
      const btVector3 apart = toBullet(ours.points[i].localPointA) - stock.getContactPoint(k).m_localPointA;
      least = std::min(least, double(apart.length2()));
    }
  }
  return least;
}

}  // namespace

void OracleWorld::setState(const std::vector<BodyState>& states, const std::vector<Manifold>& cache,
                           const WorldInput& input) {
  restore(states);
  setForces();
  // The pairs have to be there before their manifolds can be filled.
  updateAabbs();
  computeOverlappingPairs();
  std::vector<Manifold> single, compound;
  const std::vector<BodyInfo>& infos = input.infos.values;
  for (const Manifold& m : cache) {
    const bool isChild = ownerOf(infos, m.bodyA) != m.bodyA || ownerOf(infos, m.bodyB) != m.bodyB;
    (isChild ? compound : single).push_back(m);
  }
  m_notFilled.clear();
  ShapeManifolds known = compound.empty() ? ShapeManifolds() : findShapeManifolds();
  replaceContacts(single, single.size(), true);
  for (Manifold& m : compound) {
    const int childA = shapeNumber(input, m.bodyA), childB = shapeNumber(input, m.bodyB);
    m.bodyA = ownerOf(infos, m.bodyA);
    m.bodyB = ownerOf(infos, m.bodyB);
    if (m.pointCount == 0) continue;
    const ShapePair shapes{m.bodyA, childA, m.bodyB, childB};
    const auto [first, last] = known.equal_range(shapes);
    const auto nearest = std::min_element(first, last, [&m](const auto& p, const auto& q) {
      return distanceSqrOf(m, *p.second) < distanceSqrOf(m, *q.second);
    });
    if (nearest == last) {
      m_notFilled.insert(shapes);
      continue;
    }
    btPersistentManifold& manifold = *nearest->second;
    known.erase(nearest);
    writeManifold(m, manifold);
    for (int k = 0; k < m.pointCount; ++k) {
      btManifoldPoint& p = manifold.getContactPoint(k);
      p.m_index0 = childA;
      p.m_index1 = childB;
      if (childB == kMeshes) p.m_partId1 = 0;  // a mesh is always the second body
    }
  }
}

// Stock's algorithms for compounds make a manifold for each two shapes, which only its points name: so they are let
// run.
OracleWorld::ShapeManifolds OracleWorld::findShapeManifolds() {
  releaseLoose();
  performDiscreteCollisionDetection();
  ShapeManifolds known;
  for (int i = 0; i < getDispatcher()->getNumManifolds(); ++i) {
    btPersistentManifold* m = getDispatcher()->getManifoldByIndexInternal(i);
    if (m->getNumContacts() > 0) known.emplace(shapesOf(*m), m);
  }
  return known;
}

OracleWorld::ShapePair OracleWorld::shapesOf(const btPersistentManifold& m) const {
  const auto childOn = [](const btCollisionObject& o, int part, int index) {
    return !o.getCollisionShape()->isCompound() ? -1 : part >= 0 ? kMeshes : index;
  };
  const btManifoldPoint& p = m.getContactPoint(0);
  return {slotOf(*m.getBody0()), childOn(*m.getBody0(), p.m_partId0, p.m_index0), slotOf(*m.getBody1()),
          childOn(*m.getBody1(), p.m_partId1, p.m_index1)};
}

int OracleWorld::shapeNumber(const WorldInput& input, uint slot) {
  const int child = childOf(input.infos.values, slot);
  if (child < 0) return child;
  const auto shape = static_cast<size_t>(input.infos.values[slot].shapeIndex);
  return input.shapes.values[shape].type == SHAPE_MESH ? kMeshes : child;
}

void OracleWorld::releaseLoose() {
  for (btPersistentManifold* loose : m_loose) getDispatcher()->releaseManifold(loose);
  m_loose.clear();
}

bool OracleWorld::hasCompound(const Manifold& m) const {
  const auto isCompound = [this](uint slot) {
    return m_objects[slot] && m_objects[slot]->getCollisionShape()->isCompound();
  };
  return isCompound(m.bodyA) || isCompound(m.bodyB);
}

void OracleWorld::findContacts(btScalar timeStep) {
  predictUnconstraintMotion(timeStep);
  getDispatchInfo().m_timeStep = timeStep;
  getDispatchInfo().m_stepCount = 0;
  createPredictiveContacts(timeStep);
  performDiscreteCollisionDetection();
}

void OracleWorld::replaceContacts(const std::vector<Manifold>& contacts, size_t ofPairs, bool ofThisWorldsOnly) {
  releaseLoose();
  m_replaced.assign(contacts.size(), nullptr);
  for (int i = 0; i < getDispatcher()->getNumManifolds(); ++i) {
    getDispatcher()->getManifoldByIndexInternal(i)->clearManifold();
  }
  for (size_t i = 0; i < contacts.size(); ++i) {
    const Manifold& m = contacts[i];
    // Pairs that the host collides have a manifold whether they touch or not, by which kinematic bodies wake others;
    // the shadow leaves them out of its narrowphase.
    const bool isHosts = m.bucket == BUCKET_HOST;
    if ((m.pointCount == 0 && !isHosts) || !m_objects[m.bodyA] || !m_objects[m.bodyB]) continue;
    btPersistentManifold* manifold = nullptr;
    const bool hasPlace = i < ofPairs && !isHosts && !hasCompound(m);
    if (hasPlace) manifold = manifoldOfPair(*this, *object(m.bodyA), *object(m.bodyB));
    if (!manifold && !(hasPlace && ofThisWorldsOnly)) {
      manifold = getDispatcher()->getNewManifold(object(m.bodyA), object(m.bodyB));
      m_loose.push_back(manifold);
    }
    m_replaced[i] = manifold;
    if (manifold) writeManifold(m, *manifold);
  }
}

void OracleWorld::reverseContacts() {
  const int count = getDispatcher()->getNumManifolds();
  btPersistentManifold** manifolds = getDispatcher()->getInternalManifoldPointer();
  if (count == 0) return;
  std::reverse(manifolds, manifolds + count);
  for (int i = 0; i < count; ++i) manifolds[i]->m_index1a = i;
}

void OracleWorld::solve(btScalar timeStep, int iterations) {
  btContactSolverInfo& info = getSolverInfo();
  const int ownIterations = info.m_numIterations;
  if (iterations >= 0) info.m_numIterations = iterations;
  info.m_timeStep = timeStep;
  calculateSimulationIslands();
  solveConstraints(info);
  info.m_numIterations = ownIterations;
}

void OracleWorld::finish(btScalar timeStep) {
  m_sweeps = true;
  integrateTransforms(timeStep);
  m_sweeps = false;
  updateActivationState(timeStep);
  clearForces();
}

std::vector<Velocity> OracleWorld::velocities() const {
  std::vector<Velocity> result(m_objects.size(), {btVector3(0, 0, 0), btVector3(0, 0, 0)});
  for (size_t i = 0; i < result.size(); ++i) {
    if (const btRigidBody* b = body(i)) result[i] = {b->getLinearVelocity(), b->getAngularVelocity()};
  }
  return result;
}

BTGPU_TRANSLATION_END
