// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What all joints have in common, point to point, gear and contact constraints.
#include <BulletDynamics/ConstraintSolver/btContactConstraint.h>

#include "tests/compat/api/joint_case.h"

namespace btgpu::test::api {
namespace {

btPoint2PointConstraint* ball(Lab& w, const Two& t) {
  return w.objects.joint<btPoint2PointConstraint>(false, *t.a, *t.b, t.inA.getOrigin(),
                                                  t.inB.getOrigin() + vector(0.05, -0.02, 0.01));
}

// Brakes the spin of one body, or of two against each other, about z.
class Brake : public btTypedConstraint {
 public:
  explicit Brake(btRigidBody& a) : btTypedConstraint(FIXED_CONSTRAINT_TYPE, a) {}
  Brake(btRigidBody& a, btRigidBody& b) : btTypedConstraint(FIXED_CONSTRAINT_TYPE, a, b) {}
  void getInfo1(btConstraintInfo1* info) override {
    info->m_numConstraintRows = 1;
    info->nub = 5;
  }
  void getInfo2(btConstraintInfo2* info) override {
    info->m_J1angularAxis[2] = 1;
    info->m_J2angularAxis[2] = -1;
    info->m_constraintError[0] = info->fps * info->erp * scalar(0.01);
    *info->cfm = scalar(0.001);
    info->m_lowerLimit[0] = scalar(-0.2);
    info->m_upperLimit[0] = scalar(0.2);
  }
  void setParam(int, btScalar value, int) override { m_parameter = value; }
  btScalar getParam(int, int) const override { return m_parameter; }

