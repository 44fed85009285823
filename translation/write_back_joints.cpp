// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "write_back_joints.h"

#include <cfloat>
#include <cmath>

#include "../gpu_engine/zone.h"
#include "convert.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kGrain = 256;  // joints

void addFeedback(btJointFeedback& f, const btTypedConstraint& constraint, const JointRow& row, btScalar impulse,
                 btScalar timeStep) {
  const btRigidBody& a = constraint.getRigidBodyA();
  const btRigidBody& b = constraint.getRigidBodyB();
  const btScalar force = impulse / timeStep;
  f.m_appliedForceBodyA += toBullet(row.linearA) * a.getLinearFactor() * force;
  f.m_appliedForceBodyB += toBullet(row.linearB) * b.getLinearFactor() * force;
  f.m_appliedTorqueBodyA += toBullet(row.angularA) * a.getAngularFactor() * force;
  f.m_appliedTorqueBodyB += toBullet(row.angularB) * b.getAngularFactor() * force;
}

void writeBackJoint(btTypedConstraint& constraint, const Joint& joint, const std::vector<JointRow>& rows,
                    const std::vector<float>& impulses, btScalar timeStep) {
  constraint.internalSetAppliedImpulse(btScalar(0));
  btJointFeedback* feedback = constraint.getJointFeedback();
  if (feedback) {
    feedback->m_appliedForceBodyA.setZero();
    feedback->m_appliedForceBodyB.setZero();
    feedback->m_appliedTorqueBodyA.setZero();
    feedback->m_appliedTorqueBodyB.setZero();
  }
  // The device's limit is the threshold as a float.
  const float breaking = static_cast<float>(btMin(constraint.getBreakingImpulseThreshold(), btScalar(FLT_MAX)));
  for (uint r = joint.firstRow; r < joint.firstRow + joint.rowCount; ++r) {
    if (feedback) addFeedback(*feedback, constraint, rows[r], btScalar(impulses[r]), timeStep);
    constraint.internalSetAppliedImpulse(btScalar(impulses[r]));
    if (std::fabs(impulses[r]) >= breaking) constraint.setEnabled(false);
  }
}

}  // namespace

void writeBackJoints(btDiscreteDynamicsWorld& world, const JointReader& joints, const WorldInput& input,
                     const StepResults& results, btScalar timeStep) {
  const Zone zone("writeBackJoints");
  const std::vector<btTypedConstraint*>& constraints = joints.constraints();
  // A callback of the application may have taken joints out of the world while the device worked.
  const auto isInWorld = [&world](const btTypedConstraint* constraint, std::size_t i) {
    const int position = static_cast<int>(i);
    if (position < world.getNumConstraints() && world.getConstraint(position) == constraint) return true;
    for (int k = 0; k < world.getNumConstraints(); ++k) {
      if (world.getConstraint(k) == constraint) return true;
    }
    return false;
  };
  const auto isDue = [&](std::size_t i) { return results.jointSolved[i] && isInWorld(constraints[i], i); };
  const auto writeBack = [&](std::size_t i) {
    writeBackJoint(*constraints[i], input.joints[i], input.jointRows, results.jointImpulses, timeStep);
  };
  // Several joints may share what they report to: those come afterwards, one by one.
  std::vector<char> reporting(chunkCount(constraints.size(), kGrain), 0);
  const bool atOnce = joints.areDistinct();
  const auto waits = [&](std::size_t i) { return !atOnce || constraints[i]->getJointFeedback(); };
  parallelChunks(constraints.size(), kGrain, [&](std::size_t chunk, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (!isDue(i)) continue;
      if (waits(i)) {
        reporting[chunk] = 1;
      } else {
        writeBack(i);
      }
    }
  });
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    if (reporting[i / kGrain] && isDue(i) && waits(i)) writeBack(i);
  }
}

BTGPU_TRANSLATION_END
