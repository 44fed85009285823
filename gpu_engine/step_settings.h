// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Settings of one step, read anew each step. The names and defaults are Bullet's (btContactSolverInfo,
// btDispatcherInfo, and the globals named in the comments).
#pragma once

#include <tuple>

#include "../kernels/shared/step.h"

namespace btgpu {

// How contacts and joints are solved (btGpuSettings::m_solver).
enum class Solver : int {
  Parity,         // coloured projected Gauss-Seidel with Bullet's rows
  Fast,           // soft constraints in substeps (soft TGS)
  MassSplitting,  // Jacobi with split masses, the rows as in Parity
  TwoLevel,       // the paper's two-level batching in place of colours, the rows as in Parity
};

// Solver::TwoLevel: what constraints are split into groups by, and what is a launch (kernels/lib/batches.h).
enum class GroupSplit : int { Space, Index };
enum class BatchLaunches : int { Phase, Batch };

// How overlapping AABBs are found (btGpuSettings::m_pairFinder). All find the same pairs.
enum class PairFinder : int { Bvh, Grid, Sweep, IncrementalSweep, BruteForce };

struct StepSettings {
  float timeStep = 1.0f / 60.0f;
  int iterations = 10;
  float erp2 = 0.2f, globalCfm = 0.0f, sor = 1.0f;
  bool splitImpulse = true;
  float splitImpulsePenetrationThreshold = -0.04f, splitImpulseTurnErp = 0.1f;
  float linearSlop = 0.0f, warmStartingFactor = 0.85f;
  float restitutionVelocityThreshold = 0.2f, maxGyroscopicForce = 100.0f;
  float frictionErp = 0.2f;                   // of friction anchors
  bool oneIsland = false;                     // not btSimulationIslandManager::getSplitIslands
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
  PairFinder pairFinder = PairFinder::Bvh;
  Solver solver = Solver::Parity;
  GroupSplit groupSplit = GroupSplit::Index;
  BatchLaunches batchLaunches = BatchLaunches::Phase;
  // Of Solver::Fast only (btGpuSettings::m_fastSubsteps and those that follow it there).
  int substeps = 4;
  float contactHertz = 60.0f, contactDampingRatio = 2.0f, pushSpeed = 3.0f;
  float jointHertz = 60.0f, jointDampingRatio = 2.0f;
  bool islandRoots = false;   // StepResults::roots is wanted
  bool keepContacts = false;  // StepResults::matchedManifolds and ::manifolds are wanted (comparison, fallback)

  // Substeps that follow at once and will want the same settings, one fewer each: the engine may start the next one
  // ahead. Contacts are sent after the last of them.
  int substepsToFollow = 0;

  bool sendsContacts() const { return contacts && substepsToFollow == 0; }
  // Those of the substep that follows.
  StepSettings following() const {
    StepSettings next = *this;
    --next.substepsToFollow;
    return next;
  }
};

inline bool operator==(const StepSettings& a, const StepSettings& b) {
  static_assert(sizeof(StepSettings) == 124, "a new setting has to be compared below");
  const auto all = [](const StepSettings& s) {
    return std::tie(
        s.timeStep, s.iterations, s.erp2, s.globalCfm, s.sor, s.splitImpulse, s.splitImpulsePenetrationThreshold,
        s.splitImpulseTurnErp, s.linearSlop, s.warmStartingFactor, s.restitutionVelocityThreshold, s.maxGyroscopicForce,
        s.frictionErp, s.oneIsland, s.warmStarting, s.twoFrictionDirections, s.frictionDirectionCaching,
        s.velocityDependentFriction, s.interleaveContactAndFriction, s.contactBreakingThreshold, s.deactivationTime,
        s.disableDeactivation, s.useContinuous, s.forceUpdateAllAabbs, s.wakeByContact, s.hostActivation, s.contacts,
        s.allContacts, s.islandRoots, s.keepContacts, s.pairFinder, s.solver, s.groupSplit, s.batchLaunches, s.substeps,
        s.contactHertz, s.contactDampingRatio, s.pushSpeed, s.jointHertz, s.jointDampingRatio, s.substepsToFollow);
  };
  return all(a) == all(b);
}

}  // namespace btgpu
