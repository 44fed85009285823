// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"
#include "../lib/motion.h"

static int changedState(int state, int wanted) {
  return state == STATE_DISABLE_DEACTIVATION || state == STATE_DISABLE_SIMULATION ? state : wanted;
}

// Bullet's updateDeactivation: time spent slow, or back to zero.
static BodyActivation countTime(BodyActivation a, BodyVelocity v, BodyDamping d, float timeStep) {
  if (a.state == STATE_SLEEPING || a.state == STATE_DISABLE_DEACTIVATION) return a;
  if (lengthSqr3(v.linear) < d.linearSleepingThreshold * d.linearSleepingThreshold &&
      lengthSqr3(v.angular) < d.angularSleepingThreshold * d.angularSleepingThreshold) {
    a.deactivationTime += timeStep;
  } else {
    a.deactivationTime = 0.0f;
    a.state = changedState(a.state, STATE_UNSET);
  }
  return a;
}

static int wantsSleeping(BodyActivation a, StepParams p) {
  if (a.state == STATE_DISABLE_DEACTIVATION) return 0;
  if ((p.flags & STEP_DISABLE_DEACTIVATION) || p.deactivationTime == 0.0f) return 0;
  return a.state == STATE_SLEEPING || a.state == STATE_WANTS_DEACTIVATION || a.deactivationTime > p.deactivationTime;
}

// Advances the sleep timers and commits the activation states (btDiscreteDynamicsWorld::updateActivationState).
// With actions in the world the host does this afterwards, since they may change velocities.
KERNEL updateActivation(uint bodyCount, __global const StepParams* params, __global const StepCounters* counters,
                        __global const BodyInfo* infos, __global const BodyDamping* dampings,
                        __global const BodyActivation* stepActivations, __global BodyVelocity* velocities,
                        __global BodyActivation* activations) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams p = *params;
  FOR_EACH(i, bodyCount) {
    BodyActivation a = stepActivations[i];
    const uint flags = infos[i].flags;
    if ((flags & BODY_INTEGRATED) && !(flags & BODY_QUARANTINED) && !(p.flags & STEP_HOST_ACTIVATION)) {
      a = countTime(a, velocities[i], dampings[i], p.timeStep);
      if (!wantsSleeping(a, p)) {
        if (a.state != STATE_DISABLE_DEACTIVATION) a.state = changedState(a.state, STATE_ACTIVE);
      } else if (isStaticOrKinematic(flags)) {
        a.state = changedState(a.state, STATE_SLEEPING);
      } else if (a.state == STATE_ACTIVE) {
        a.state = STATE_WANTS_DEACTIVATION;
      } else if (a.state == STATE_SLEEPING) {
        velocities[i].linear = velocities[i].angular = vec3(0.0f, 0.0f, 0.0f);
      }
    }
    activations[i] = a;
  }
}
