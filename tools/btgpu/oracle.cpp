// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "oracle.h"

#include <algorithm>

#include "translation/contacts.h"

namespace btgpu::tool {
namespace {

// Pairs without margin, which are the ones that btgpu and Bullet's other broadphases find; islands are merged over
// them. The margin is a global, so it is put back at once for the other worlds.
class NoLeafMargin {
 public:
  NoLeafMargin() : m_saved(gDbvtMargin) { gDbvtMargin = 0; }
  ~NoLeafMargin() { gDbvtMargin = m_saved; }
  NoLeafMargin(const NoLeafMargin&) = delete;
  NoLeafMargin& operator=(const NoLeafMargin&) = delete;

 private:
  btScalar m_saved;
};

}  // namespace

std::vector<BodyState> captureStates(const btCollisionWorld& world) {
  std::vector<BodyState> states;
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  states.reserve(static_cast<size_t>(objects.size()));
  for (int i = 0; i < objects.size(); ++i) {
    const btCollisionObject& o = *objects[i];
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
    states.push_back(s);
  }
  return states;
}

std::vector<JointState> captureJoints(const btDynamicsWorld& world) {
  std::vector<JointState> states;
  for (int i = 0; i < world.getNumConstraints(); ++i) {
    const btTypedConstraint* joint = world.getConstraint(i);
    if (!joint) continue;  // what the base class answers
    const auto* hinge = dynamic_cast<const btHingeAccumulatedAngleConstraint*>(joint);
    const btScalar angle =
        hinge ? const_cast<btHingeAccumulatedAngleConstraint*>(hinge)->getAccumulatedHingeAngle() : btScalar(0);
    states.push_back({joint->isEnabled(), angle});
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
  }
}

void OracleWorld::reverseJoints() {
  for (int i = 0; i < m_constraints.size() / 2; ++i) m_constraints.swap(i, m_constraints.size() - 1 - i);
}

void OracleWorld::restore(const std::vector<BodyState>& states) {
  for (size_t i = 0; i < states.size(); ++i) {
    const BodyState& s = states[i];
    btCollisionObject& o = *object(static_cast<uint>(i));
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

void OracleWorld::setState(const std::vector<BodyState>& states, const std::vector<Manifold>& cache) {
  restore(states);
  clearForces();
  applyGravity();
  // The pairs have to be there before their manifolds can be filled.
  const NoLeafMargin tight;
  updateAabbs();
  computeOverlappingPairs();
  replaceContacts(cache, cache.size());
}

void OracleWorld::findContacts(btScalar timeStep) {
  predictUnconstraintMotion(timeStep);
  getDispatchInfo().m_timeStep = timeStep;
  getDispatchInfo().m_stepCount = 0;
  createPredictiveContacts(timeStep);
  const NoLeafMargin tight;
  performDiscreteCollisionDetection();
}

void OracleWorld::replaceContacts(const std::vector<Manifold>& contacts, size_t ofPairs) {
  for (btPersistentManifold* loose : m_loose) getDispatcher()->releaseManifold(loose);
  m_loose.clear();
  m_replaced.assign(contacts.size(), nullptr);
  for (int i = 0; i < getDispatcher()->getNumManifolds(); ++i) {
    getDispatcher()->getManifoldByIndexInternal(i)->clearManifold();
  }
  for (size_t i = 0; i < contacts.size(); ++i) {
    const Manifold& m = contacts[i];
    if (m.pointCount == 0) continue;
    btPersistentManifold* manifold;
    if (i < ofPairs) {
      manifold = manifoldOfPair(*this, *object(m.bodyA), *object(m.bodyB));
    } else {
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
  integrateTransforms(timeStep);
  updateActivationState(timeStep);
  clearForces();
}

std::vector<Velocity> OracleWorld::velocities() const {
  std::vector<Velocity> result(static_cast<size_t>(getNumCollisionObjects()), {btVector3(0, 0, 0), btVector3(0, 0, 0)});
  for (int i = 0; i < getNumCollisionObjects(); ++i) {
    if (const btRigidBody* body = btRigidBody::upcast(getCollisionObjectArray()[i])) {
      result[static_cast<size_t>(i)] = {body->getLinearVelocity(), body->getAngularVelocity()};
    }
  }
  return result;
}

}  // namespace btgpu::tool
