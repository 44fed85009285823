// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"
#include "../lib/motion.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/motion_wide.h"
#endif

static float4 zero3(void) { return vec3(0.0f, 0.0f, 0.0f); }

STRUCT(Factors) { DampingFactor linear, angular; };

static BodyStep stepOf(uint flags, BodyPose pose, BodyVelocity velocity, BodyForces force, BodyMass mass,
                       BodyDamping damping, __global const StepParams* params, REF(Factors) factors) {
  const float timeStep = params->timeStep;
  const float inverseMass = mass.inverseInertiaLocal.w;
  float4 linear = velocity.linear, angular = velocity.angular;
  if (!solverHasVelocity(flags, inverseMass)) linear = angular = zero3();
  if ((flags & BODY_INTEGRATED) && !isStaticOrKinematic(flags)) {
    applyDamping(damping, flags, timeStep, &factors->linear, &factors->angular, &linear, &angular);
  }

  BodyStep step;
  step.externalLinear = step.externalAngular = zero3();
  step.inverseInertia0 = step.inverseInertia1 = step.inverseInertia2 = zero3();
  const int moves = solverMoves(flags, mass.inverseInertiaLocal);
  if (moves) {
    const Matrix3 rotation = matrixFromQuaternion(pose.orientation);
    const Matrix3 inverseInertia = worldTensor(rotation, mass.inverseInertiaLocal);
    step.inverseInertia0 = inverseInertia.row0;
    step.inverseInertia1 = inverseInertia.row1;
    step.inverseInertia2 = inverseInertia.row2;
    step.externalLinear = xyz(force.force) * (inverseMass * timeStep);
    step.externalAngular = mulMatrix(inverseInertia, force.torque) * timeStep;
    // Bullet's convertBodies sees only bodies that are in an island.
    if (inverseMass != 0.0f && !isStaticOrKinematic(flags)) {
      step.externalAngular += gyroscopicChange(flags, rotation, mass.inverseInertiaLocal, inverseInertia, angular,
                                               timeStep, params->maxGyroscopicForce);
    }
  }
  const BodyPose predicted = integratePose(pose, linear, angular, timeStep);
  step.linearVelocity = withW(linear, moves ? inverseMass : 0.0f);
  step.angularVelocity = withW(angular, moves ? 1.0f : 0.0f);
  step.predictedPosition = predicted.position;
  step.predictedOrientation = predicted.orientation;
  return step;
}

#ifdef BTGPU_SHAPE_CPU

#define STEP_STRIDE ((uint)(sizeof(BodyStep) / 16))

