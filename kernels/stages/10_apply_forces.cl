// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"
#include "../lib/motion.h"

static float4 zero3(void) { return vec3(0.0f, 0.0f, 0.0f); }

// Damps the velocities, finds what forces and the gyroscopic term add in this step, the world inertia, and the
// pose at the end of the step if nothing is touched. Reads the state, writes only steps[].
KERNEL applyForces(uint bodyCount, __global const StepParams* params, __global const BodyInfo* infos,
                   __global const BodyPose* poses, __global const BodyVelocity* velocities,
                   __global const BodyForces* forces, __global const BodyMass* masses,
                   __global const BodyDamping* dampings, __global BodyStep* steps) {
  const float timeStep = params->timeStep;
  DampingFactor linearFactor = {0.0f, 1.0f}, angularFactor = {0.0f, 1.0f};
  FOR_EACH(i, bodyCount) {
    const uint flags = infos[i].flags;
    const BodyPose pose = poses[i];
    const BodyMass mass = masses[i];
    const float inverseMass = mass.inverseInertiaLocal.w;
    float4 linear = velocities[i].linear, angular = velocities[i].angular;
    if (!solverHasVelocity(flags, inverseMass)) linear = angular = zero3();
    if ((flags & BODY_INTEGRATED) && !isStaticOrKinematic(flags)) {
      applyDamping(dampings[i], flags, timeStep, &linearFactor, &angularFactor, &linear, &angular);
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
      step.externalLinear = xyz(forces[i].force) * (inverseMass * timeStep);
      step.externalAngular = mulMatrix(inverseInertia, forces[i].torque) * timeStep;
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
    steps[i] = step;
  }
}
