// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btGeneric6DofSpring2Constraint, and what derives from it: the fixed joint and the wheel's.
#include "tests/compat/api/joint_case.h"

namespace btgpu::test::api {
namespace {

// Beyond a limit on axes 1 and 4, free on axes 2 and 5.
btGeneric6DofSpring2Constraint* limited(Lab& w, const Two& t) {
  auto* j = w.objects.joint<btGeneric6DofSpring2Constraint>(false, *t.a, *t.b, t.inA * turned(0.1, 0.05, 0.04), t.inB);
  j->setLinearLowerLimit(vector(0, 0.04, 1));
  j->setLinearUpperLimit(vector(0, 0.05, -1));
  j->setAngularLowerLimit(vector(0, 0.15, 1));
  j->setAngularUpperLimit(vector(0, 0.2, -1));
  return j;
}

// Nothing in Bullet sets the flag; a class of one's own can.
class InfiniteError : public btGeneric6DofSpring2Constraint {
 public:
  using btGeneric6DofSpring2Constraint::btGeneric6DofSpring2Constraint;
  void set() { m_flags |= BT_6DOF_FLAGS_USE_INFINITE_ERROR; }
};

}  // namespace

API_CASE(SixDofSpring2, InfiniteError, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<InfiniteError>(false, *t.a, *t.b, t.inA * turned(0.1, 0.05, 0.04), t.inB);
  w.probe("as made");
  j->set();
  w.probeAny("BT_6DOF_FLAGS_USE_INFINITE_ERROR");
}

API_CASE(SixDofSpring2, Constructors, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<btGeneric6DofSpring2Constraint>(false, *t.a, *t.b, t.inA, t.inB, RO_XYZ);
  LOG(j->getConstraintType() == D6_SPRING_2_CONSTRAINT_TYPE);
  w.probe("btGeneric6DofSpring2Constraint of two bodies");
  w.objects.remove(j);
  w.objects.joint<btGeneric6DofSpring2Constraint>(false, *t.b, t.inB, RO_XYZ);
  w.probe("of one body");
}

API_CASE(SixDofSpring2, Frames, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited(w, t);
  const btGeneric6DofSpring2Constraint& read = *j;
  w.probe("as made");
  j->setFrames(t.inA * turned(0, 0.1, 0), t.inB * turned(0.1, 0, 0));
  logFrames(w, read.getFrameOffsetA(), read.getFrameOffsetB());
  w.probe("setFrames");
  j->getFrameOffsetA() = t.inA;
  w.probe("getFrameOffsetA");
  j->getFrameOffsetB() = t.inB * turned(0.05, 0, 0.05);
  w.probe("getFrameOffsetB");
  j->setAxis(vector(0, 0, 1), vector(1, 0, 0));
  w.probe("setAxis");
}

API_CASE(SixDofSpring2, Pose, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited(w, t);
  logPose(w, *j);
  w.step();
  j->calculateTransforms(t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform());
  LOG_NEAR(j->getCalculatedTransformA());
  LOG_NEAR(j->getCalculatedTransformB());
}

API_CASE(SixDofSpring2, RotationOrder, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited(w, t);
  LOG(j->getRotationOrder() == RO_XYZ);
  w.probe("RO_XYZ");
  for (const RotateOrder order : {RO_XZY, RO_YXZ, RO_YZX, RO_ZXY, RO_ZYX}) {
    j->setRotationOrder(order);
    LOG(j->getRotationOrder());
    w.probe("order " + std::to_string(order));
  }
  const btMatrix3x3 turn = turned(0.3, 0.2, 0.1).getBasis();
  btVector3 angles(0, 0, 0);
  LOG(btGeneric6DofSpring2Constraint::btGetMatrixElem(turn, 5));
  LOG(btGeneric6DofSpring2Constraint::matrixToEulerXYZ(turn, angles));
  LOG(angles);
  LOG(btGeneric6DofSpring2Constraint::matrixToEulerXZY(turn, angles));
  LOG(angles);
  LOG(btGeneric6DofSpring2Constraint::matrixToEulerYXZ(turn, angles));
  LOG(angles);
  LOG(btGeneric6DofSpring2Constraint::matrixToEulerYZX(turn, angles));
  LOG(angles);
  LOG(btGeneric6DofSpring2Constraint::matrixToEulerZXY(turn, angles));
  LOG(angles);
  LOG(btGeneric6DofSpring2Constraint::matrixToEulerZYX(turn, angles));
  LOG(angles);
}

API_CASE(SixDofSpring2, Limits, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited(w, t);
  btVector3 limit(0, 0, 0);
  probeLimits(w, *j);
  j->setAngularLowerLimitReversed(vector(0, -0.25, -1));
  j->getAngularLowerLimitReversed(limit);
  LOG(limit);
  w.probe("setAngularLowerLimitReversed");
  j->setAngularUpperLimitReversed(vector(0, -0.2, -1));
  j->getAngularUpperLimitReversed(limit);
  LOG(limit);
  w.probe("setAngularUpperLimitReversed");
  j->setLimit(1, scalar(-0.2), scalar(-0.1));
  w.probe("setLimit of a linear axis");
  j->setLimit(4, scalar(-0.2), scalar(-0.1));
  w.probe("setLimit of an angular axis");
  j->setLimitReversed(4, scalar(-0.5), scalar(-0.4));
  w.probe("setLimitReversed");
}

API_CASE(SixDofSpring2, Motors, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited(w, t);
  w.probe("no motor");
  for (const int axis : {2, 5}) {
    const std::string of = " of axis " + std::to_string(axis);
    j->enableMotor(axis, true);
    j->setTargetVelocity(axis, scalar(1));
    j->setMaxMotorForce(axis, scalar(0.3));
    w.probe("enableMotor" + of);
    j->setTargetVelocity(axis, scalar(-2));
    w.probe("setTargetVelocity" + of);
    j->setMaxMotorForce(axis, 300);
    w.probe("setMaxMotorForce" + of);
    j->setServo(axis, true);
    j->setServoTarget(axis, scalar(0.01));
    w.probe("setServo" + of);
    bool seen = false;
    for (const double target : {-0.5, 0.5}) {  // on either side of where the bodies are
      j->setServoTarget(axis, scalar(target));
      seen = w.probeAny("setServoTarget" + of) || seen;
    }
    EXPECT_TRUE(seen);
  }
}

API_CASE(SixDofSpring2, Springs, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited(w, t);
  w.probe("no spring");
  for (const int axis : {2, 5}) {
    const std::string of = " of axis " + std::to_string(axis);
    j->enableSpring(axis, true);
    j->setStiffness(axis, scalar(30), false);
    w.probe("enableSpring" + of);
    j->setStiffness(axis, scalar(90));
    w.probe("setStiffness" + of);
    j->setDamping(axis, scalar(2));
    w.probe("setDamping" + of);
    j->setDamping(axis, scalar(1), false);
    w.probe("setDamping, not limited" + of);
    j->setEquilibriumPoint(axis, scalar(0.2));
    w.probe("setEquilibriumPoint to a value" + of);
  }
  j->setEquilibriumPoint(2);
  w.probe("setEquilibriumPoint of an axis");
  j->setEquilibriumPoint();
  w.probe("setEquilibriumPoint");
}

API_CASE(SixDofSpring2, Parameters, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited(w, t);
  for (const int axis : {2, 5}) {
    j->enableMotor(axis, true);
    j->setTargetVelocity(axis, 1);
    j->setMaxMotorForce(axis, 300);
  }
  logSerialized(w, *j);
  w.probe("as made");
  for (const int axis : {1, 4}) {
    j->setParam(BT_CONSTRAINT_STOP_ERP, scalar(0.7), axis);
    LOG(j->getParam(BT_CONSTRAINT_STOP_ERP, axis));
    w.probe("BT_6DOF_FLAGS_ERP_STOP2, axis " + std::to_string(axis));
    j->setParam(BT_CONSTRAINT_STOP_CFM, scalar(0.2), axis);
    LOG(j->getParam(BT_CONSTRAINT_STOP_CFM, axis));
    w.probe("BT_6DOF_FLAGS_CFM_STOP2, axis " + std::to_string(axis));
  }
  for (const int axis : {2, 5}) {
    j->setParam(BT_CONSTRAINT_CFM, scalar(0.3), axis);
    LOG(j->getParam(BT_CONSTRAINT_CFM, axis));
    w.probe("BT_6DOF_FLAGS_CFM_MOTO2, axis " + std::to_string(axis));
    j->setParam(BT_CONSTRAINT_ERP, scalar(0.4), axis);
    LOG(j->getParam(BT_CONSTRAINT_ERP, axis));
    w.probeSame("BT_6DOF_FLAGS_ERP_MOTO2: of servos, axis " + std::to_string(axis));
  }
}

API_CASE(SixDofSpring2, Bounce, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited(w, t);
  j->calculateTransforms();
  for (const int axis : {1, 4}) {
    const btScalar now = axis < 3 ? j->getRelativePivotPosition(axis) : j->getAngle(axis - 3);
    bool seen = false;
    for (const int side : {-1, 1}) {  // one of them is that which the bodies move towards
      j->setLimit(axis, now + scalar(side < 0 ? 0.001 : -1), now + scalar(side < 0 ? 1 : -0.001));
      j->setBounce(axis, 0);
      w.probeAny("without bounce");
      j->setBounce(axis, scalar(0.9));
      seen = w.probeAny("setBounce") || seen;
    }
    EXPECT_TRUE(seen) << axis;
    LOG(j->getTranslationalLimitMotor()->m_bounce);
    LOG(j->getRotationalLimitMotor(1)->m_bounce);
  }
}

API_CASE(SixDofSpring2, SolverCalls, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited(w, t);
  logRows(w, *j);
  w.step();
}

// ---- limits and motors of an axis

API_CASE(RotationalLimitMotor2, Fields, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited(w, t);
  btRotationalLimitMotor2 *limit = j->getRotationalLimitMotor(1), *axis = j->getRotationalLimitMotor(2);
  w.probe("as made");
  LOG(limit->m_currentLimit);
  LOG(limit->m_currentLimitError);
  LOG(limit->m_currentLimitErrorHi);
  LOG(limit->m_currentPosition);
  LOG(limit->isLimited());
  limit->m_loLimit = scalar(0.3);
  limit->m_hiLimit = scalar(0.35);
  w.probe("m_loLimit, m_hiLimit");
  j->setParam(BT_CONSTRAINT_STOP_ERP, scalar(0.5), 4);
  w.probe("m_stopERP");
  LOG(limit->m_stopERP);
  j->setParam(BT_CONSTRAINT_STOP_CFM, scalar(0.1), 4);
  w.probe("m_stopCFM");
  LOG(limit->m_stopCFM);
  axis->m_enableMotor = true;
  axis->m_targetVelocity = scalar(1);
  axis->m_maxMotorForce = scalar(20);
  w.probe("m_enableMotor, m_targetVelocity, m_maxMotorForce");
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.3), 5);
  w.probe("m_motorCFM");
  LOG(axis->m_motorCFM);
  axis->m_servoMotor = true;
  axis->m_servoTarget = scalar(0.01);
  w.probe("m_servoMotor, m_servoTarget");
  j->setParam(BT_CONSTRAINT_ERP, scalar(0.01), 5);
  w.probe("m_motorERP");
  LOG(axis->m_motorERP);
  btRotationalLimitMotor2 alone, copy(*limit);
  alone.m_loLimit = scalar(-0.1);
  alone.m_hiLimit = scalar(0.1);
  alone.testLimitValue(scalar(0.3));
  LOG(alone.m_currentLimit);
  LOG(copy.m_hiLimit);
}

