// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/compat/api/joint_case.h"

namespace btgpu::test::api {
namespace {

// Beyond both limits, and out of its frame a little.
btSliderConstraint* slider(Lab& w, const Two& t) {
  auto* j = w.objects.joint<btSliderConstraint>(false, *t.a, *t.b, t.inA * turned(0.15, 0.05, 0.04), t.inB, true);
  j->setLowerLinLimit(scalar(0.01));
  j->setUpperLinLimit(scalar(0.02));
  j->setLowerAngLimit(scalar(-0.02));
  j->setUpperAngLimit(scalar(0.02));
  return j;
}
// Free to slide and turn, with motors.
btSliderConstraint* freeSlider(Lab& w, const Two& t) {
  auto* j = w.objects.joint<btSliderConstraint>(false, *t.a, *t.b, t.inA * turned(0.15, 0.05, 0.04), t.inB, true);
  j->setLowerLinLimit(1);
  j->setUpperLinLimit(-1);
  j->setLowerAngLimit(1);
  j->setUpperAngLimit(-1);
  return j;
}

}  // namespace

API_CASE(Slider, Constructors, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<btSliderConstraint>(false, *t.a, *t.b, t.inA, t.inB, false);
  const btSliderConstraint& read = *j;
  LOG(j->getConstraintType() == SLIDER_CONSTRAINT_TYPE);
  LOG(w.number(&read.getRigidBodyA()));
  LOG(w.number(&read.getRigidBodyB()));
  LOG(j->getUseLinearReferenceFrameA());
  logFrames(w, read.getFrameOffsetA(), read.getFrameOffsetB());
  w.probe("btSliderConstraint of two bodies");
  w.objects.remove(j);
  w.objects.joint<btSliderConstraint>(false, *t.b, t.inB, true);
  w.probe("of one body");
}

API_CASE(Slider, Frames, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = slider(w, t);
  LOG(j->getCalculatedTransformA());
  LOG(j->getCalculatedTransformB());
  w.probe("as made");
  j->setFrames(t.inA * turned(0, 0.1, 0), t.inB * turned(0.1, 0, 0));
  w.probe("setFrames");
  j->getFrameOffsetA() = t.inA;
  w.probe("getFrameOffsetA");
  j->getFrameOffsetB() = t.inB * turned(0.05, 0, 0.05);
  w.probe("getFrameOffsetB");
  LOG(j->getUseFrameOffset());
  j->setUseFrameOffset(!j->getUseFrameOffset());
  LOG(j->getUseFrameOffset());
  w.probe("setUseFrameOffset");
  j->calculateTransforms(t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform());
  LOG_NEAR(j->getCalculatedTransformA());
  LOG_NEAR(j->getAncorInA());
  LOG_NEAR(j->getAncorInB());
}

API_CASE(Slider, Limits, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = slider(w, t);
  LOG(j->getLowerLinLimit());
  LOG(j->getUpperLinLimit());
  LOG(j->getLowerAngLimit());
  LOG(j->getUpperAngLimit());
  w.probe("as made");
  LOG(j->getSolveLinLimit());
  LOG(j->getSolveAngLimit());
  LOG(j->getLinDepth());
  LOG(j->getAngDepth());
  LOG(j->getLinearPos());
  LOG(j->getAngularPos());
  j->setUpperLinLimit(scalar(-0.05));
  j->setLowerLinLimit(scalar(-0.06));
  w.probe("setLowerLinLimit, setUpperLinLimit");
  j->setLowerAngLimit(scalar(0.3));
  j->setUpperAngLimit(scalar(0.4));
  w.probe("setLowerAngLimit, setUpperAngLimit");
  j->testLinLimits();
  j->testAngLimits();
  LOG(j->getSolveLinLimit());
  LOG(j->getSolveAngLimit());
}

API_CASE(Slider, Motors, Shares("joints")) {
  const Two t = twoBodies(w, true);
  auto* j = freeSlider(w, t);
  w.probe("free");
  j->setPoweredLinMotor(true);
  j->setTargetLinMotorVelocity(scalar(2));
  j->setMaxLinMotorForce(scalar(3));
  LOG(j->getPoweredLinMotor());
  LOG(j->getTargetLinMotorVelocity());
  LOG(j->getMaxLinMotorForce());
  w.probe("linear motor");
  j->setTargetLinMotorVelocity(scalar(-2));
  w.probe("setTargetLinMotorVelocity");
  j->setMaxLinMotorForce(scalar(6));
  w.probe("setMaxLinMotorForce");
  j->setPoweredAngMotor(true);
  j->setTargetAngMotorVelocity(scalar(2));
  j->setMaxAngMotorForce(scalar(1));
  LOG(j->getPoweredAngMotor());
  LOG(j->getTargetAngMotorVelocity());
  LOG(j->getMaxAngMotorForce());
  w.probe("angular motor");
  j->setTargetAngMotorVelocity(scalar(-2));
  w.probe("setTargetAngMotorVelocity");
  j->setMaxAngMotorForce(scalar(2));
  w.probe("setMaxAngMotorForce");
}

API_CASE(Slider, Softness, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = slider(w, t);
  LOG(j->getSoftnessDirLin());
  LOG(j->getSoftnessDirAng());
  LOG(j->getSoftnessLimLin());
  LOG(j->getSoftnessLimAng());
  LOG(j->getSoftnessOrthoLin());
  LOG(j->getSoftnessOrthoAng());
  w.probe("as made");
  j->setSoftnessLimLin(scalar(0.5));
  w.probe("setSoftnessLimLin");
  j->setSoftnessLimAng(scalar(0.5));
  w.probe("setSoftnessLimAng");
  j->setSoftnessOrthoLin(scalar(0.5));
  w.probe("setSoftnessOrthoLin");
  j->setSoftnessOrthoAng(scalar(0.5));
  w.probe("setSoftnessOrthoAng");
  j->setSoftnessDirLin(scalar(0.5));
  w.probeSame("setSoftnessDirLin");
  j->setSoftnessDirAng(scalar(0.5));
  w.probeSame("setSoftnessDirAng");
}

API_CASE(Slider, Restitution, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = slider(w, t);
  LOG(j->getRestitutionDirLin());
  LOG(j->getRestitutionDirAng());
  LOG(j->getRestitutionLimLin());
  LOG(j->getRestitutionLimAng());
  LOG(j->getRestitutionOrthoLin());
  LOG(j->getRestitutionOrthoAng());
  w.probe("as made");
  j->setRestitutionDirLin(scalar(0.3));
  w.probeSame("setRestitutionDirLin");
  j->setRestitutionDirAng(scalar(0.3));
  w.probeSame("setRestitutionDirAng");
  j->setRestitutionLimLin(scalar(0.3));
  w.probeSame("setRestitutionLimLin");
  j->setRestitutionLimAng(scalar(0.3));
  w.probeSame("setRestitutionLimAng");
  j->setRestitutionOrthoLin(scalar(0.3));
  w.probeSame("setRestitutionOrthoLin");
  j->setRestitutionOrthoAng(scalar(0.3));
  w.probeSame("setRestitutionOrthoAng");
}

API_CASE(Slider, Damping, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = w.objects.joint<btSliderConstraint>(false, *t.a, *t.b, t.inA, t.inB, false);
  LOG(j->getDampingDirLin());
  LOG(j->getDampingDirAng());
  LOG(j->getDampingLimLin());
  LOG(j->getDampingLimAng());
  LOG(j->getDampingOrthoLin());
  LOG(j->getDampingOrthoAng());
  j->calculateTransforms(t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform());
  j->testLinLimits();
  j->testAngLimits();
  const btScalar place = j->getLinearPos(), angle = j->getAngularPos();
  bool linear = false, angular = false;
  for (const int side : {-1, 1}) {  // one of them is that which the bodies move towards
    j->setLowerLinLimit(place + scalar(side < 0 ? 0.001 : -1));
    j->setUpperLinLimit(place + scalar(side < 0 ? 1 : -0.001));
    j->setLowerAngLimit(angle + scalar(side < 0 ? 0.001 : -1));
    j->setUpperAngLimit(angle + scalar(side < 0 ? 1 : -0.001));
    j->setDampingLimLin(1);
    j->setDampingLimAng(1);
    w.probeAny("damped");
    j->setDampingLimLin(scalar(0.1));
    linear = w.probeAny("setDampingLimLin") || linear;
    j->setDampingLimAng(scalar(0.1));
    angular = w.probeAny("setDampingLimAng") || angular;
  }
  EXPECT_TRUE(linear);
  EXPECT_TRUE(angular);
  j->setDampingDirLin(scalar(0.5));
  w.probeSame("setDampingDirLin");
  j->setDampingDirAng(scalar(0.5));
  w.probeSame("setDampingDirAng");
  j->setDampingOrthoLin(scalar(0.5));
  w.probeSame("setDampingOrthoLin");
  j->setDampingOrthoAng(scalar(0.5));
  w.probeSame("setDampingOrthoAng");
}

// For each parameter that a slider has: its value, the flag that it sets, and a step.
API_CASE(Slider, Parameters, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = slider(w, t);
  struct Parameter {
    int number, axis, flag;
    bool limits;  // shows in the row of a limit
  };
  const std::vector<Parameter> parameters = {
      {BT_CONSTRAINT_STOP_ERP, 0, BT_SLIDER_FLAGS_ERP_LIMLIN, true},
      {BT_CONSTRAINT_STOP_ERP, 1, BT_SLIDER_FLAGS_ERP_ORTLIN, true},
      {BT_CONSTRAINT_STOP_ERP, 3, BT_SLIDER_FLAGS_ERP_LIMANG, true},
      {BT_CONSTRAINT_STOP_ERP, 4, BT_SLIDER_FLAGS_ERP_ORTANG, true},
      {BT_CONSTRAINT_STOP_CFM, 0, BT_SLIDER_FLAGS_CFM_LIMLIN, true},
      {BT_CONSTRAINT_STOP_CFM, 1, BT_SLIDER_FLAGS_CFM_ORTLIN, true},
      {BT_CONSTRAINT_STOP_CFM, 3, BT_SLIDER_FLAGS_CFM_LIMANG, true},
      {BT_CONSTRAINT_STOP_CFM, 4, BT_SLIDER_FLAGS_CFM_ORTANG, true},
      {BT_CONSTRAINT_CFM, 0, BT_SLIDER_FLAGS_CFM_DIRLIN, false},
      {BT_CONSTRAINT_CFM, 3, BT_SLIDER_FLAGS_CFM_DIRANG, false},
  };
  LOG(j->getFlags());
  logSerialized(w, *j);
  w.probe("as made");
  for (const Parameter& p : parameters) {
    j->setParam(p.number, scalar(0.35), p.axis);
    LOG(j->getParam(p.number, p.axis));
    LOG((j->getFlags() & p.flag) != 0);
    const std::string name = "parameter " + std::to_string(p.number) + " of axis " + std::to_string(p.axis);
    if (p.limits) {
      w.probe(name);
    } else {
      w.probeSame(name);
    }
  }
  // Of motors.
  j->setLowerLinLimit(1);
  j->setUpperLinLimit(-1);
  j->setPoweredLinMotor(true);
  j->setTargetLinMotorVelocity(1);
  j->setMaxLinMotorForce(300);
  w.probe("linear motor");
  j->setParam(BT_CONSTRAINT_CFM, scalar(0.8), 0);
  w.probe("BT_CONSTRAINT_CFM of the motor");
  // Bullet sets these two nowhere.
  LOG((j->getFlags() & (BT_SLIDER_FLAGS_ERP_DIRLIN | BT_SLIDER_FLAGS_ERP_DIRANG)));
}

API_CASE(Slider, SolverCalls, Shares("joints")) {
  const Two t = twoBodies(w);
  auto* j = slider(w, t);
  logRows(w, *j);
  btTypedConstraint::btConstraintInfo1 info1{};
  j->getInfo1NonVirtual(&info1);
  LOG(info1.m_numConstraintRows);
  Rows rows;
  j->getInfo2NonVirtual(&rows.info, t.a->getCenterOfMassTransform(), t.b->getCenterOfMassTransform(),
                        t.a->getLinearVelocity(), t.b->getLinearVelocity(), t.a->getInvMass(), t.b->getInvMass());
  rows.logTo(w, "row");
  w.step();
}

}  // namespace btgpu::test::api
