// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "90_update_activation_reference.h"

namespace btgpu {
namespace {

// btCollisionObject::setActivationState.
void setState(BodyActivation& activation, int state) {
  if (activation.state == STATE_DISABLE_DEACTIVATION || activation.state == STATE_DISABLE_SIMULATION) return;
  activation.state = state;
}

float lengthSqr(float4 v) { return v.x * v.x + v.y * v.y + v.z * v.z; }

// btRigidBody::updateDeactivation.
void updateDeactivation(BodyActivation& a, const BodyVelocity& velocity, const BodyDamping& d, float timeStep) {
  if (a.state == STATE_SLEEPING || a.state == STATE_DISABLE_DEACTIVATION) return;
  const bool slow = lengthSqr(velocity.linear) < d.linearSleepingThreshold * d.linearSleepingThreshold &&
                    lengthSqr(velocity.angular) < d.angularSleepingThreshold * d.angularSleepingThreshold;
  if (slow) {
    a.deactivationTime += timeStep;
  } else {
    a.deactivationTime = 0.0f;
    setState(a, STATE_UNSET);
  }
}

// btRigidBody::wantsSleeping.
bool wantsSleeping(const BodyActivation& a, const StepParams& params) {
  if (a.state == STATE_DISABLE_DEACTIVATION) return false;
  if (params.flags & STEP_DISABLE_DEACTIVATION) return false;
  if (params.deactivationTime == 0.0f) return false;
  if (a.state == STATE_SLEEPING || a.state == STATE_WANTS_DEACTIVATION) return true;
  return a.deactivationTime > params.deactivationTime;
}

void updateBody(const StepParams& params, const BodyInfo& info, const BodyDamping& damping, BodyVelocity& velocity,
                BodyActivation& a) {
  updateDeactivation(a, velocity, damping, params.timeStep);
  if (!wantsSleeping(a, params)) {
    setState(a, STATE_ACTIVE);
    return;
  }
  if (info.flags & (BODY_STATIC | BODY_KINEMATIC)) {
    setState(a, STATE_SLEEPING);
    return;
  }
  if (a.state == STATE_ACTIVE) setState(a, STATE_WANTS_DEACTIVATION);
  if (a.state == STATE_SLEEPING) velocity = {};
}

}  // namespace

void updateActivationReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                               const std::vector<BodyDamping>& dampings, std::vector<BodyVelocity>& velocities,
                               std::vector<BodyActivation>& activations) {
  if (params.flags & STEP_HOST_ACTIVATION) return;
  for (size_t i = 0; i < infos.size(); ++i) {
    if (!(infos[i].flags & BODY_INTEGRATED) || (infos[i].flags & BODY_QUARANTINED)) continue;
    updateBody(params, infos[i], dampings[i], velocities[i], activations[i]);
  }
}

}  // namespace btgpu
