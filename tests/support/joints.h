// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// One joint of every type, with its limits, motors or springs at work.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "samples/scenes/scene.h"

namespace btgpu::test {

using JointMaker = std::function<btTypedConstraint*(scenes::Objects&, btRigidBody&, btRigidBody&)>;

struct JointKind {
  std::string name;
  JointMaker make;
};

inline btScalar scalar(double v) { return static_cast<btScalar>(v); }
inline btVector3 vector(double x, double y, double z) { return {scalar(x), scalar(y), scalar(z)}; }

// The frame in `body`'s own axes that now lies at `world`.
inline btTransform frameIn(const btRigidBody& body, const btTransform& world) {
  return body.getWorldTransform().inverse() * world;
}
// Between the two bodies, turned a little.
inline btTransform frameBetween(const btRigidBody& a, const btRigidBody& b) {
  return btTransform(btQuaternion(vector(1, 2, 3).normalized(), scalar(0.4)),
                     (a.getWorldTransform().getOrigin() + b.getWorldTransform().getOrigin()) * scalar(0.5));
}

inline std::vector<JointKind> jointKinds() {
  const auto ball = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    auto* j = o.joint<btPoint2PointConstraint>(false, a, b, frameIn(a, at).getOrigin(),
                                               frameIn(b, at).getOrigin() + vector(0.05, -0.02, 0.01));
    return j;
  };
  const auto ballWithClamp = [ball](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    auto* j = static_cast<btPoint2PointConstraint*>(ball(o, a, b));
    j->m_setting.m_impulseClamp = scalar(0.05);
    j->setParam(BT_CONSTRAINT_CFM, scalar(0.01), -1);
    j->setParam(BT_CONSTRAINT_ERP, scalar(0.5), -1);
    return j;
  };
  const auto hinge = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) {
    const btTransform at = frameBetween(a, b);
    return o.joint<btHingeConstraint>(false, a, b, frameIn(a, at), frameIn(b, at), true);
  };
  const auto hingeLimit = [hinge](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    auto* j = hinge(o, a, b);
    j->setLimit(scalar(0.1), scalar(0.5), scalar(0.9), scalar(0.3), scalar(0.6));
    return j;
  };
  const auto hingeMotor = [hinge](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    auto* j = hinge(o, a, b);
    j->enableAngularMotor(true, scalar(2), scalar(0.02));
    return j;
  };
  const auto hingeAccumulated = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    auto* j = o.joint<btHingeAccumulatedAngleConstraint>(false, a, b, frameIn(a, at), frameIn(b, at), false);
    j->setLimit(scalar(-0.5), scalar(0.05));
    return j;
  };
  const auto slider = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    auto* j = o.joint<btSliderConstraint>(false, a, b, frameIn(a, at), frameIn(b, at), true);
    j->setLowerLinLimit(scalar(-0.01));
    j->setUpperLinLimit(scalar(0.01));
    j->setLowerAngLimit(scalar(-0.2));
    j->setUpperAngLimit(scalar(0.2));
    j->setPoweredAngMotor(true);
    j->setTargetAngMotorVelocity(scalar(1));
    j->setMaxAngMotorForce(scalar(1));
    return j;
  };
  const auto cone = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    auto* j = o.joint<btConeTwistConstraint>(false, a, b, frameIn(a, at),
                                             frameIn(b, at) * btTransform(btQuaternion(vector(0, 1, 0), scalar(0.5))));
    j->setLimit(scalar(0.3), scalar(0.3), scalar(0.2));
    return j;
  };
  const auto coneMotor = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    auto* j = o.joint<btConeTwistConstraint>(false, a, b, frameIn(a, at), frameIn(b, at));
    j->enableMotor(true);
    j->setMaxMotorImpulse(scalar(0.1));
    j->setMotorTarget(btQuaternion(vector(0, 0, 1), scalar(0.3)));
    return j;
  };
  const auto sixDof = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    auto* j = o.joint<btGeneric6DofConstraint>(false, a, b, frameIn(a, at), frameIn(b, at), true);
    j->setLinearLowerLimit(vector(0, -0.01, 1));  // locked, limited, free
    j->setLinearUpperLimit(vector(0, 0.01, -1));
    j->setAngularLowerLimit(vector(0, -0.1, 0.1));
    j->setAngularUpperLimit(vector(0, 0.1, 0.5));
    j->getRotationalLimitMotor(2)->m_enableMotor = true;
    j->getRotationalLimitMotor(2)->m_targetVelocity = scalar(1);
    j->getRotationalLimitMotor(2)->m_maxMotorForce = scalar(3);
    return j;
  };
  const auto spring = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    auto* j = o.joint<btGeneric6DofSpringConstraint>(false, a, b, frameIn(a, at), frameIn(b, at), true);
    j->setLinearLowerLimit(vector(-1, -1, 0));
    j->setLinearUpperLimit(vector(1, 1, 0));
    j->setAngularLowerLimit(vector(-1, 0, 0));
    j->setAngularUpperLimit(vector(1, 0, 0));
    for (const int axis : {0, 1, 3}) {
      j->enableSpring(axis, true);
      j->setStiffness(axis, scalar(40));
      j->setDamping(axis, scalar(0.5));
      j->setEquilibriumPoint(axis, scalar(0.1));
    }
    return j;
  };
  const auto spring2 = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    auto* j = o.joint<btGeneric6DofSpring2Constraint>(false, a, b, frameIn(a, at), frameIn(b, at));
    j->setLinearLowerLimit(vector(-1, -0.001, 0));
    j->setLinearUpperLimit(vector(1, 0.001, 0));
    j->setAngularLowerLimit(vector(-1, 0, -0.2));
    j->setAngularUpperLimit(vector(1, 0, 0.2));
    j->enableSpring(0, true);
    j->setStiffness(0, scalar(30));
    j->setDamping(0, scalar(2));
    j->setEquilibriumPoint(0, scalar(0.1));
    j->enableMotor(3, true);
    j->setTargetVelocity(3, scalar(1));
    j->setMaxMotorForce(3, scalar(2));
    j->setBounce(5, scalar(0.5));
    return j;
  };
  const auto gear = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    return o.joint<btGearConstraint>(false, a, b, vector(0, 1, 0), vector(0, 0, 1), scalar(0.7));
  };
  const auto fixed = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btTransform at = frameBetween(a, b);
    return o.joint<btFixedConstraint>(false, a, b, frameIn(a, at), frameIn(b, at));
  };
  const auto universal = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    const btVector3 anchor = frameBetween(a, b).getOrigin(), axis1 = vector(0, 1, 0), axis2 = vector(1, 0, 0);
    auto* j = o.joint<btUniversalConstraint>(false, a, b, anchor, axis1, axis2);
    j->setLowerLimit(scalar(-0.2), scalar(-0.2));
    j->setUpperLimit(scalar(0.2), scalar(0.2));
    return j;
  };
  const auto hinge2 = [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    btVector3 anchor = frameBetween(a, b).getOrigin(), axis1 = vector(0, 1, 0), axis2 = vector(1, 0, 0);
    auto* j = o.joint<btHinge2Constraint>(false, a, b, anchor, axis1, axis2);
    j->setLowerLimit(scalar(-0.3));
    j->setUpperLimit(scalar(0.3));
    j->enableMotor(3, true);
    j->setTargetVelocity(3, scalar(2));
    j->setMaxMotorForce(3, scalar(1));
    return j;
  };
  return {{"ball", ball},
          {"ballWithClamp", ballWithClamp},
          {"hingeLimit", hingeLimit},
          {"hingeMotor", hingeMotor},
          {"hingeAccumulated", hingeAccumulated},
          {"slider", slider},
          {"cone", cone},
          {"coneMotor", coneMotor},
          {"sixDof", sixDof},
          {"spring", spring},
          {"spring2", spring2},
          {"gear", gear},
          {"fixed", fixed},
          {"universal", universal},
          {"hinge2", hinge2}};
}

// Two free boxes of different mass, turned, damped and moving; they don't touch.
inline void addJointBodies(scenes::Objects& o, btRigidBody*& a, btRigidBody*& b) {
  o.world().setGravity(vector(0, -10, 0));
  const btTransform atA(btQuaternion(vector(1, 0, 1).normalized(), scalar(0.3)), vector(0.1, 5, -0.2));
  const btTransform atB(btQuaternion(vector(0, 1, 2).normalized(), scalar(-0.5)), vector(1.4, 5.3, 0.3));
  a = o.add(1, o.box(vector(0.3, 0.4, 0.5)), atA);
  b = o.add(2, o.box(vector(0.4, 0.2, 0.3)), atB);
  a->setLinearVelocity(vector(1, -0.5, 0.3));
  a->setAngularVelocity(vector(0.5, 2, -1));
  b->setLinearVelocity(vector(-0.2, 0.7, 0.4));
  b->setAngularVelocity(vector(-1, 0.3, 1.5));
  for (btRigidBody* body : {a, b}) {
    body->setDamping(scalar(0.3), scalar(0.4));
    body->setActivationState(DISABLE_DEACTIVATION);
  }
}

}  // namespace btgpu::test
