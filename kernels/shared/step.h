// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Settings of one step, and the counters that the device keeps while it runs.
#ifndef BTGPU_SHARED_STEP_H
#define BTGPU_SHARED_STEP_H
#include "types.h"

BTGPU_BEGIN

// Bits of StepParams.flags.
#define STEP_USE_CONTINUOUS 0x01u         // btDispatcherInfo::m_useContinuous: AABBs cover the predicted motion
#define STEP_FORCE_ALL_AABBS 0x02u        // btCollisionWorld::m_forceUpdateAllAabbs
#define STEP_SPLIT_IMPULSE 0x04u
#define STEP_WARM_START 0x08u             // SOLVER_USE_WARMSTARTING
#define STEP_TWO_FRICTION 0x10u           // SOLVER_USE_2_FRICTION_DIRECTIONS
#define STEP_FRICTION_CACHING 0x20u       // SOLVER_ENABLE_FRICTION_DIRECTION_CACHING
#define STEP_NO_VELOCITY_FRICTION 0x40u   // SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION
#define STEP_INTERLEAVE 0x80u             // SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS
#define STEP_DISABLE_DEACTIVATION 0x100u  // gDisableDeactivation
#define STEP_TORSION 0x200u               // some body has rolling friction
#define STEP_HOST_ACTIVATION 0x400u       // actions may still change velocities: the host updates the timers
#define STEP_WAKE_BY_CONTACT 0x800u       // btDispatcherInfo::m_deterministicOverlappingPairs: no wake without a contact
#define STEP_CONTACTS_UNSEEN 0x1000u      // the host was not sent the contacts of the step before
#define STEP_SUBSTEPS 0x2000u             // fast mode: the solver has moved the bodies as well
#define STEP_ONE_ISLAND 0x4000u           // not btSimulationIslandManager::getSplitIslands: all contacts are solved
#define STEP_ISLAND_ROOTS 0x8000u         // the host wants to know the islands, also where the step does not

STRUCT(StepParams) {
  float timeStep;
  uint flags;                 // STEP_*
  float erp2, globalCfm;      // contact error reduction and constraint force mixing
  float splitImpulsePenetrationThreshold, splitImpulseTurnErp;
  float linearSlop, warmStartingFactor;
  float sor, restitutionVelocityThreshold;
  float maxGyroscopicForce;
  float contactThreshold;     // gContactBreakingThreshold: AABBs grow by it
  float deactivationTime;     // gDeactivationTime
  uint hostManifoldCount;     // manifolds of the host behind those of the pairs
  // Of the fast mode only, but for the last one.
  uint substeps;                                         // that the step is cut into
  float contactHertz, contactDampingRatio, pushSpeed;    // softness of contacts; 1 / time, 1, length / time
  float jointHertz, jointDampingRatio;                   // and of joints
  float frictionErp;  // of friction anchors
};

// Bits of StepCounters.overflow: what was too small. Every later kernel of the step returns at once, and the
// host repeats the step with larger arrays; the state that the step started from is still untouched.
#define OVERFLOW_PAIRS 1u
#define OVERFLOW_SLOTS 2u
#define OVERFLOW_ABSENT 4u  // no array, but room to run: the solver's groups can't all be resident at once
#define OVERFLOW_TRIANGLES 16u
#define OVERFLOW_BEFORE 8u  // nothing here: the step before, which this one was launched on top of, failed

// One block of counters, read back once at the end of the step.
STRUCT(StepCounters) {
  uint overflow;          // OVERFLOW_*
  uint pairCount;         // pairs found, also those beyond the capacity
  uint constraintCount;   // manifolds that the solver gets
  uint slotCount;         // constraint slots, padding included
  uint colourCount;       // parallel colours used
  uint serialCount;       // constraints in the serial batch
  uint triangleHits;      // triangles of meshes near other shapes, also those beyond the capacity
  uint colourRounds;      // colouring rounds that were worth a launch
  uint contactPoints;     // points of all manifolds
  uint quarantined;       // bodies put into quarantine in this step
  uint boxOverlaps;       // box pairs that the separating axis test let through
  uint outOfBounds;       // bodies disabled because their AABB is too large
  uint touchingCount;     // manifolds with points, if the host wants contacts
  uint freshCount;        // of these, not carried over from the last step
  uint largeColours;      // colours up to the last one that is worth a launch of its own
  uint bouncing;          // fast mode: contacts with restitution to see to
};

BTGPU_END
#endif
