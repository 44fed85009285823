// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What tests of the facade share: everything that a step leaves in a body, and what a world says about
// itself.
#pragma once

#include <cfloat>
#include <cstring>

#include "tests/support/test_world.h"

namespace btgpu::test {

// All that an application can read of a body after a step.
struct BodyState {
  btTransform transform, interpolation;
  btVector3 linear, angular, interpolationLinear, interpolationAngular;
  btMatrix3x3 inverseInertiaWorld;
  btVector3 force, torque;
  btScalar deactivationTime, hitFraction;
  int activation;
};

inline BodyState stateOf(const btRigidBody& b) {
  return {b.getWorldTransform(),
          b.getInterpolationWorldTransform(),
          b.getLinearVelocity(),
          b.getAngularVelocity(),
          b.getInterpolationLinearVelocity(),
          b.getInterpolationAngularVelocity(),
          b.getInvInertiaTensorWorld(),
          b.getTotalForce(),
          b.getTotalTorque(),
          b.getDeactivationTime(),
          b.getHitFraction(),
          b.getActivationState()};
}

inline double distance(const btVector3& a, const btVector3& b) { return double((a - b).length()); }
inline double distance(const btMatrix3x3& a, const btMatrix3x3& b) {
  return std::max({distance(a[0], b[0]), distance(a[1], b[1]), distance(a[2], b[2])});
}

// Equal within `tolerance` in each number; activation states exactly.
inline void expectNear(const BodyState& a, const BodyState& b, double tolerance, const std::string& what) {
  EXPECT_LE(distance(a.transform.getOrigin(), b.transform.getOrigin()), tolerance) << what << ": position";
  EXPECT_LE(distance(a.transform.getBasis(), b.transform.getBasis()), tolerance) << what << ": orientation";
  EXPECT_LE(distance(a.interpolation.getOrigin(), b.interpolation.getOrigin()), tolerance)
      << what << ": interpolation position";
  EXPECT_LE(distance(a.interpolation.getBasis(), b.interpolation.getBasis()), tolerance)
      << what << ": interpolation orientation";
  EXPECT_LE(distance(a.linear, b.linear), tolerance) << what << ": linear velocity";
  EXPECT_LE(distance(a.angular, b.angular), tolerance) << what << ": angular velocity";
  EXPECT_LE(distance(a.interpolationLinear, b.interpolationLinear), tolerance)
      << what << ": interpolation linear velocity";
  EXPECT_LE(distance(a.interpolationAngular, b.interpolationAngular), tolerance)
      << what << ": interpolation angular velocity";
  EXPECT_LE(distance(a.inverseInertiaWorld, b.inverseInertiaWorld), tolerance) << what << ": inverse inertia";
  EXPECT_LE(distance(a.force, b.force), tolerance) << what << ": force";
  EXPECT_LE(distance(a.torque, b.torque), tolerance) << what << ": torque";
  EXPECT_NEAR(double(a.deactivationTime), double(b.deactivationTime), tolerance) << what << ": deactivation time";
  EXPECT_EQ(a.hitFraction, b.hitFraction) << what << ": hit fraction";
  EXPECT_EQ(a.activation, b.activation) << what << ": activation state";
}

// The same bits, as a world on the stock path has to have.
inline void expectSame(const BodyState& a, const BodyState& b, const std::string& what) { expectNear(a, b, 0, what); }

// Rounding of float poses and velocities of size `scale` over a number of steps: each is rounded at most four
// times a step (velocity change, product with the time step, sum, quaternion to matrix), each time by half a
// unit.
inline double floatNoise(int steps, double scale) { return 4.0 * steps * 0.5 * double(FLT_EPSILON) * scale; }

// The entry of the report that names `what`; its count is 0 if there is none.
inline btGpuFallback reported(const btGpuDynamicsWorld& world, const std::string& what) {
  for (const auto& f : world.fallbackReport()) {
    if (f.m_what == what) return f;
  }
  return {};
}

inline std::string reportText(const btGpuDynamicsWorld& world) {
  std::string text;
  for (const auto& f : world.fallbackReport())
    text += f.m_what + ": " + f.m_reason + " (" + std::to_string(f.m_count) + ")\n";
  return text;
}

}  // namespace btgpu::test
