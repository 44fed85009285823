// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "10_apply_forces_reference.h"

#include <algorithm>

#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kEpsilon = 1.1920929e-7;  // SIMD_EPSILON in a float build of Bullet
constexpr double kQuarterTurn = 0.78539816339744831;

bool isStaticOrKinematic(const BodyInfo& b) { return (b.flags & (BODY_STATIC | BODY_KINEMATIC)) != 0; }

// btSequentialImpulseConstraintSolver::getOrInitSolverBody: rigid bodies with mass and kinematic ones.
bool hasSolverBody(const BodyInfo& b, double inverseMass) {
  if (!(b.flags & BODY_RIGID) || (b.flags & BODY_QUARANTINED)) return false;
  return inverseMass != 0 || (b.flags & BODY_KINEMATIC);
}

// btRigidBody::applyDamping, the part behind m_additionalDamping that stops slow bodies.
Vec slowDown(Vec velocity, double damping) {
  constexpr double kStep = 0.005;
  const double speed = length(velocity);
  if (speed >= damping) return velocity;
  return speed > kStep ? velocity * ((speed - kStep) / speed) : Vec{};
}

void applyDamping(const BodyDamping& d, bool additional, double timeStep, Vec& linear, Vec& angular) {
  linear = linear * std::pow(1 - static_cast<double>(d.linear), timeStep);
  angular = angular * std::pow(1 - static_cast<double>(d.angular), timeStep);
  if (!additional) return;
  if (dot(angular, angular) < d.additionalAngularThresholdSqr && dot(linear, linear) < d.additionalLinearThresholdSqr) {
    linear = linear * d.additionalFactor;
    angular = angular * d.additionalFactor;
  }
  linear = slowDown(linear, d.linear);
  angular = slowDown(angular, d.angular);
}

// btTransformUtil::integrateTransform, the rotation: at most about a quarter turn.
float4 turned(float4 orientation, Vec angular, double timeStep) {
  // Beyond the limit Bullet shortens the angle but not the axis vector, so that is what is scaled here.
  double rate = length(angular);
  if (rate * rate <= kEpsilon) rate = 0;
  rate = std::fmin(rate, kQuarterTurn / timeStep);
  const double half = rate * timeStep / 2;
  const Vec t = angular * (rate > 0 ? std::sin(half) / rate : timeStep / 2);
  const double tw = std::cos(half);
  const Vec o = toVec(orientation);
  const double ow = orientation.w;
  const Vec xyz = o * tw + t * ow + cross(t, o);
  const double w = tw * ow - dot(t, o), size = std::sqrt(dot(xyz, xyz) + w * w);
  return toFloat4(xyz / size, w / size);
}

Vec inverseEach(Vec v) { return {v.x != 0 ? 1 / v.x : 0, v.y != 0 ? 1 / v.y : 0, v.z != 0 ? 1 / v.z : 0}; }

Vec solve(const Matrix& m, Vec b) {
  const double det = determinant(m);
  if (std::fabs(det) <= kEpsilon) return {};
  Vec x;
  for (int k = 0; k < 3; ++k) {
    Matrix replaced = m;
    for (int i = 0; i < 3; ++i) replaced.row[i][k] = b[i];
    x[k] = determinant(replaced) / det;
  }
  return x;
}

// One Newton step of the implicit Euler equation from w, in the axes that the inertia is given in
// (btRigidBody::computeGyroscopicImpulseImplicit_World and _Body).
Vec implicitChange(const Matrix& inertia, Vec w, double timeStep) {
  const Vec momentum = inertia * w;
  const Matrix jacobian = inertia + (crossMatrix(w) * inertia + crossMatrix(momentum) * -1.0) * timeStep;
  return -solve(jacobian, cross(w, momentum) * timeStep);
}

Vec gyroscopicChange(uint flags, const Matrix& r, Vec inverseInertia, Vec w, double timeStep, double limit) {
  const Matrix local = diagonalMatrix(inverseEach(inverseInertia));
  const Matrix world = r * local * transposed(r);
  Vec change;
  if (flags & BODY_GYRO_EXPLICIT) {  // btRigidBody::computeGyroscopicForceExplicit
    Vec torque = cross(w, world * w);
    if (length(torque) > limit) torque = torque * (limit / length(torque));
    change = change - r * diagonalMatrix(inverseInertia) * transposed(r) * torque * timeStep;
  }
  if (flags & BODY_GYRO_IMPLICIT_WORLD) change = change + implicitChange(world, w, timeStep);
  if (flags & BODY_GYRO_IMPLICIT_BODY) change = change + r * implicitChange(local, transposed(r) * w, timeStep);
  return change;
}

