// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"
#include "../lib/motion.h"

static int isFiniteState(BodyPose pose, float4 linear, float4 angular) {
  return isFinite3(pose.position) && isFinite4(pose.orientation) && isFinite3(linear) && isFinite3(angular);
}

// Commits the step: velocities from the solver, poses corrected by the split impulse and moved for the time step.
// The first kernel of the step that changes the persistent state. A body that comes out not finite keeps its old
// pose, loses its velocity and goes into quarantine, so that it can't spread.
KERNEL integratePoses(CHECKS uint bodyCount, __global const StepParams* params, __global StepCounters* counters,
                      __global const BodyStep* steps, __global const SolverBody* solverBodies,
                      __global const uint* solved, __global const BodyActivation* activations, __global BodyInfo* infos,
                      __global BodyPose* poses, __global BodyVelocity* velocities) {
  RETURN_ON_OVERFLOW(counters);
  const float timeStep = params->timeStep;
  FOR_EACH(i, bodyCount) {
    const uint flags = infos[i].flags;
    if (!(flags & BODY_PRESENT) || (flags & BODY_QUARANTINED)) continue;
    const BodyPose oldPose = poses[i];
    BodyPose pose = oldPose;
    float4 linear = velocities[i].linear, angular = velocities[i].angular;
    float4 meanLinear, meanAngular;  // over the step
    const int dynamic = (flags & BODY_INTEGRATED) && !isStaticOrKinematic(flags);
    if (dynamic) {
      linear = xyz(steps[i].linearVelocity);
      angular = xyz(steps[i].angularVelocity);
    }
    meanLinear = linear;
    meanAngular = angular;
    if (solved[i] && steps[i].angularVelocity.w != 0.0f) {
      const SolverBody s = solverBodies[i];
      linear = xyz(linear + s.deltaLinear + steps[i].externalLinear);
      angular = xyz(angular + s.deltaAngular + steps[i].externalAngular);
      meanLinear = params->flags & STEP_SUBSTEPS ? s.pushLinear : linear;
      meanAngular = params->flags & STEP_SUBSTEPS ? s.turnAngular : angular;
      if ((params->flags & (STEP_SPLIT_IMPULSE | STEP_SUBSTEPS)) == STEP_SPLIT_IMPULSE &&
          (lengthSqr3(s.pushLinear) != 0.0f || lengthSqr3(s.turnAngular) != 0.0f)) {
        pose = integratePose(pose, s.pushLinear, s.turnAngular * params->splitImpulseTurnErp, timeStep);
      }
    }
    if (dynamic && isActiveState(activations[i].state)) pose = integratePose(pose, meanLinear, meanAngular, timeStep);
    if (!isFiniteState(pose, linear, angular)) {
      pose = oldPose;
      linear = angular = vec3(0.0f, 0.0f, 0.0f);
      infos[i].flags = flags | BODY_QUARANTINED;
      atomic_inc(&counters->quarantined);
    }
    ASSERT_FLOATS(!dynamic || !isFinite4(pose.orientation) || isUnit4(pose.orientation), pose.orientation.x,
                  pose.orientation.w);
    poses[i] = pose;
    velocities[i].linear = linear;
    velocities[i].angular = angular;
  }
}
