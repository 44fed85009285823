// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btGeneric6DofConstraint, and what derives from it: the spring and the universal joint.
#include "tests/compat/api/joint_case.h"

namespace btgpu::test::api {
namespace {

// Locked, limited and free axes, linear and angular.
template <typename Joint>
Joint* limited(Lab& w, const Two& t) {
  auto* j = w.objects.joint<Joint>(false, *t.a, *t.b, t.inA * turned(0.1, 0.05, 0.04), t.inB, true);
  j->setLinearLowerLimit(vector(0, 0.04, 1));
  j->setLinearUpperLimit(vector(0, 0.05, -1));
  j->setAngularLowerLimit(vector(0, 0.15, 1));
  j->setAngularUpperLimit(vector(0, 0.2, -1));
  return j;
}

}  // namespace

API_CASE(SixDof, Constructors, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<btGeneric6DofConstraint>(false, *t.a, *t.b, t.inA, t.inB, true);
  LOG(j->getConstraintType() == D6_CONSTRAINT_TYPE);
  LOG(j->m_useSolveConstraintObsolete);
  w.probe("btGeneric6DofConstraint of two bodies");
  w.objects.remove(j);
  w.objects.joint<btGeneric6DofConstraint>(false, *t.b, t.inB, true);
  w.probe("of one body");
}

API_CASE(SixDof, Frames, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  const btGeneric6DofConstraint& read = *j;
  w.probe("as made");
  j->setFrames(t.inA * turned(0, 0.1, 0), t.inB * turned(0.1, 0, 0));
  logFrames(w, read.getFrameOffsetA(), read.getFrameOffsetB());
  w.probe("setFrames");
  j->getFrameOffsetA() = t.inA;
  w.probe("getFrameOffsetA");
  j->getFrameOffsetB() = t.inB * turned(0.05, 0, 0.05);
  w.probe("getFrameOffsetB");
  LOG(j->getUseFrameOffset());
  j->setUseFrameOffset(!j->getUseFrameOffset());
  LOG(j->getUseFrameOffset());
  w.probe("setUseFrameOffset");
  LOG(j->getUseLinearReferenceFrameA());
  j->setUseLinearReferenceFrameA(!j->getUseLinearReferenceFrameA());
  LOG(j->getUseLinearReferenceFrameA());
  w.probeSame("setUseLinearReferenceFrameA: of a copy in the file only");
  j->setAxis(vector(0, 0, 1), vector(1, 0, 0));
  w.probe("setAxis");
}

API_CASE(SixDof, Pose, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  logPose(w, *j);
  for (int k = 0; k < 3; ++k) LOG(j->testAngularLimitMotor(k));
  j->calcAnchorPos();
  w.step();
  j->calculateTransforms(t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform());
  LOG_NEAR(j->getCalculatedTransformA());
  LOG_NEAR(j->getCalculatedTransformB());
  LOG_NEAR(j->getAngle(0));
}

API_CASE(SixDof, Limits, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  probeLimits(w, *j);
  j->setLimit(1, scalar(-0.2), scalar(-0.1));
  w.probe("setLimit of a linear axis");
  j->setLimit(4, scalar(-0.2), scalar(-0.1));
  w.probe("setLimit of an angular axis");
}

API_CASE(SixDof, Parameters, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  j->getTranslationalLimitMotor()->m_enableMotor[2] = true;
  j->getTranslationalLimitMotor()->m_targetVelocity[2] = 1;
  j->getTranslationalLimitMotor()->m_maxMotorForce[2] = 300;
  LOG(j->getFlags());
  logSerialized(w, *j);
  w.probe("as made");
  for (const int axis : {1, 4}) {
    j->setParam(BT_CONSTRAINT_STOP_ERP, scalar(0.7), axis);
    LOG(j->getParam(BT_CONSTRAINT_STOP_ERP, axis));
    LOG((j->getFlags() & (BT_6DOF_FLAGS_ERP_STOP << (axis * BT_6DOF_FLAGS_AXIS_SHIFT))) != 0);
    w.probe("BT_CONSTRAINT_STOP_ERP of axis " + std::to_string(axis));
    j->setParam(BT_CONSTRAINT_STOP_CFM, scalar(0.2), axis);
    LOG(j->getParam(BT_CONSTRAINT_STOP_CFM, axis));
    LOG((j->getFlags() & (BT_6DOF_FLAGS_CFM_STOP << (axis * BT_6DOF_FLAGS_AXIS_SHIFT))) != 0);
    w.probe("BT_CONSTRAINT_STOP_CFM of axis " + std::to_string(axis));
  }
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.2), 2);
  LOG(j->getParam(BT_CONSTRAINT_CFM, 2));
  LOG((j->getFlags() & (BT_6DOF_FLAGS_CFM_NORM << (2 * BT_6DOF_FLAGS_AXIS_SHIFT))) != 0);
  w.probe("BT_CONSTRAINT_CFM of a motor");
}