BodyStep stepOf(const StepParams& params, const BodyInfo& info, const BodyPose& pose, const BodyVelocity& velocity,
                const BodyForces& forces, const BodyMass& mass, const BodyDamping& damping) {
  const double timeStep = params.timeStep, inverseMass = mass.inverseInertiaLocal.w;
  const Vec inverseInertia = toVec(mass.inverseInertiaLocal);
  const bool hasVelocity = hasSolverBody(info, inverseMass);
  const bool moves = hasVelocity && (inverseMass != 0 || dot(inverseInertia, inverseInertia) != 0);
  Vec linear = hasVelocity ? toVec(velocity.linear) : Vec{};
  Vec angular = hasVelocity ? toVec(velocity.angular) : Vec{};
  if ((info.flags & BODY_INTEGRATED) && !isStaticOrKinematic(info)) {
    applyDamping(damping, info.flags & BODY_ADDITIONAL_DAMPING, timeStep, linear, angular);
  }

  BodyStep step{};
  step.linearVelocity = toFloat4(linear, moves ? inverseMass : 0);
  step.angularVelocity = toFloat4(angular, moves ? 1 : 0);
  step.predictedPosition = toFloat4(toVec(pose.position) + linear * timeStep);
  step.predictedOrientation = turned(pose.orientation, angular, timeStep);
  if (!moves) return step;

  const Matrix r = rotationOf(pose.orientation);
  const Matrix world = r * diagonalMatrix(inverseInertia) * transposed(r);
  step.inverseInertia0 = toFloat4(world.row[0]);
  step.inverseInertia1 = toFloat4(world.row[1]);
  step.inverseInertia2 = toFloat4(world.row[2]);
  step.externalLinear = toFloat4(toVec(forces.force) * inverseMass * timeStep);
  Vec change = world * toVec(forces.torque) * timeStep;
  // btSequentialImpulseConstraintSolver::convertBodies gets the bodies of an island only.
  if (inverseMass != 0 && !isStaticOrKinematic(info)) {
    change = change + gyroscopicChange(info.flags, r, inverseInertia, angular, timeStep, params.maxGyroscopicForce);
  }
  step.externalAngular = toFloat4(change);
  return step;
}

}  // namespace

std::vector<BodyStep> applyForcesReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                                           const std::vector<BodyPose>& poses,
                                           const std::vector<BodyVelocity>& velocities,
                                           const std::vector<BodyForces>& forces, const std::vector<BodyMass>& masses,
                                           const std::vector<BodyDamping>& dampings) {
  std::vector<BodyStep> steps;
  for (size_t i = 0; i < infos.size(); ++i) {
    steps.push_back(stepOf(params, infos[i], poses[i], velocities[i], forces[i], masses[i], dampings[i]));
  }
  return steps;
}

namespace {

// A vector component is a sum of a few products and quotients of vectors of that size: 16 roundings of half
// an ulp.
constexpr double kVectorTolerance = 1e-6;
// OpenCL lets pow be off by 16 ulp; damping multiplies the velocity by it, and everything after that inherits
// it.
constexpr double kPowTolerance = 16 * 1.2e-7;
constexpr double kUlp = 1.2e-7;

// The gyroscopic terms solve a 3x3 system by Cramer's rule: some roundings, more where its condition number, the ratio
// of the inertias, is large.
double gyroTolerance(const BodyMass& mass) {
  const float4 i = mass.inverseInertiaLocal;
  const double most = std::max({i.x, i.y, i.z}), least = std::min({i.x, i.y, i.z});
  const double condition = least > 0 ? most / least : 1;
  return std::max(1.0, condition / 25) * 8 * 2 * kUlp;
}

double sizeOf(float4 v) { return length(toVec(v)); }

void checkVector(Contract& contract, const char* what, float4 device, float4 expected, double limit) {
  contract.near(what, device, expected, limit);
  contract.near("w", device.w, expected.w, 4 * kUlp * std::fabs(expected.w));
}

void checkStep(Contract& c, float timeStep, const BodyMass& mass, const BodyStep& s, const BodyStep& e) {
  const double linear = sizeOf(e.linearVelocity), angular = sizeOf(e.angularVelocity);
  checkVector(c, "linear velocity", s.linearVelocity, e.linearVelocity, kPowTolerance * linear);
  checkVector(c, "angular velocity", s.angularVelocity, e.angularVelocity, kPowTolerance * angular);
  checkVector(c, "external linear", s.externalLinear, e.externalLinear, kVectorTolerance * sizeOf(e.externalLinear));
  checkVector(c, "external angular", s.externalAngular, e.externalAngular,
              gyroTolerance(mass) * (angular + sizeOf(e.externalAngular)));
  const double tensor = sizeOf(e.inverseInertia0) + sizeOf(e.inverseInertia1) + sizeOf(e.inverseInertia2);
  checkVector(c, "inverse inertia, row 0", s.inverseInertia0, e.inverseInertia0, kVectorTolerance * tensor);
  checkVector(c, "inverse inertia, row 1", s.inverseInertia1, e.inverseInertia1, kVectorTolerance * tensor);
  checkVector(c, "inverse inertia, row 2", s.inverseInertia2, e.inverseInertia2, kVectorTolerance * tensor);
  checkVector(c, "predicted position", s.predictedPosition, e.predictedPosition,
              kVectorTolerance * sizeOf(e.predictedPosition) + kPowTolerance * linear * timeStep);
  // The quaternion is of unit size; the angle of a step is at most pi / 4.
  c.near("predicted orientation", s.predictedOrientation, e.predictedOrientation, 2e-6);
  c.near("predicted orientation w", s.predictedOrientation.w, e.predictedOrientation.w, 2e-6);
}

}  // namespace

void checkAppliedForces(Contract& contract, const StepParams& params, const std::vector<BodyMass>& masses,
                        const std::vector<BodyStep>& device, const std::vector<BodyStep>& expected) {
  for (size_t i = 0; i < expected.size(); ++i) {
    contract.at("body {}", i);
    checkStep(contract, params.timeStep, masses[i], device[i], expected[i]);
  }
}

}  // namespace btgpu