// stepOf() of BTGPU_WIDE neighbours, whose arrays begin here. Returns the lanes that it is not right for: with additional
// damping, or other gyroscopic terms than Bullet's default.
WIDE LaneMask stepsOf(__global const BodyInfo* infos, __global const BodyPose* poses,
                      __global const BodyVelocity* velocities, __global const BodyForces* forces,
                      __global const BodyMass* masses, __global const BodyDamping* dampings,
                      __global const StepParams* params, Factors* factors, __global BodyStep* steps) {
  const float timeStep = params->timeStep;
  const int16 flags = as_int16(gatherEvery((__global const float4*)infos, sizeof(BodyInfo) / 16).y);
  const WidePose pose = loadPoses(poses);
  const Lanes4 inverseInertiaLocal = gatherEvery(&masses->inverseInertiaLocal, sizeof(BodyMass) / 16);
  const Lanes inverseMass = inverseInertiaLocal.w, zero = (Lanes)0.0f;
  const LaneMask hasVelocity = solverHasVelocityWide(flags, inverseMass);
  Lanes3 linear = xyzWide(gatherEvery(&velocities->linear, sizeof(BodyVelocity) / 16));
  Lanes3 angular = xyzWide(gatherEvery(&velocities->angular, sizeof(BodyVelocity) / 16));
  linear = pick3(hasVelocity, linear, zeroWide());
  angular = pick3(hasVelocity, angular, zeroWide());
  const LaneMask dynamic = ~isStaticOrKinematicWide(flags), damped = anyBit(flags, BODY_INTEGRATED) & dynamic;
  const Lanes4 damping = gatherEvery((__global const float4*)dampings, sizeof(BodyDamping) / 16);
  linear = timesWide(linear, dampingFactorWide(pick(damped, damping.x, zero), timeStep, &factors->linear));
  angular = timesWide(angular, dampingFactorWide(pick(damped, damping.y, zero), timeStep, &factors->angular));

  const LaneMask moves = solverMovesWide(flags, inverseInertiaLocal);
  const WideMatrix rotation = matrixFromQuaternionWide(pose.orientation);
  const WideMatrix inverseInertia = worldTensorWide(rotation, xyzWide(inverseInertiaLocal));
  const Lanes3 force = xyzWide(gatherEvery(&forces->force, sizeof(BodyForces) / 16));
  const Lanes3 torque = xyzWide(gatherEvery(&forces->torque, sizeof(BodyForces) / 16));
  const Lanes3 externalLinear = timesWide(force, inverseMass * timeStep);
  Lanes3 externalAngular = timesWide(mulMatrixWide(inverseInertia, torque), (Lanes)timeStep);
  const LaneMask turns = (inverseMass != 0.0f) & dynamic;
  const LaneMask gyro = turns & anyBit(flags, BODY_GYRO_IMPLICIT_BODY);
  if (anyLane(gyro)) {
    const Lanes3 change =
        gyroscopicChangeInBodyWide(rotation, xyzWide(inverseInertiaLocal), angular, timeStep);
    externalAngular = pick3(gyro, addWide(externalAngular, change), externalAngular);
  }
  // What the other bodies get added is zero, with a sign.
  externalAngular = pick3(turns & ~gyro, addWide(externalAngular, zeroWide()), externalAngular);
  const WidePose predicted = integratePoseWide(pose, linear, angular, timeStep);

  scatterEvery(&steps->linearVelocity, STEP_STRIDE, linear, pick(moves, inverseMass, zero));
  scatterEvery(&steps->angularVelocity, STEP_STRIDE, angular, pick(moves, (Lanes)1.0f, zero));
  scatterEvery(&steps->externalLinear, STEP_STRIDE, pick3(moves, externalLinear, zeroWide()), zero);
  scatterEvery(&steps->externalAngular, STEP_STRIDE, pick3(moves, externalAngular, zeroWide()), zero);
  scatterEvery(&steps->inverseInertia0, STEP_STRIDE, pick3(moves, inverseInertia.row0, zeroWide()), zero);
  scatterEvery(&steps->inverseInertia1, STEP_STRIDE, pick3(moves, inverseInertia.row1, zeroWide()), zero);
  scatterEvery(&steps->inverseInertia2, STEP_STRIDE, pick3(moves, inverseInertia.row2, zeroWide()), zero);
  scatterEvery(&steps->predictedPosition, STEP_STRIDE, predicted.position, zero);
  scatterEvery(&steps->predictedOrientation, STEP_STRIDE, xyzWide(predicted.orientation), predicted.orientation.w);
  return (damped & anyBit(flags, BODY_ADDITIONAL_DAMPING)) |
         (moves & turns & anyBit(flags, BODY_GYRO_EXPLICIT | BODY_GYRO_IMPLICIT_WORLD));
}

#endif

// Damps the velocities, finds what forces and the gyroscopic term add in this step, the world inertia, and the
// pose at the end of the step if nothing is touched. Reads the state, writes only steps[].
KERNEL applyForces(uint bodyCount, __global const StepParams* params, __global const BodyInfo* infos,
                   __global const BodyPose* poses, __global const BodyVelocity* velocities,
                   __global const BodyForces* forces, __global const BodyMass* masses,
                   __global const BodyDamping* dampings, __global BodyStep* steps) {
  Factors factors = {{0.0f, 1.0f}, {0.0f, 1.0f}};
#ifdef BTGPU_SHAPE_CPU
  FOR_EACH_BLOCK(first, bodyCount) {
    const uint end = min(bodyCount, first + BTGPU_WIDE);
    LaneMask odd = (LaneMask)(-1);
    if (first + BTGPU_WIDE == end) {
      odd = stepsOf(infos + first, poses + first, velocities + first, forces + first, masses + first, dampings + first,
                    params, &factors, steps + first);
      if (!anyLane(odd)) continue;
    }
    int isOdd[BTGPU_WIDE];
    vstore16(odd, 0, isOdd);
    for (uint i = first; i < end; ++i) {
      if (!isOdd[i - first]) continue;
      steps[i] = stepOf(infos[i].flags, poses[i], velocities[i], forces[i], masses[i], dampings[i], params, &factors);
    }
  }
#else
  FOR_EACH(i, bodyCount) {
    steps[i] = stepOf(infos[i].flags, poses[i], velocities[i], forces[i], masses[i], dampings[i], params, &factors);
  }
#endif
}
