// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/compat/api/joint_case.h"

namespace btgpu::test::api {
namespace {

btHingeConstraint* hinge(Lab& w, const Two& t) {
  return w.objects.joint<btHingeConstraint>(false, *t.a, *t.b, t.inA * turned(0.1, 0.05, 0), t.inB, false);
}

}  // namespace

API_CASE(Hinge, Constructors, Shares("joints")) {
  const Two t = twoBodies(w);
  const btVector3 axis = vector(0, 0, 1), other = vector(0.1, 0, 1).normalized();
  const btVector3 pivotA = t.inA.getOrigin(), pivotB = t.inB.getOrigin();
  auto* j = w.objects.joint<btHingeConstraint>(false, *t.a, *t.b, pivotA, pivotB, axis, other, false);
  w.probe("btHingeConstraint: pivots and axes of two bodies");
  logFrames(w, j->getAFrame(), j->getBFrame());
  w.objects.remove(j);
  j = w.objects.joint<btHingeConstraint>(false, *t.a, pivotA, axis, true);
  w.probe("pivot and axis of one body");
  logFrames(w, j->getAFrame(), j->getBFrame());
  w.objects.remove(j);
  j = w.objects.joint<btHingeConstraint>(false, *t.a, *t.b, t.inA, t.inB, true);
  w.probe("frames of two bodies");
  w.objects.remove(j);
  w.objects.joint<btHingeConstraint>(false, *t.a, t.inA, false);
  w.probe("frame of one body");
}

API_CASE(Hinge, Bodies, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = hinge(w, t);
  const btHingeConstraint& read = *j;
  LOG(w.number(&j->getRigidBodyA()));
  LOG(w.number(&j->getRigidBodyB()));
  LOG(w.number(&read.getRigidBodyA()));
  LOG(w.number(&read.getRigidBodyB()));
  LOG(j->getConstraintType() == HINGE_CONSTRAINT_TYPE);
  logFrames(w, read.getAFrame(), read.getBFrame());
  w.step();
}

API_CASE(Hinge, Frames, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = hinge(w, t);
  w.probe("as made");
  j->setFrames(t.inA * turned(0, 0.1, 0), t.inB * turned(0.1, 0, 0));
  logFrames(w, j->getFrameOffsetA(), j->getFrameOffsetB());
  w.probe("setFrames");
  j->getFrameOffsetA() = t.inA;
  w.probe("getFrameOffsetA");
  j->getFrameOffsetB() = t.inB * turned(0.05, 0, 0.05);
  w.probe("getFrameOffsetB");
  j->getAFrame() = t.inA * turned(0.02, 0.03, 0);
  w.probe("getAFrame");
  j->getBFrame() = t.inB;
  w.probe("getBFrame");
  btVector3 axis = vector(0.2, 1, 0).normalized();
  j->setAxis(axis);
  w.probe("setAxis");
  LOG(j->getUseFrameOffset());
  j->setUseFrameOffset(!j->getUseFrameOffset());
  LOG(j->getUseFrameOffset());
  w.probe("setUseFrameOffset");
  LOG(j->getUseReferenceFrameA());
  j->setUseReferenceFrameA(true);
  LOG(j->getUseReferenceFrameA());
  w.probeSame("setUseReferenceFrameA: of limits and motors, and there are none");
  LOG(j->getAngularOnly());
  j->setAngularOnly(true);
  LOG(j->getAngularOnly());
  w.probe("setAngularOnly");
}

API_CASE(Hinge, Motor, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = hinge(w, t);
  w.probe("no motor");
  j->enableAngularMotor(true, scalar(2), scalar(0.02));
  LOG(j->getEnableAngularMotor());
  LOG(j->getMotorTargetVelocity());
  LOG(j->getMaxMotorImpulse());
  w.probe("enableAngularMotor");
  j->setMaxMotorImpulse(scalar(0.05));
  LOG(j->getMaxMotorImpulse());
  w.probe("setMaxMotorImpulse");
  j->setMotorTargetVelocity(scalar(-3));
  LOG(j->getMotorTargetVelocity());
  w.probe("setMotorTargetVelocity");
  j->enableMotor(false);
  LOG(j->getEnableAngularMotor());
  w.probe("enableMotor(false)");
  j->enableMotor(true);
  // An angle is turned into a velocity when it is set, from the poses of that moment: the start's, so that it is exact.
  w.probe("enableMotor(true)");
  j->setMaxMotorImpulse(1);
  w.start();
  j->setMotorTarget(scalar(0.4), scalar(0.1));
  w.log.near("velocity for an angle", j->getMotorTargetVelocity(), 10);
  w.step();
  j->setMotorTarget(btQuaternion(vector(0, 0, 1), scalar(-0.3)), scalar(0.2));
  w.log.near("velocity for a rotation", j->getMotorTargetVelocity(), 10);
  w.step();
}

API_CASE(Hinge, Limit, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = hinge(w, t);
  LOG(j->hasLimit());
  LOG(j->getLowerLimit());
  LOG(j->getUpperLimit());
  LOG(j->getHingeAngle());
  LOG(j->getHingeAngle(t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform()));
  w.probe("no limit");
  j->setLimit(scalar(0.1), scalar(0.5), scalar(0.8), scalar(0.4), scalar(0.6));
  LOG(j->hasLimit());
  LOG(j->getLowerLimit());
  LOG(j->getUpperLimit());
  LOG(j->getLimitSoftness());
  LOG(j->getLimitBiasFactor());
  LOG(j->getLimitRelaxationFactor());
  w.probe("setLimit");
  LOG(j->getSolveLimit());
  LOG(j->getLimitSign());
  j->testLimit(t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform());
  LOG(j->getSolveLimit());
  j->setLimit(scalar(0.1), scalar(0.5), scalar(0.8), scalar(0.4), scalar(0.1));
  w.probe("relaxation factor");
  j->setLimit(scalar(-1), scalar(1));
  w.probe("within the limit");
}

API_CASE(Hinge, Parameters, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = hinge(w, t);
  j->setLimit(scalar(0.1), scalar(0.5));
  logSerialized(w, *j);
  w.probe("as made");
  LOG(j->getFlags());
  j->setParam(BT_CONSTRAINT_ERP, scalar(0.6), -1);
  LOG(j->getParam(BT_CONSTRAINT_ERP, -1));
  LOG((j->getFlags() & BT_HINGE_FLAGS_ERP_NORM) != 0);
  w.probe("BT_CONSTRAINT_ERP");
  j->setParam(BT_CONSTRAINT_STOP_ERP, scalar(0.9), 5);
  LOG(j->getParam(BT_CONSTRAINT_STOP_ERP, 5));
  LOG((j->getFlags() & BT_HINGE_FLAGS_ERP_STOP) != 0);
  w.probe("BT_CONSTRAINT_STOP_ERP");
  j->setParam(BT_CONSTRAINT_STOP_CFM, scalar(0.3), 5);
  LOG(j->getParam(BT_CONSTRAINT_STOP_CFM, 5));
  LOG((j->getFlags() & BT_HINGE_FLAGS_CFM_STOP) != 0);
  w.probe("BT_CONSTRAINT_STOP_CFM");
  j->setLimit(1, -1);
  j->enableAngularMotor(true, scalar(2), 1);
  w.probe("motor");
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.3), -1);
  LOG(j->getParam(BT_CONSTRAINT_CFM, -1));
  LOG((j->getFlags() & BT_HINGE_FLAGS_CFM_NORM) != 0);
  w.probe("BT_CONSTRAINT_CFM");
}

