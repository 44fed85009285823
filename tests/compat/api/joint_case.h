// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the cases of joints share: two bodies to join, the rows of a joint, its record in a file.
#pragma once

#include <array>

#include "tests/compat/api/api_case.h"

namespace btgpu::test::api {

// Two free boxes that move, and a frame between them. Probes start from here.
struct Two {
  btRigidBody *a = nullptr, *b = nullptr;
  btTransform at, inA, inB;
};
inline Two twoBodies(Lab& w, bool atRest = false) {
  Two t;
  addJointBodies(w.objects, t.a, t.b);
  if (atRest) {
    for (btRigidBody* body : {t.a, t.b}) {
      body->setLinearVelocity(vector(0, 0, 0));
      body->setAngularVelocity(vector(0, 0, 0));
    }
  }
  t.at = frameBetween(*t.a, *t.b);
  t.inA = frameIn(*t.a, t.at);
  t.inB = frameIn(*t.b, t.at);
  w.start();
  return t;
}

// Room for what getInfo2 writes, as the solver lays it out.
struct Rows {
  static constexpr int kMost = 12, kSkip = 24;
  std::array<btScalar, kMost * kSkip> numbers{};
  btTypedConstraint::btConstraintInfo2 info{};

  Rows() {
    info.fps = 60;
    info.erp = scalar(0.2);
    info.m_J1linearAxis = &numbers[0];
    info.m_J1angularAxis = &numbers[4];
    info.m_J2linearAxis = &numbers[8];
    info.m_J2angularAxis = &numbers[12];
    info.m_constraintError = &numbers[16];
    info.cfm = &numbers[17];
    info.m_lowerLimit = &numbers[18];
    info.m_upperLimit = &numbers[19];
    info.rowskip = kSkip;
    info.m_numIterations = 10;
    info.m_damping = 1;
    for (int row = 0; row < kMost; ++row) {
      info.m_lowerLimit[row * kSkip] = -SIMD_INFINITY;
      info.m_upperLimit[row * kSkip] = SIMD_INFINITY;
    }
  }
  void logTo(Lab& w, const std::string& what) const {
    for (int i = 0; i < kMost * kSkip; ++i) {
      if (numbers[size_t(i)] != 0) w.log.exact(what + " " + std::to_string(i), numbers[size_t(i)]);
    }
    LOG(info.m_damping);
    LOG(info.m_numIterations);
  }
};

// As the solver asks for them.
inline void logRows(Lab& w, btTypedConstraint& joint) {
  joint.buildJacobian();
  btTypedConstraint::btConstraintInfo1 info1{};
  joint.getInfo1(&info1);
  LOG(info1.m_numConstraintRows);
  LOG(info1.nub);
  Rows rows;
  if (info1.m_numConstraintRows > 0) joint.getInfo2(&rows.info);
  rows.logTo(w, "row");
}

// The joint's record in a .bullet file. Pointers become numbers there, in the order in which they come up.
inline void logSerialized(Lab& w, const btTypedConstraint& joint) {
  std::vector<char> record(size_t(joint.calculateSerializeBufferSize()));
  btDefaultSerializer serializer;
  LOG(joint.calculateSerializeBufferSize());
  LOG(joint.serialize(record.data(), &serializer));
  LOG(hexOf(record.data(), record.size()));
}

inline void logFrames(Lab& w, const btTransform& a, const btTransform& b) {
  LOG(a);
  LOG(b);
}

// What btGeneric6DofConstraint and btGeneric6DofSpring2Constraint both have, without a base that has it.
template <typename SixDof>
void logPose(Lab& w, SixDof& j) {
  j.calculateTransforms();
  LOG(j.getCalculatedTransformA());
  LOG(j.getCalculatedTransformB());
  for (int k = 0; k < 3; ++k) {
    LOG(j.getAxis(k));
    LOG(j.getAngle(k));
    LOG(j.getRelativePivotPosition(k));
  }
}

template <typename SixDof>
void probeLimits(Lab& w, SixDof& j) {
  btVector3 limit(0, 0, 0);
  j.getLinearLowerLimit(limit);
  LOG(limit);
  j.getLinearUpperLimit(limit);
  LOG(limit);
  j.getAngularLowerLimit(limit);
  LOG(limit);
  j.getAngularUpperLimit(limit);
  LOG(limit);
  for (int axis = 0; axis < 6; ++axis) LOG(j.isLimited(axis));
  w.probe("as made");
  j.setLinearLowerLimit(vector(0, 0.3, 1));
  w.probe("setLinearLowerLimit");
  j.setLinearUpperLimit(vector(0, 0.5, -1));
  w.probe("setLinearUpperLimit");
  j.setAngularLowerLimit(vector(0, 0.3, 1));
  w.probe("setAngularLowerLimit");
  j.setAngularUpperLimit(vector(0, 0.4, -1));
  w.probe("setAngularUpperLimit");
}

inline btTransform turned(double x, double y, double z) {
  return btTransform(btQuaternion(scalar(x), scalar(y), scalar(z)), vector(0.02, -0.01, 0.03));
}

}  // namespace btgpu::test::api
