// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_settings.h"

#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>

BTGPU_TRANSLATION_BEGIN

StepSettings readSettings(btDiscreteDynamicsWorld& world, btScalar timeStep) {
  const btContactSolverInfo& info = world.getSolverInfo();
  const auto f = [](btScalar v) { return static_cast<float>(v); };
  const auto mode = [&info](int flag) { return (info.m_solverMode & flag) != 0; };
  StepSettings s;
  s.timeStep = f(timeStep);
  s.iterations = info.m_numIterations;
  s.erp2 = f(info.m_erp2);
  s.globalCfm = f(info.m_globalCfm);
  s.sor = f(info.m_sor);
  s.splitImpulse = info.m_splitImpulse != 0;
  s.splitImpulsePenetrationThreshold = f(info.m_splitImpulsePenetrationThreshold);
  s.splitImpulseTurnErp = f(info.m_splitImpulseTurnErp);
  s.linearSlop = f(info.m_linearSlop);
  s.warmStartingFactor = f(info.m_warmstartingFactor);
  s.restitutionVelocityThreshold = f(info.m_restitutionVelocityThreshold);
  s.maxGyroscopicForce = f(info.m_maxGyroscopicForce);
  s.frictionErp = f(info.m_frictionERP);
  s.oneIsland = !world.getSimulationIslandManager()->getSplitIslands();
  s.warmStarting = mode(SOLVER_USE_WARMSTARTING);
  s.twoFrictionDirections = mode(SOLVER_USE_2_FRICTION_DIRECTIONS);
  s.frictionDirectionCaching = mode(SOLVER_ENABLE_FRICTION_DIRECTION_CACHING);
  s.velocityDependentFriction = !mode(SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION);
  s.interleaveContactAndFriction = mode(SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS);
  s.contactBreakingThreshold = f(gContactBreakingThreshold);
  s.deactivationTime = f(gDeactivationTime);
  s.disableDeactivation = gDisableDeactivation;
  s.wakeByContact = world.getDispatchInfo().m_deterministicOverlappingPairs;
  s.useContinuous = world.getDispatchInfo().m_useContinuous;
  s.forceUpdateAllAabbs = world.getForceUpdateAllAabbs();
  return s;
}

BTGPU_TRANSLATION_END
