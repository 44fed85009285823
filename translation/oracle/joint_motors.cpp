// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "joint_motors.h"

BTGPU_TRANSLATION_BEGIN
namespace {

struct Reader {
  static constexpr bool kWrites = false;
  std::vector<btScalar>& to;
  template <typename Setting>
  void operator()(Setting& setting) {
    to.push_back(btScalar(setting));
  }
};

struct Writer {
  static constexpr bool kWrites = true;
  const std::vector<btScalar>& from;
  size_t next = 0;
  template <typename Setting>
  void operator()(Setting& setting) {
    setting = static_cast<Setting>(from[next++]);
  }
};

// Each passes all settings to `access`.

template <typename Access>
void visit(btHingeConstraint& hinge, Access& access) {
  bool on = hinge.getEnableAngularMotor();
  btScalar velocity = hinge.getMotorTargetVelocity(), impulse = hinge.getMaxMotorImpulse();
  access(on);
  access(velocity);
  access(impulse);
  if (!Access::kWrites) return;
  hinge.enableAngularMotor(on, velocity, impulse);
}

template <typename Access>
void visit(btSliderConstraint& slider, Access& access) {
  bool linear = slider.getPoweredLinMotor(), angular = slider.getPoweredAngMotor();
  btScalar linearVelocity = slider.getTargetLinMotorVelocity(), linearForce = slider.getMaxLinMotorForce();
  btScalar angularVelocity = slider.getTargetAngMotorVelocity(), angularForce = slider.getMaxAngMotorForce();
  access(linear);
  access(linearVelocity);
  access(linearForce);
  access(angular);
  access(angularVelocity);
  access(angularForce);
  if (!Access::kWrites) return;
  slider.setPoweredLinMotor(linear);
  slider.setTargetLinMotorVelocity(linearVelocity);
  slider.setMaxLinMotorForce(linearForce);
  slider.setPoweredAngMotor(angular);
  slider.setTargetAngMotorVelocity(angularVelocity);
  slider.setMaxAngMotorForce(angularForce);
}

template <typename Access>
void visit(btConeTwistConstraint& cone, Access& access) {
  bool on = cone.isMotorEnabled(), normalized = cone.isMaxMotorImpulseNormalized();
  btScalar impulse = cone.getMaxMotorImpulse();
  btQuaternion target = cone.getMotorTarget();
  access(on);
  access(normalized);
  access(impulse);
  for (int i = 0; i < 4; ++i) access(target[i]);
  if (!Access::kWrites) return;
  cone.enableMotor(on);
  if (normalized) {
    cone.setMaxMotorImpulseNormalized(impulse);
  } else {
    cone.setMaxMotorImpulse(impulse);
  }
  cone.setMotorTargetInConstraintSpace(target);
}

template <typename Access>
void visit(btGeneric6DofConstraint& joint, Access& access) {
  btTranslationalLimitMotor& linear = *joint.getTranslationalLimitMotor();
  for (int i = 0; i < 3; ++i) {
    access(linear.m_enableMotor[i]);
    access(linear.m_targetVelocity[i]);
    access(linear.m_maxMotorForce[i]);
    btRotationalLimitMotor& angular = *joint.getRotationalLimitMotor(i);
    access(angular.m_enableMotor);
    access(angular.m_targetVelocity);
    access(angular.m_maxMotorForce);
  }
}

template <typename Access>
void visit(btGeneric6DofSpring2Constraint& joint, Access& access) {
  btTranslationalLimitMotor2& linear = *joint.getTranslationalLimitMotor();
  for (int i = 0; i < 3; ++i) {
    access(linear.m_enableMotor[i]);
    access(linear.m_targetVelocity[i]);
    access(linear.m_maxMotorForce[i]);
    access(linear.m_servoMotor[i]);
    access(linear.m_servoTarget[i]);
    btRotationalLimitMotor2& angular = *joint.getRotationalLimitMotor(i);
    access(angular.m_enableMotor);
    access(angular.m_targetVelocity);
    access(angular.m_maxMotorForce);
    access(angular.m_servoMotor);
    access(angular.m_servoTarget);
  }
}

template <typename Access>
void visitMotors(btTypedConstraint& joint, Access& access) {
  if (auto* hinge = dynamic_cast<btHingeConstraint*>(&joint)) return visit(*hinge, access);
  if (auto* slider = dynamic_cast<btSliderConstraint*>(&joint)) return visit(*slider, access);
  if (auto* cone = dynamic_cast<btConeTwistConstraint*>(&joint)) return visit(*cone, access);
  if (auto* generic = dynamic_cast<btGeneric6DofConstraint*>(&joint)) return visit(*generic, access);
  if (auto* spring = dynamic_cast<btGeneric6DofSpring2Constraint*>(&joint)) return visit(*spring, access);
}

}  // namespace

std::vector<btScalar> motorsOf(btTypedConstraint& joint) {
  std::vector<btScalar> motors;
  Reader reader{motors};
  visitMotors(joint, reader);
  return motors;
}

void setMotors(btTypedConstraint& joint, const std::vector<btScalar>& motors) {
  if (motors.empty()) return;
  Writer writer{motors};
  visitMotors(joint, writer);
}

BTGPU_TRANSLATION_END