API_CASE(RotationalLimitMotor2, Spring, Shares("joints")) {
  const Two t = twoBodies(w);
  btRotationalLimitMotor2* axis = limited(w, t)->getRotationalLimitMotor(2);
  w.probe("no spring");
  axis->m_enableSpring = true;
  axis->m_springStiffness = scalar(40);
  w.probe("m_enableSpring, m_springStiffness");
  axis->m_springDamping = scalar(1);
  w.probe("m_springDamping");
  axis->m_equilibriumPoint = scalar(0.3);
  w.probe("m_equilibriumPoint");
  axis->m_springStiffness = scalar(1e5);
  axis->m_springStiffnessLimited = true;
  w.probe("m_springStiffnessLimited");
  axis->m_springDamping = scalar(1e4);
  axis->m_springDampingLimited = true;
  w.probe("m_springDampingLimited");
}

API_CASE(TranslationalLimitMotor2, Fields, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited(w, t);
  btTranslationalLimitMotor2* m = j->getTranslationalLimitMotor();
  w.probe("as made");
  LOG(m->m_currentLimit[1]);
  LOG(m->m_currentLimitError);
  LOG(m->m_currentLimitErrorHi);
  LOG(m->m_currentLinearDiff);
  LOG(m->isLimited(1));
  m->m_lowerLimit[1] = scalar(0.1);
  m->m_upperLimit[1] = scalar(0.12);
  w.probe("m_lowerLimit, m_upperLimit");
  j->setParam(BT_CONSTRAINT_STOP_ERP, scalar(0.5), 1);
  w.probe("m_stopERP");
  LOG(m->m_stopERP);
  j->setParam(BT_CONSTRAINT_STOP_CFM, scalar(0.1), 1);
  w.probe("m_stopCFM");
  LOG(m->m_stopCFM);
  m->m_enableMotor[2] = true;
  m->m_targetVelocity[2] = scalar(1);
  m->m_maxMotorForce[2] = scalar(300);
  w.probe("m_enableMotor, m_targetVelocity, m_maxMotorForce");
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.3), 2);
  w.probe("m_motorCFM");
  LOG(m->m_motorCFM);
  m->m_servoMotor[2] = true;
  m->m_servoTarget[2] = scalar(0.3);
  w.probe("m_servoMotor, m_servoTarget");
  j->setParam(BT_CONSTRAINT_ERP, scalar(0.01), 2);
  w.probe("m_motorERP");
  LOG(m->m_motorERP);
  btTranslationalLimitMotor2 alone, copy(*m);
  alone.testLimitValue(1, scalar(0.3));
  LOG(alone.m_currentLimit[1]);
  LOG(copy.m_upperLimit);
}