API_CASE(SixDof, SolverCalls, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  logRows(w, *j);
  btTypedConstraint::btConstraintInfo1 info1{};
  j->getInfo1NonVirtual(&info1);
  LOG(info1.m_numConstraintRows);
  const btTransform &a = t.a->getCenterOfMassTransform(), &b = t.b->getCenterOfMassTransform();
  const btVector3 &goA = t.a->getLinearVelocity(), &goB = t.b->getLinearVelocity();
  const btVector3 &turnA = t.a->getAngularVelocity(), &turnB = t.b->getAngularVelocity();
  Rows rows, one;
  j->getInfo2NonVirtual(&rows.info, a, b, goA, goB, turnA, turnB);
  rows.logTo(w, "row");
  btVector3 axis = vector(0, 0, 1);
  LOG(j->get_limit_motor_info2(j->getRotationalLimitMotor(1), a, b, goA, goB, turnA, turnB, &one.info, 0, axis, 1, 0));
  one.logTo(w, "row");
  j->buildJacobian();
  j->getInfo2(&rows.info);
  j->updateRHS(scalar(1.0 / 60));
  w.step();
}

// ---- limits and motors of an axis

API_CASE(RotationalLimitMotor, Motor, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  btRotationalLimitMotor* motor = j->getRotationalLimitMotor(2);
  w.probe("no motor");
  motor->m_enableMotor = true;
  motor->m_targetVelocity = scalar(1);
  motor->m_maxMotorForce = scalar(3);
  w.probe("m_enableMotor");
  motor->m_targetVelocity = scalar(-2);
  w.probe("m_targetVelocity");
  motor->m_maxMotorForce = scalar(0.05);
  w.probe("m_maxMotorForce");
  motor->m_maxMotorForce = 20;
  w.probe("m_maxMotorForce");
  motor->m_normalCFM = scalar(0.1);
  w.probeSame("m_normalCFM: only by setParam");
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.4), 5);
  w.probe("m_normalCFM by setParam");
  LOG(motor->needApplyTorques());
}

API_CASE(RotationalLimitMotor, Limit, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  btRotationalLimitMotor* limit = j->getRotationalLimitMotor(1);
  w.probe("as made");
  LOG(limit->m_currentLimit);
  LOG(limit->m_currentLimitError);
  LOG(limit->m_currentPosition);
  LOG(limit->isLimited());
  limit->m_loLimit = scalar(0.3);
  limit->m_hiLimit = scalar(0.35);
  w.probe("m_loLimit, m_hiLimit");
  j->setParam(BT_CONSTRAINT_STOP_ERP, scalar(0.5), 4);
  w.probe("m_stopERP by setParam");
  LOG(limit->m_stopERP);
  limit->m_stopERP = scalar(0.8);
  w.probe("m_stopERP");
  j->setParam(BT_CONSTRAINT_STOP_CFM, scalar(0.1), 4);
  w.probe("m_stopCFM by setParam");
  limit->m_stopCFM = scalar(0.3);
  w.probe("m_stopCFM");
  limit->m_maxLimitForce = scalar(0.01);
  w.probeSame("m_maxLimitForce");
  limit->m_damping = scalar(0.1);
  w.probeSame("m_damping");
  limit->m_limitSoftness = scalar(0.1);
  w.probeSame("m_limitSoftness");
}

