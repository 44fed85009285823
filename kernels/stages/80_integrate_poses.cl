// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"
#include "../lib/motion.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/motion_wide.h"
#endif

static int isFiniteState(BodyPose pose, float4 linear, float4 angular) {
  return isFinite3(pose.position) && isFinite4(pose.orientation) && isFinite3(linear) && isFinite3(angular);
}

// A body that comes out not finite keeps its old pose, loses its velocity and goes into quarantine, so that it can't
// spread.
static void integrateBody(CHECKS uint i, __global const StepParams* params, __global StepCounters* counters,
                          __global const BodyStep* steps, __global const SolverBody* solverBodies,
                          __global const uint* solved, __global const BodyActivation* activations,
                          __global BodyInfo* infos, __global BodyPose* poses, __global BodyVelocity* velocities) {
  const float timeStep = params->timeStep;
  const uint flags = infos[i].flags;
  if (!(flags & BODY_PRESENT) || (flags & BODY_QUARANTINED)) return;
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

#ifdef BTGPU_SHAPE_CPU

WIDE LaneMask isFinite3Wide(Lanes3 v) { return isFiniteWide(v.x) & isFiniteWide(v.y) & isFiniteWide(v.z); }

// integrateBody() of BTGPU_WIDE neighbours, whose arrays begin here. Returns 0, and has written nothing, if one of them
// is not there or comes out not finite.
WIDE int integrateBodies(__global const StepParams* params, __global const BodyStep* steps,
                         __global const SolverBody* solverBodies, __global const uint* solved,
                         __global const BodyActivation* activations, __global const BodyInfo* infos,
                         __global BodyPose* poses, __global BodyVelocity* velocities) {
  const float timeStep = params->timeStep;
  const int16 flags = as_int16(gatherEvery((__global const float4*)infos, sizeof(BodyInfo) / 16).y);
  if (anyLane(~anyBit(flags, BODY_PRESENT) | anyBit(flags, BODY_QUARANTINED))) return 0;
  WidePose pose = loadPoses(poses);
  const LaneMask dynamic = anyBit(flags, BODY_INTEGRATED) & ~isStaticOrKinematicWide(flags);
  const Lanes4 stepAngular = gatherEvery(&steps->angularVelocity, sizeof(BodyStep) / 16);
  Lanes3 linear = xyzWide(gatherEvery(&steps->linearVelocity, sizeof(BodyStep) / 16));
  Lanes3 angular = xyzWide(stepAngular);
  if (anyLane(~dynamic)) {
    linear = pick3(dynamic, linear, xyzWide(gatherEvery(&velocities->linear, sizeof(BodyVelocity) / 16)));
    angular = pick3(dynamic, angular, xyzWide(gatherEvery(&velocities->angular, sizeof(BodyVelocity) / 16)));
  }
  Lanes3 meanLinear = linear, meanAngular = angular;
  const LaneMask moved = (as_int16(vload16(0, solved)) != 0) & (stepAngular.w != 0.0f);
  if (anyLane(moved)) {
    const uint stride = sizeof(SolverBody) / 16;
    const Lanes3 externalLinear = xyzWide(gatherEvery(&steps->externalLinear, sizeof(BodyStep) / 16));
    const Lanes3 externalAngular = xyzWide(gatherEvery(&steps->externalAngular, sizeof(BodyStep) / 16));
    const Lanes3 deltaLinear = xyzWide(gatherEvery(&solverBodies->deltaLinear, stride));
    const Lanes3 deltaAngular = xyzWide(gatherEvery(&solverBodies->deltaAngular, stride));
    const Lanes3 push = xyzWide(gatherEvery(&solverBodies->pushLinear, stride));
    const Lanes3 turn = xyzWide(gatherEvery(&solverBodies->turnAngular, stride));
    linear = pick3(moved, addWide(addWide(linear, deltaLinear), externalLinear), linear);
    angular = pick3(moved, addWide(addWide(angular, deltaAngular), externalAngular), angular);
    const LaneMask means = params->flags & STEP_SUBSTEPS ? moved : (LaneMask)0;
    meanLinear = pick3(means, push, linear);
    meanAngular = pick3(means, turn, angular);
    const LaneMask pushed = moved & ((dotWide(push, push) != 0.0f) | (dotWide(turn, turn) != 0.0f));
    if ((params->flags & (STEP_SPLIT_IMPULSE | STEP_SUBSTEPS)) == STEP_SPLIT_IMPULSE && anyLane(pushed)) {
      const Lanes3 turned = timesWide(turn, (Lanes)params->splitImpulseTurnErp);
      pose = pickPose(pushed, integratePoseWide(pose, push, turned, timeStep), pose);
    }
  }
  int states[BTGPU_WIDE];
  for (int lane = 0; lane < BTGPU_WIDE; ++lane) states[lane] = activations[lane].state;
  const LaneMask active = dynamic & isActiveStateWide(vload16(0, states));
  if (anyLane(active)) pose = pickPose(active, integratePoseWide(pose, meanLinear, meanAngular, timeStep), pose);
  const LaneMask finite = isFinite3Wide(pose.position) & isFinite3Wide(xyzWide(pose.orientation)) &
                          isFiniteWide(pose.orientation.w) & isFinite3Wide(linear) & isFinite3Wide(angular);
  if (anyLane(~finite)) return 0;
#ifdef BTGPU_DEBUG
  const Lanes4 q = pose.orientation;
  if (anyLane(~(fabs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0f) < 1e-3f))) return 0;  // where it is asserted
#endif
  const uint stride = sizeof(BodyPose) / 16;
  if (anyLane(active | moved)) {
    scatterEvery(&poses->position, stride, pose.position, (Lanes)0.0f);
    scatterEvery(&poses->orientation, stride, xyzWide(pose.orientation), pose.orientation.w);
  }
  scatterEvery(&velocities->linear, sizeof(BodyVelocity) / 16, linear, (Lanes)0.0f);
  scatterEvery(&velocities->angular, sizeof(BodyVelocity) / 16, angular, (Lanes)0.0f);
  return 1;
}

#endif

// Commits the step: velocities from the solver, poses corrected by the split impulse and moved for the time step.
// The first kernel of the step that changes the persistent state.
KERNEL integratePoses(CHECKS uint bodyCount, __global const StepParams* params, __global StepCounters* counters,
                      __global const BodyStep* steps, __global const SolverBody* solverBodies,
                      __global const uint* solved, __global const BodyActivation* activations, __global BodyInfo* infos,
                      __global BodyPose* poses, __global BodyVelocity* velocities) {
  RETURN_ON_OVERFLOW(counters);
#ifdef BTGPU_SHAPE_CPU
  FOR_EACH_BLOCK(first, bodyCount) {
    const uint end = min(bodyCount, first + BTGPU_WIDE);
    if (first + BTGPU_WIDE == end &&
        integrateBodies(params, steps + first, solverBodies + first, solved + first, activations + first,
                        infos + first, poses + first, velocities + first)) {
      continue;
    }
    for (uint i = first; i < end; ++i) {
      integrateBody(WITH_CHECKS i, params, counters, steps, solverBodies, solved, activations, infos, poses,
                    velocities);
    }
  }
#else
  FOR_EACH(i, bodyCount) {
    integrateBody(WITH_CHECKS i, params, counters, steps, solverBodies, solved, activations, infos, poses, velocities);
  }
#endif
}