API_CASE(Hinge, SolverCalls, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = hinge(w, t);
  j->setLimit(scalar(0.1), scalar(0.5));
  logRows(w, *j);
  btTypedConstraint::btConstraintInfo1 info1{};
  j->getInfo1NonVirtual(&info1);
  LOG(info1.m_numConstraintRows);
  const btTransform &a = t.a->getCenterOfMassTransform(), &b = t.b->getCenterOfMassTransform();
  const btVector3 &turnA = t.a->getAngularVelocity(), &turnB = t.b->getAngularVelocity();
  Rows usual, own, offset;
  j->getInfo2NonVirtual(&usual.info, a, b, turnA, turnB);
  usual.logTo(w, "row");
  j->getInfo2Internal(&own.info, a, b, turnA, turnB);
  own.logTo(w, "row without frame offset");
  j->getInfo2InternalUsingFrameOffset(&offset.info, a, b, turnA, turnB);
  offset.logTo(w, "row with frame offset");
  j->updateRHS(scalar(1.0 / 60));
  w.step();
}

API_CASE(HingeAccumulatedAngle, Angle, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<btHingeAccumulatedAngleConstraint>(false, *t.a, *t.b, t.inA, t.inB, false);
  j->setLimit(scalar(-0.5), scalar(0.05));
  logRows(w, *j);
  LOG(j->getAccumulatedHingeAngle());
  w.probe("as made");
  LOG_NEAR(j->getAccumulatedHingeAngle());
  btTypedConstraint::btConstraintInfo1 info1{};
  j->getInfo1(&info1);
  LOG(info1.m_numConstraintRows);
  j->setAccumulatedHingeAngle(scalar(6.5));
  LOG_NEAR(j->getAccumulatedHingeAngle());
  w.probe("setAccumulatedHingeAngle", 2);
  LOG_NEAR(j->getAccumulatedHingeAngle());
}

API_CASE(HingeAccumulatedAngle, Constructors, Shares("joints")) {
  const Two t = twoBodies(w);
  const btVector3 axis = vector(0, 0, 1), pivotA = t.inA.getOrigin(), pivotB = t.inB.getOrigin();
  auto* j = w.objects.joint<btHingeAccumulatedAngleConstraint>(false, *t.a, *t.b, pivotA, pivotB, axis, axis, false);
  w.probe("pivots and axes of two bodies");
  w.objects.remove(j);
  j = w.objects.joint<btHingeAccumulatedAngleConstraint>(false, *t.a, pivotA, axis, false);
  w.probe("pivot and axis of one body");
  w.objects.remove(j);
  w.objects.joint<btHingeAccumulatedAngleConstraint>(false, *t.b, t.inB, false);
  w.probe("frame of one body");
}

}  // namespace btgpu::test::api