API_CASE(RotationalLimitMotor, Bounce, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  btRotationalLimitMotor* limit = j->getRotationalLimitMotor(1);
  j->calculateTransforms();
  const btScalar angle = j->getAngle(1);
  bool seen = false;
  for (const int side : {-1, 1}) {  // one of them is that which the bodies turn towards
    limit->m_loLimit = angle + scalar(side < 0 ? 0.001 : -1);
    limit->m_hiLimit = angle + scalar(side < 0 ? 1 : -0.001);
    limit->m_bounce = 0;
    w.probeAny("without bounce");
    limit->m_bounce = scalar(0.9);
    seen = w.probeAny("m_bounce") || seen;
  }
  EXPECT_TRUE(seen);
}

// Of the solver that Bullet had before 2.76.
API_CASE(RotationalLimitMotor, Alone, NoStep()) {
  const Two t = twoBodies(w);
  btRotationalLimitMotor motor;
  motor.m_loLimit = scalar(-0.1);
  motor.m_hiLimit = scalar(0.1);
  LOG(motor.testLimitValue(scalar(0.3)));
  LOG(motor.m_currentLimitError);
  btVector3 axis = vector(0, 1, 0);
  LOG(motor.solveAngularLimits(scalar(1.0 / 60), axis, scalar(0.4), t.a, t.b));
  LOG(motor.m_accumulatedImpulse);
  const btRotationalLimitMotor copy(motor);
  LOG(copy.m_hiLimit);
  LOG(copy.needApplyTorques());
}

API_CASE(TranslationalLimitMotor, Motor, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  btTranslationalLimitMotor* motor = j->getTranslationalLimitMotor();
  w.probe("no motor");
  motor->m_enableMotor[2] = true;
  motor->m_targetVelocity[2] = scalar(1);
  motor->m_maxMotorForce[2] = scalar(10);
  w.probe("m_enableMotor");
  motor->m_targetVelocity[2] = scalar(-2);
  w.probe("m_targetVelocity");
  motor->m_maxMotorForce[2] = scalar(3);
  w.probe("m_maxMotorForce");
  motor->m_normalCFM[2] = scalar(0.1);
  w.probeSame("m_normalCFM: only by setParam");
  LOG(motor->needApplyForce(2));
}

API_CASE(TranslationalLimitMotor, Limit, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited<btGeneric6DofConstraint>(w, t);
  btTranslationalLimitMotor* limit = j->getTranslationalLimitMotor();
  w.probe("as made");
  for (int k = 0; k < 3; ++k) {
    LOG(limit->m_currentLimit[k]);
    LOG(limit->isLimited(k));
  }
  LOG(limit->m_currentLimitError);
  LOG(limit->m_currentLinearDiff);
  limit->m_lowerLimit[1] = scalar(0.1);
  limit->m_upperLimit[1] = scalar(0.12);
  w.probe("m_lowerLimit, m_upperLimit");
  j->setParam(BT_CONSTRAINT_STOP_ERP, scalar(0.5), 1);
  w.probe("m_stopERP by setParam");
  limit->m_stopERP[1] = scalar(0.9);
  w.probe("m_stopERP");
  j->setParam(BT_CONSTRAINT_STOP_CFM, scalar(0.1), 1);
  w.probe("m_stopCFM by setParam");
  limit->m_stopCFM[1] = scalar(0.4);
  w.probe("m_stopCFM");
  limit->m_damping = scalar(0.2);
  w.probeSame("m_damping");
  limit->m_limitSoftness = scalar(0.2);
  w.probeSame("m_limitSoftness");
  limit->m_restitution = scalar(0.1);
  w.probeSame("m_restitution");
}

