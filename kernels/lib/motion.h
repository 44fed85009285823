// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Motion of one body: damping, gyroscopic terms and the pose after a time step, with the formulas, limits and
// order of operations of Bullet 2 (btRigidBody, btTransformUtil), so that free motion agrees to float noise.
#ifndef BTGPU_LIB_MOTION_H
#define BTGPU_LIB_MOTION_H
#include "../shared/body.h"
#include "vec.h"

BTGPU_BEGIN

#define MAX_ROTATION_PER_STEP 0.78539816339f  // pi/4: faster spin is clamped
#define SMALL_ANGLE_RATE 0.001f               // below, the sine is replaced by its series
#define ADDITIONAL_DAMPING_SPEED 0.005f       // speed taken off per step by additional damping

// Constant-speed brake of Bullet's additional damping: acts below `limit`, stops the body at the end.
LIB float4 brake(float4 velocity, float limit) {
  const float speed = length3(velocity);
  if (speed >= limit) return velocity;
  if (speed <= ADDITIONAL_DAMPING_SPEED) return vec3(0.0f, 0.0f, 0.0f);
  return velocity - velocity * (ADDITIONAL_DAMPING_SPEED / speed);
}

// What is left of a velocity after a time step, of the damping that was last asked for: powers are dear, and mostly all
// bodies have the same damping.
STRUCT(DampingFactor) { float damping, factor; };

LIB float dampingFactor(float damping, float timeStep, REF(DampingFactor) last) {
  if (damping != last->damping) {
    last->damping = damping;
    last->factor = pow(1.0f - damping, timeStep);
  }
  return last->factor;
}

// `linearFactor`, `angularFactor`: of the body before, or of no damping ({0, 1}).
LIB void applyDamping(BodyDamping d, uint flags, float timeStep, REF(DampingFactor) linearFactor,
                      REF(DampingFactor) angularFactor, REF(float4) linear, REF(float4) angular) {
  if (d.linear != 0.0f) *linear *= dampingFactor(d.linear, timeStep, linearFactor);
  if (d.angular != 0.0f) *angular *= dampingFactor(d.angular, timeStep, angularFactor);
  if (!(flags & BODY_ADDITIONAL_DAMPING)) return;
  if (lengthSqr3(*angular) < d.additionalAngularThresholdSqr && lengthSqr3(*linear) < d.additionalLinearThresholdSqr) {
    *angular *= d.additionalFactor;
    *linear *= d.additionalFactor;
  }
  *linear = brake(*linear, d.linear);
  *angular = brake(*angular, d.angular);
}

// Pose after moving for `timeStep` with constant velocity; rotation by the exponential map.
LIB BodyPose integratePose(BodyPose pose, float4 linear, float4 angular, float timeStep) {
  BodyPose next;
  next.position = xyz(pose.position + linear * timeStep);
  const float rateSqr = lengthSqr3(angular);
  float rate = rateSqr > BTGPU_EPSILON ? sqrt(rateSqr) : 0.0f;
  if (rate * timeStep > MAX_ROTATION_PER_STEP) rate = MAX_ROTATION_PER_STEP / timeStep;
  const float half_ = 0.5f * timeStep;
  const float scale = rate < SMALL_ANGLE_RATE
                          ? half_ - timeStep * timeStep * timeStep * (1.0f / 48.0f) * rate * rate
                          : sin(rate * half_) / rate;
  const float4 turn = withW(angular * scale, cos(rate * half_));
  const float4 q = quaternionProduct(turn, pose.orientation);
  const float lengthSqr = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  // NaN goes on into the pose, where quarantine finds it (Bullet would keep the old orientation and say nothing).
  next.orientation = lengthSqr <= BTGPU_EPSILON ? pose.orientation : q / sqrt(lengthSqr);
  return next;
}

LIB float4 inverseOrZero(float4 v) {
  return vec3(v.x != 0.0f ? 1.0f / v.x : 0.0f, v.y != 0.0f ? 1.0f / v.y : 0.0f, v.z != 0.0f ? 1.0f / v.z : 0.0f);
}

// w x (I w), limited in size: the torque that the explicit flag subtracts.
LIB float4 gyroscopicTorqueExplicit(Matrix3 orientation, float4 inertiaLocal, float4 w, float limit) {
  float4 torque = cross3(w, mulMatrix(worldTensor(orientation, inertiaLocal), w));
  const float sizeSqr = lengthSqr3(torque);
  if (sizeSqr > limit * limit) torque *= limit / sqrt(sizeSqr);
  return torque;
}