 private:
  btScalar m_parameter = 0;
};

// Looks on while the solver works.
class Onlooker : public btPoint2PointConstraint {
 public:
  using btPoint2PointConstraint::btPoint2PointConstraint;
  int calls = 0;
  void solveConstraintObsolete(btSolverBody&, btSolverBody&, btScalar) override { ++calls; }
};

class OwnContactConstraint : public btContactConstraint {
 public:
  OwnContactConstraint(btPersistentManifold* manifold, btRigidBody& a, btRigidBody& b)
      : btContactConstraint(manifold, a, b) {}
  // Bullet's own getInfo1 leaves its argument as it is: in stock, whatever the memory held.
  void getInfo1(btConstraintInfo1* info) override { info->m_numConstraintRows = info->nub = 0; }
  void setParam(int, btScalar, int) override {}
  btScalar getParam(int, int) const override { return 0; }
};

}  // namespace

API_CASE(TypedConstraint, OwnClass, Shares("joints")) {
  const Two t = twoBodies(w);
  w.probe("free");
  auto* one = w.objects.joint<Brake>(false, *t.a);
  one->setParam(BT_CONSTRAINT_ERP, scalar(0.5), -1);
  LOG(one->getParam(BT_CONSTRAINT_ERP, -1));
  logRows(w, *one);
  LOG(&one->getRigidBodyB() == &btTypedConstraint::getFixedBody());
  LOG(btTypedConstraint::getFixedBody().getInvMass());
  w.probe("btTypedConstraint of one body");
  auto* both = w.objects.joint<Brake>(false, *t.a, *t.b);
  logRows(w, *both);
  w.probe("btTypedConstraint of two bodies");
}

API_CASE(TypedConstraint, UserData, Shares("joints")) {
  const Two t = twoBodies(w);
  btTypedConstraint* j = ball(w, t);
  const btTypedConstraint& read = *j;
  LOG(j->getUserConstraintType());
  LOG(j->getUserConstraintId());
  j->setUserConstraintType(7);
  j->setUserConstraintId(11);
  LOG(j->getUid());
  LOG(j->getDbgDrawSize());
  j->setDbgDrawSize(scalar(0.4));
  LOG(w.number(&j->getRigidBodyA()));
  LOG(w.number(&read.getRigidBodyB()));
  LOG(j->getConstraintType());
  LOG(j->getConstraintType() == POINT2POINT_CONSTRAINT_TYPE);
  w.step(2);
  LOG(j->getUserConstraintType());
  LOG(j->getUserConstraintId());
  LOG(j->getUid());
  LOG(j->getDbgDrawSize());
  int own = 0;
  j->setUserConstraintPtr(&own);
  w.step();
  LOG(j->getUserConstraintPtr() == &own);
}

API_CASE(TypedConstraint, Feedback, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = ball(w, t);
  btJointFeedback feedback;
  LOG(j->needsFeedback());
  j->enableFeedback(true);
  LOG(j->needsFeedback());
  j->setJointFeedback(&feedback);
  LOG(j->getJointFeedback() == &feedback);
  LOG(static_cast<const btTypedConstraint*>(j)->getJointFeedback() == &feedback);
  w.step();
  // Forces: impulses, of bodies of up to 2 kg, over 1/60 s.
  w.log.near("force on A", feedback.m_appliedForceBodyA, 120);
  w.log.near("torque on A", feedback.m_appliedTorqueBodyA, 120);
  w.log.near("force on B", feedback.m_appliedForceBodyB, 120);
  w.log.near("torque on B", feedback.m_appliedTorqueBodyB, 120);
  w.log.near("impulse", j->getAppliedImpulse(), 2);
  w.log.near("impulse", j->internalGetAppliedImpulse(), 2);
  j->internalSetAppliedImpulse(scalar(0.25));
  LOG(j->internalGetAppliedImpulse());
  w.step();
  w.log.near("impulse", j->getAppliedImpulse(), 2);
  w.world.getSolverInfo().m_jointFeedbackInWorldSpace = true;
  w.step();
  w.log.near("force on A", feedback.m_appliedForceBodyA, 120);
  w.world.getSolverInfo().m_jointFeedbackInJointFrame = true;
  w.step();
  w.log.near("force on A", feedback.m_appliedForceBodyA, 120);
  j->setJointFeedback(nullptr);
  w.step();
}

API_CASE(TypedConstraint, EnabledAndBreaking, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = ball(w, t);
  LOG(j->isEnabled());
  LOG(j->getBreakingImpulseThreshold());
  w.probe("joined");
  j->setEnabled(false);
  LOG(j->isEnabled());
  w.probe("setEnabled(false)");
  j->setEnabled(true);
  w.probe("setEnabled(true)");
  LOG(j->getOverrideNumSolverIterations());
  j->setOverrideNumSolverIterations(1);
  LOG(j->getOverrideNumSolverIterations());
  w.probe("setOverrideNumSolverIterations(1)");
  j->setOverrideNumSolverIterations(50);
  w.probe("setOverrideNumSolverIterations(50)");
  j->setOverrideNumSolverIterations(-1);
  j->setBreakingImpulseThreshold(scalar(0.01));
  LOG(j->getBreakingImpulseThreshold());
  w.probe("breaks at the end of the step");
  LOG(j->isEnabled());
  w.probe("broken");
}

// The solver's own calls, which do nothing in the base class.
API_CASE(TypedConstraint, SolverCalls, Shares("joints")) {
  const Two t = twoBodies(w);
  btTypedConstraint* j = ball(w, t);
  btConstraintArray rows;
  btSolverBody a, b;
  j->btTypedConstraint::buildJacobian();
  j->setupSolverConstraint(rows, 0, 1, scalar(1.0 / 60));
  j->solveConstraintObsolete(a, b, scalar(1.0 / 60));
  LOG(rows.size());
  w.step();
}

API_CASE(TypedConstraint, CalledInTheSolver, StockPath("joint that overrides solveConstraintObsolete")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<Onlooker>(false, *t.a, t.inA.getOrigin());
  w.step(2);
  LOG(j->calls);
}

API_CASE(TypedConstraint, Serialized, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = ball(w, t);
  j->setUserConstraintId(3);
  std::vector<char> record(size_t(j->btTypedConstraint::calculateSerializeBufferSize()));
  btDefaultSerializer serializer;
  LOG(j->btTypedConstraint::serialize(record.data(), &serializer));
  LOG(hexOf(record.data(), record.size()));
  w.step();
}

// ---- btPoint2PointConstraint

API_CASE(Point2Point, Pivots, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = ball(w, t);
  LOG(j->getPivotInA());
  LOG(j->getPivotInB());
  logRows(w, *j);
  w.probe("btPoint2PointConstraint");
  j->setPivotA(vector(0.3, 0.1, 0.2));
  LOG(j->getPivotInA());
  w.probe("setPivotA");
  j->setPivotB(vector(-0.4, 0.2, 0.1));
  LOG(j->getPivotInB());
  w.probe("setPivotB");
  w.objects.remove(j);
  w.objects.joint<btPoint2PointConstraint>(false, *t.b, vector(0.1, 0.2, 0.3));
  w.probe("btPoint2PointConstraint to the world");
}

API_CASE(Point2Point, Parameters, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = ball(w, t);
  logSerialized(w, *j);
  w.probe("as made");
  LOG(j->getFlags());
  j->setParam(BT_CONSTRAINT_ERP, scalar(0.7), -1);
  LOG(j->getParam(BT_CONSTRAINT_ERP, -1));
  LOG((j->getFlags() & BT_P2P_FLAGS_ERP) != 0);
  w.probe("BT_CONSTRAINT_ERP");
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.1), -1);
  LOG(j->getParam(BT_CONSTRAINT_CFM, -1));
  LOG((j->getFlags() & BT_P2P_FLAGS_CFM) != 0);
  w.probe("BT_CONSTRAINT_CFM");
  j->m_setting.m_impulseClamp = scalar(0.05);
  w.probe("m_impulseClamp");
  j->m_setting.m_damping = scalar(0.6);
  w.probe("m_damping");
  j->m_setting.m_tau = scalar(0.9);
  w.probeSame("m_tau");
  LOG(j->m_useSolveConstraintObsolete);
  LOG(btConstraintSetting().m_tau);
}

