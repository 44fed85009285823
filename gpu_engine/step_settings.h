// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Settings of one step, read anew each step. The names and defaults are Bullet's (btContactSolverInfo,
// btDispatcherInfo, and the globals named in the comments).
#pragma once

#include "../kernels/shared/step.h"

namespace btgpu {

struct StepSettings {
  float timeStep = 1.0f / 60.0f;
  int iterations = 10;
  float erp2 = 0.2f, globalCfm = 0.0f, sor = 1.0f;
  bool splitImpulse = true;
  float splitImpulsePenetrationThreshold = -0.04f, splitImpulseTurnErp = 0.1f;
  float linearSlop = 0.0f, warmStartingFactor = 0.85f;
  float restitutionVelocityThreshold = 0.2f, maxGyroscopicForce = 100.0f;
  bool warmStarting = true;                   // SOLVER_USE_WARMSTARTING
  bool twoFrictionDirections = false;         // SOLVER_USE_2_FRICTION_DIRECTIONS
  bool frictionDirectionCaching = false;      // SOLVER_ENABLE_FRICTION_DIRECTION_CACHING
  bool velocityDependentFriction = true;      // not SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION
  bool interleaveContactAndFriction = false;  // SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS
  float contactBreakingThreshold = 0.02f;     // gContactBreakingThreshold
  float deactivationTime = 2.0f;              // gDeactivationTime
  bool disableDeactivation = false;           // gDisableDeactivation
  bool useContinuous = true;                  // btDispatcherInfo::m_useContinuous
  bool forceUpdateAllAabbs = true;            // btCollisionWorld::getForceUpdateAllAabbs
  bool wakeByContact = false;   // m_deterministicOverlappingPairs: kinematic bodies wake only what they touch
  bool hostActivation = false;  // the host advances the sleep timers after the step (a world with actions)
  bool contacts = false;        // StepResults::contactKeys and ::contacts are wanted
  bool allContacts = false;     // ... with those that did not change since the last step
  bool keepContacts = false;    // StepResults::matchedManifolds and ::manifolds are wanted (comparison, fallback)
};

}  // namespace btgpu