// v x as a matrix.
LIB Matrix3 skew(float4 v) {
  Matrix3 m;
  m.row0 = vec3(0.0f, -v.z, v.y);
  m.row1 = vec3(v.z, 0.0f, -v.x);
  m.row2 = vec3(-v.y, v.x, 0.0f);
  return m;
}

LIB Matrix3 product(Matrix3 a, Matrix3 b) {
  Matrix3 m;
  m.row0 = xyz(b.row0 * a.row0.x + b.row1 * a.row0.y + b.row2 * a.row0.z);
  m.row1 = xyz(b.row0 * a.row1.x + b.row1 * a.row1.y + b.row2 * a.row1.z);
  m.row2 = xyz(b.row0 * a.row2.x + b.row1 * a.row2.y + b.row2 * a.row2.z);
  return m;
}

// Euler's equations without torque, one implicit step, one Newton iteration from w:
// f(x) = I (x - w) + dt x X (I x) with Jacobian I + dt (skew(x) I - skew(I x)), evaluated at x = w.
// The tensor and w are in the same axes; returns the change of w.
LIB float4 gyroscopicChangeImplicit(Matrix3 inertia, float4 w, float timeStep) {
  const float4 momentum = mulMatrix(inertia, w);
  const Matrix3 a = product(skew(w), inertia), b = skew(momentum);
  Matrix3 jacobian;
  jacobian.row0 = inertia.row0 + (a.row0 - b.row0) * timeStep;
  jacobian.row1 = inertia.row1 + (a.row1 - b.row1) * timeStep;
  jacobian.row2 = inertia.row2 + (a.row2 - b.row2) * timeStep;
  return -solve3(jacobian, cross3(w, momentum) * timeStep);
}

LIB Matrix3 diagonal(float4 d) {
  Matrix3 m;
  m.row0 = vec3(d.x, 0.0f, 0.0f);
  m.row1 = vec3(0.0f, d.y, 0.0f);
  m.row2 = vec3(0.0f, 0.0f, d.z);
  return m;
}

// Angular velocity change of one step by the gyroscopic flags that the body has set.
LIB float4 gyroscopicChange(uint flags, Matrix3 orientation, float4 inverseInertiaLocal, Matrix3 inverseInertiaWorld,
                            float4 w, float timeStep, float maxTorque) {
  const float4 inertia = inverseOrZero(inverseInertiaLocal);
  float4 change = vec3(0.0f, 0.0f, 0.0f);
  if (flags & BODY_GYRO_EXPLICIT) {
    const float4 torque = gyroscopicTorqueExplicit(orientation, inertia, w, maxTorque);
    change -= mulMatrix(inverseInertiaWorld, torque) * timeStep;
  }
  if (flags & BODY_GYRO_IMPLICIT_WORLD) {
    change += gyroscopicChangeImplicit(worldTensor(orientation, inertia), w, timeStep);
  }
  if (flags & BODY_GYRO_IMPLICIT_BODY) {
    const float4 inBody = gyroscopicChangeImplicit(diagonal(inertia), mulTransposed(orientation, w), timeStep);
    change += mulMatrix(orientation, inBody);
  }
  return xyz(change);
}

// Bullet's solver keeps a body of its own for rigid bodies with mass and for kinematic ones; all others share
// one fixed body without velocity. A kinematic body moves in the solver only if it was left with mass or inertia.
LIB int solverHasVelocity(uint flags, float inverseMass) {
  return (flags & BODY_RIGID) && !(flags & BODY_QUARANTINED) && (inverseMass != 0.0f || (flags & BODY_KINEMATIC));
}
LIB int solverMoves(uint flags, float4 inverseInertiaLocalAndMass) {
  return solverHasVelocity(flags, inverseInertiaLocalAndMass.w) &&
         (inverseInertiaLocalAndMass.w != 0.0f || lengthSqr3(inverseInertiaLocalAndMass) != 0.0f);
}

LIB int isActiveState(int state) {
  return state != STATE_SLEEPING && state != STATE_DISABLE_SIMULATION && state != STATE_FIXED_BASE;
}
LIB int isStaticOrKinematic(uint flags) { return (flags & (BODY_STATIC | BODY_KINEMATIC)) != 0; }

BTGPU_END
#endif
