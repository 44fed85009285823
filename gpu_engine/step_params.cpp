// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "step_params.h"

#include <algorithm>

namespace btgpu {

StepParams makeStepParams(const StepSettings& s, bool torsionRows) {
  StepParams p{};
  p.timeStep = s.timeStep;
  p.flags = (s.useContinuous ? STEP_USE_CONTINUOUS : 0u) | (s.forceUpdateAllAabbs ? STEP_FORCE_ALL_AABBS : 0u) |
            (s.splitImpulse ? STEP_SPLIT_IMPULSE : 0u) | (s.warmStarting ? STEP_WARM_START : 0u) |
            (s.twoFrictionDirections ? STEP_TWO_FRICTION : 0u) |
            (s.frictionDirectionCaching ? STEP_FRICTION_CACHING : 0u) |
            (s.velocityDependentFriction ? 0u : STEP_NO_VELOCITY_FRICTION) |
            (s.interleaveContactAndFriction ? STEP_INTERLEAVE : 0u) |
            (s.disableDeactivation ? STEP_DISABLE_DEACTIVATION : 0u) | (torsionRows ? STEP_TORSION : 0u) |
            (s.hostActivation ? STEP_HOST_ACTIVATION : 0u) | (s.wakeByContact ? STEP_WAKE_BY_CONTACT : 0u) |
            (s.solver == Solver::Fast ? STEP_SUBSTEPS : 0u) | (s.oneIsland ? STEP_ONE_ISLAND : 0u) |
            (s.islandRoots ? STEP_ISLAND_ROOTS : 0u);
  p.erp2 = s.erp2;
  p.globalCfm = s.globalCfm;
  p.splitImpulsePenetrationThreshold = s.splitImpulsePenetrationThreshold;
  p.splitImpulseTurnErp = s.splitImpulseTurnErp;
  p.linearSlop = s.linearSlop;
  p.warmStartingFactor = s.warmStartingFactor;
  p.sor = s.sor;
  p.restitutionVelocityThreshold = s.restitutionVelocityThreshold;
  p.maxGyroscopicForce = s.maxGyroscopicForce;
  p.contactThreshold = s.contactBreakingThreshold;
  p.deactivationTime = s.deactivationTime;
  p.substeps = static_cast<uint>(std::max(1, s.substeps));
  p.contactHertz = s.contactHertz;
  p.contactDampingRatio = s.contactDampingRatio;
  p.pushSpeed = s.pushSpeed;
  p.jointHertz = s.jointHertz;
  p.jointDampingRatio = s.jointDampingRatio;
  p.frictionErp = s.frictionErp;
  return p;
}

}  // namespace btgpu