API_CASE(Point2Point, SolverCalls, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = ball(w, t);
  logRows(w, *j);
  btTypedConstraint::btConstraintInfo1 info1{};
  j->getInfo1NonVirtual(&info1);
  LOG(info1.m_numConstraintRows);
  Rows rows;
  j->getInfo2NonVirtual(&rows.info, t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform());
  rows.logTo(w, "row");
  j->updateRHS(scalar(1.0 / 60));
  w.step();
}

// ---- btGearConstraint

API_CASE(Gear, Ratio, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<btGearConstraint>(false, *t.a, *t.b, vector(0, 1, 0), vector(0, 0, 1), scalar(0.7));
  logRows(w, *j);
  LOG(j->getConstraintType() == GEAR_CONSTRAINT_TYPE);
  logSerialized(w, *j);
  w.probe("btGearConstraint");
  j->setRatio(scalar(-2));
  LOG(j->getRatio());
  w.probe("setRatio");
  btVector3 axis = vector(1, 0, 0);
  j->setAxisA(axis);
  LOG(j->getAxisA());
  w.probe("setAxisA");
  j->setAxisB(axis);
  LOG(j->getAxisB());
  w.probe("setAxisB");
  btTypedConstraint::btConstraintInfo1 info1{};
  j->getInfo1(&info1);
  Rows rows;
  j->getInfo2(&rows.info);
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.5), -1);  // a gear has none
  LOG(j->getParam(BT_CONSTRAINT_CFM, -1));
  w.probeSame("setParam");
}

// ---- btContactConstraint: an application's own, on a manifold of its own. It has no rows.

API_CASE(ContactConstraint, HasNoRows, Shares("joints")) {
  const Two t = twoBodies(w);
  btPersistentManifold manifold;
  auto* j = w.objects.joint<OwnContactConstraint>(false, &manifold, *t.a, *t.b);
  LOG(j->getConstraintType() == CONTACT_CONSTRAINT_TYPE);
  LOG(j->getContactManifold()->getNumContacts());
  j->setContactManifold(&manifold);
  LOG(static_cast<const OwnContactConstraint*>(j)->getContactManifold()->getNumContacts());
  j->buildJacobian();
  btTypedConstraint::btConstraintInfo1 info1{};
  j->btContactConstraint::getInfo1(&info1);
  LOG(info1.m_numConstraintRows);
  Rows rows;
  j->getInfo2(&rows.info);
  rows.logTo(w, "row");
  w.step();
}

}  // namespace btgpu::test::api
