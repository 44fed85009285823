// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/compat/api/joint_case.h"

namespace btgpu::test::api {
namespace {

btConeTwistConstraint* cone(Lab& w, const Two& t) {
  return w.objects.joint<btConeTwistConstraint>(false, *t.a, *t.b, t.inA,
                                                t.inB * btTransform(btQuaternion(vector(0, 1, 0), scalar(0.5))));
}

}  // namespace

API_CASE(ConeTwist, Constructors, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<btConeTwistConstraint>(false, *t.a, *t.b, t.inA, t.inB);
  const btConeTwistConstraint& read = *j;
  LOG(j->getConstraintType() == CONETWIST_CONSTRAINT_TYPE);
  LOG(w.number(&read.getRigidBodyA()));
  LOG(w.number(&read.getRigidBodyB()));
  logFrames(w, j->getAFrame(), j->getBFrame());
  w.probe("btConeTwistConstraint of two bodies");
  w.objects.remove(j);
  w.objects.joint<btConeTwistConstraint>(false, *t.b, t.inB);
  w.probe("of one body");
}

API_CASE(ConeTwist, Frames, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = cone(w, t);
  w.probe("as made");
  j->setFrames(t.inA * turned(0, 0.1, 0), t.inB * turned(0.1, 0, 0));
  logFrames(w, j->getFrameOffsetA(), j->getFrameOffsetB());
  w.probe("setFrames");
  LOG(j->getAngularOnly());
  j->setAngularOnly(true);
  LOG(j->getAngularOnly());
  w.probeSame("setAngularOnly: of the solver before 2.76");
}

API_CASE(ConeTwist, Limits, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = cone(w, t);
  w.probe("as made");
  j->setLimit(scalar(0.3), scalar(0.25), scalar(0.2), scalar(0.9), scalar(0.4), scalar(0.8));
  LOG(j->getSwingSpan1());
  LOG(j->getSwingSpan2());
  LOG(j->getTwistSpan());
  LOG(j->getLimitSoftness());
  LOG(j->getBiasFactor());
  LOG(j->getRelaxationFactor());
  w.probe("setLimit");
  LOG(j->getSolveTwistLimit());
  LOG(j->getSolveSwingLimit());
  LOG(j->getTwistLimitSign());
  LOG(j->isPastSwingLimit());
  LOG(j->getTwistAngle());
  for (const int axis : {3, 4, 5}) {
    j->setLimit(axis, scalar(0.05 * axis - 0.1));
    LOG(j->getLimit(axis));
  }
  w.probe("setLimit of an axis");
  j->calcAngleInfo();
  LOG_NEAR(j->getTwistAngle());
  j->calcAngleInfo2(t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform(), t.a->getInvInertiaTensorWorld(),
                    t.b->getInvInertiaTensorWorld());
  LOG_NEAR(j->getTwistAngle());
  LOG_NEAR(j->GetPointForAngle(scalar(0.3), 2));
}

API_CASE(ConeTwist, Motor, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = cone(w, t);
  w.probe("no motor");
  j->enableMotor(true);
  LOG(j->isMotorEnabled());
  j->setMaxMotorImpulse(scalar(0.1));
  LOG(j->getMaxMotorImpulse());
  LOG(j->isMaxMotorImpulseNormalized());
  j->setMotorTarget(btQuaternion(vector(0, 0, 1), scalar(0.3)));
  LOG_NEAR(j->getMotorTarget());
  w.probe("setMotorTarget");
  j->setMotorTargetInConstraintSpace(btQuaternion(vector(0, 1, 0), scalar(0.2)));
  LOG(j->getMotorTarget());
  w.probe("setMotorTargetInConstraintSpace");
  j->setMaxMotorImpulse(scalar(0.01));
  w.probe("setMaxMotorImpulse");
  j->setMaxMotorImpulseNormalized(scalar(0.4));
  LOG(j->isMaxMotorImpulseNormalized());
  w.probe("setMaxMotorImpulseNormalized");
  LOG(j->getDamping());
  j->setDamping(scalar(0.5));
  LOG(j->getDamping());
  w.probeSame("setDamping: of the damping without a motor");
  j->enableMotor(false);
  LOG(j->getFixThresh());
  j->setFixThresh(scalar(0.2));
  LOG(j->getFixThresh());
  w.probe("enableMotor(false)");
}

API_CASE(ConeTwist, Parameters, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = cone(w, t);
  j->setLimit(scalar(0.3), scalar(0.25), scalar(0.2));
  logSerialized(w, *j);
  w.probe("as made");
  j->setParam(BT_CONSTRAINT_ERP, scalar(0.6), 0);
  LOG(j->getParam(BT_CONSTRAINT_ERP, 0));
  LOG((j->getFlags() & BT_CONETWIST_FLAGS_LIN_ERP) != 0);
  w.probe("BT_CONSTRAINT_ERP");
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.3), 0);
  LOG(j->getParam(BT_CONSTRAINT_CFM, 0));
  LOG((j->getFlags() & BT_CONETWIST_FLAGS_LIN_CFM) != 0);
  w.probe("BT_CONSTRAINT_CFM");
  j->setParam(BT_CONSTRAINT_STOP_CFM, scalar(0.3), 3);
  LOG((j->getFlags() & BT_CONETWIST_FLAGS_ANG_CFM) != 0);
  w.probe("BT_CONSTRAINT_CFM of an angle");
}

API_CASE(ConeTwist, SolverCalls, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = cone(w, t);
  j->setLimit(scalar(0.3), scalar(0.25), scalar(0.2));
  logRows(w, *j);
  btTypedConstraint::btConstraintInfo1 info1{};
  j->getInfo1NonVirtual(&info1);
  LOG(info1.m_numConstraintRows);
  Rows rows;
  j->getInfo2NonVirtual(&rows.info, t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform(),
                        t.a->getInvInertiaTensorWorld(), t.b->getInvInertiaTensorWorld());
  rows.logTo(w, "row");
  j->updateRHS(scalar(1.0 / 60));
  btSolverBody a, b;
  j->solveConstraintObsolete(a, b, scalar(1.0 / 60));  // returns at once, unless a file says that it is old
  w.step();
}

}  // namespace btgpu::test::api