API_CASE(TranslationalLimitMotor, Alone, NoStep()) {
  const Two t = twoBodies(w);
  btTranslationalLimitMotor motor;
  motor.m_lowerLimit = vector(-0.1, -0.1, -0.1);
  motor.m_upperLimit = vector(0.1, 0.1, 0.1);
  LOG(motor.testLimitValue(1, scalar(0.3)));
  LOG(motor.solveLinearAxis(scalar(1.0 / 60), scalar(0.4), *t.a, vector(0, 5, 0), *t.b, vector(1, 5, 0), 1,
                            vector(0, 1, 0), vector(0.5, 5, 0)));
  LOG(motor.m_accumulatedImpulse);
  const btTranslationalLimitMotor copy(motor);
  LOG(copy.m_upperLimit);
}

// ---- btGeneric6DofSpringConstraint

API_CASE(SixDofSpring, Constructors, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = limited<btGeneric6DofSpringConstraint>(w, t);
  LOG(j->getConstraintType() == D6_SPRING_CONSTRAINT_TYPE);
  logRows(w, *j);
  w.probe("btGeneric6DofSpringConstraint of two bodies");
  w.objects.remove(j);
  w.objects.joint<btGeneric6DofSpringConstraint>(false, *t.b, t.inB, true);
  w.probe("of one body");
}

API_CASE(SixDofSpring, Springs, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = limited<btGeneric6DofSpringConstraint>(w, t);
  logSerialized(w, *j);
  w.probe("no spring");
  j->enableSpring(2, true);
  j->setStiffness(2, scalar(4000));
  LOG(j->isSpringEnabled(2));
  LOG(j->getStiffness(2));
  w.probe("enableSpring");
  j->setDamping(2, scalar(0.002));
  LOG(j->getDamping(2));
  w.probe("setDamping");
  j->setEquilibriumPoint(2, scalar(0.1));
  LOG(j->getEquilibriumPoint(2));
  w.probe("setEquilibriumPoint of an axis to a value");
  j->setStiffness(2, scalar(800));
  w.probe("setStiffness");
  j->setEquilibriumPoint(2);
  LOG_NEAR(j->getEquilibriumPoint(2));
  w.probe("setEquilibriumPoint of an axis");
  j->setEquilibriumPoint();
  for (int axis = 0; axis < 6; ++axis) LOG_NEAR(j->getEquilibriumPoint(axis));
  j->setAxis(vector(0, 1, 0), vector(1, 0, 0));
  w.probe("setAxis");
  Rows rows;
  j->getInfo2(&rows.info);
}

// ---- btUniversalConstraint

API_CASE(Universal, Angles, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j =
      w.objects.joint<btUniversalConstraint>(false, *t.a, *t.b, t.at.getOrigin(), vector(0, 1, 0), vector(1, 0, 0));
  LOG(j->getAnchor());
  LOG(j->getAnchor2());
  LOG(j->getAxis1());
  LOG(j->getAxis2());
  LOG(j->getAngle1());
  LOG(j->getAngle2());
  w.probe("btUniversalConstraint");
  LOG_NEAR(j->getAngle1());
  j->setLowerLimit(scalar(0.3), scalar(0.3));
  w.probe("setLowerLimit");
  j->setLowerLimit(scalar(-1), scalar(-1));
  w.probe("setLowerLimit");
  j->setUpperLimit(scalar(-0.3), scalar(-0.3));
  w.probe("setUpperLimit");
  j->setAxis(vector(0, 0, 1), vector(1, 0, 0));
  w.probe("setAxis");
}

}  // namespace btgpu::test::api