API_CASE(TranslationalLimitMotor2, Spring, Shares("joints")) {
  const Two t = twoBodies(w);
  btTranslationalLimitMotor2* m = limited(w, t)->getTranslationalLimitMotor();
  w.probe("no spring");
  m->m_enableSpring[2] = true;
  m->m_springStiffness[2] = scalar(40);
  w.probe("m_enableSpring, m_springStiffness");
  m->m_springDamping[2] = scalar(2);
  w.probe("m_springDamping");
  m->m_equilibriumPoint[2] = scalar(0.3);
  w.probe("m_equilibriumPoint");
  m->m_springStiffness[2] = scalar(1e5);
  m->m_springStiffnessLimited[2] = true;
  w.probe("m_springStiffnessLimited");
  m->m_springDamping[2] = scalar(1e4);
  m->m_springDampingLimited[2] = true;
  w.probe("m_springDampingLimited");
}

// ---- btFixedConstraint, btHinge2Constraint

API_CASE(Fixed, Holds, Shares("joints")) {
  const Two t = twoBodies(w);
  w.probe("free");
  auto* j = w.objects.joint<btFixedConstraint>(false, *t.a, *t.b, t.inA, t.inB);
  LOG(j->getConstraintType());
  LOG(j->getConstraintType() == FIXED_CONSTRAINT_TYPE);
  logRows(w, *j);
  w.probe("btFixedConstraint");
}

API_CASE(Hinge2, Wheel, Shares("joints")) {
  const Two t = twoBodies(w, true);
  btVector3 anchor = t.at.getOrigin(), axis1 = vector(0, 1, 0), axis2 = vector(1, 0, 0);
  auto* j = w.objects.joint<btHinge2Constraint>(false, *t.a, *t.b, anchor, axis1, axis2);
  LOG(j->getAnchor());
  LOG(j->getAnchor2());
  LOG(j->getAxis1());
  LOG(j->getAxis2());
  LOG(j->getAngle1());
  LOG(j->getAngle2());
  w.probe("btHinge2Constraint");
  j->setLowerLimit(scalar(0.3));
  j->setUpperLimit(scalar(0.4));
  w.probe("setLowerLimit, setUpperLimit");
  j->enableMotor(3, true);
  j->setTargetVelocity(3, scalar(2));
  j->setMaxMotorForce(3, scalar(1));
  w.probe("motor of the wheel");
}

}  // namespace btgpu::test::api
