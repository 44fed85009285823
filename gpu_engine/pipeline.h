// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>

#include "device_world.h"
#include "host_stage.h"
#include "stages/05_follow_substep.h"
#include "stages/10_apply_forces.h"
#include "stages/15_place_children.h"
#include "stages/20_update_aabbs.h"
#include "stages/30_pair_finders.h"
#include "stages/35_group_pairs.h"
#include "stages/40_cull_triangles.h"
#include "stages/42_collide_primitives.h"
#include "stages/44_find_closest_features.h"
#include "stages/44_find_separating_axis.h"
#include "stages/46_clip_convex_faces.h"
#include "stages/46_clip_faces.h"
#include "stages/47_collide_triangles.h"
#include "stages/48_reduce_and_match_contacts.h"
#include "stages/50_append_host_contacts.h"
#include "stages/52_prepare_joints.h"
#include "stages/55_build_islands.h"
#include "stages/60_batch_constraints.h"
#include "stages/60_colour_constraints.h"
#include "stages/60_split_bodies.h"
#include "stages/65_prepare_contacts.h"
#include "stages/65_prepare_soft_contacts.h"
#include "stages/67_split_masses.h"
#include "stages/70_solve_batches.h"
#include "stages/70_solve_splits.h"
#include "stages/70_solve_substeps.h"
#include "stages/70_solve_velocities.h"
#include "stages/80_integrate_poses.h"
#include "stages/90_update_activation.h"
#include "stages/95_gather_contacts.h"

namespace btgpu {

// What a step needs to know of the world before it is launched.
struct WorldTraits {
  uint shapeTypes = 0;       // bit SHAPE_* for every shape in use
  bool torsionRows = false;  // some body has rolling friction, or a point of contact that the application gave it to

  bool has(uint shapeType) const { return (shapeTypes >> shapeType & 1u) != 0; }
  // Pairs whose contacts are found by closest features: of shapes with vertices, and with something curved.
  bool convexPairs() const { return has(SHAPE_HULL) || (has(SHAPE_CAPSULE) && has(SHAPE_BOX)); }
  bool curvedPairs() const {
    return has(SHAPE_CYLINDER) || has(SHAPE_CONE) || has(SHAPE_MULTI_SPHERE) || has(SHAPE_SUM);
  }
};

// What follows from the bodies.
WorldTraits traitsOf(const WorldInput& input);

// The stages of Solver::MassSplitting in place of 60 and 70.
struct SplittingStages {
  explicit SplittingStages(ComputeDevice& device) : splitBodies(device), splitMasses(device), solveSplits(device) {}
  SplitBodies splitBodies;
  SplitMasses splitMasses;
  SolveSplits solveSplits;
};

// Those of Solver::TwoLevel.
struct BatchingStages {
  explicit BatchingStages(ComputeDevice& device) : batchConstraints(device), solveBatches(device) {}
  BatchConstraints batchConstraints;
  SolveBatches solveBatches;
};

// The order of the stages, Bullet's own (docs/pipeline.md). Nothing in here waits for the device, unless
// stages run on the host or are held against it.
class Pipeline {
 public:
  Pipeline(ComputeDevice& device, HostStages& hostStages);
  void enqueueStep(Queue& queue, DeviceWorld& world, const StepSettings& settings, const WorldTraits& traits);
  // What is left of earlier steps on the device may be lost.
  void forget() { m_findPairs.forget(); }
  // Before a step that is launched on top of one whose outcome the host does not know yet, in place of new counters.
  void enqueueFollow(Queue& queue, DeviceWorld& world) { m_followSubstep.enqueue(queue, world); }  // 05
  // After a step: brings the contacts, and once the queue is finished, shows them.
  void enqueueContactReads(Queue& queue, DeviceWorld& world, const StepSettings& settings) {
    m_gatherContacts.enqueueReads(queue, world, settings.allContacts);
  }
  void finishContactReads(Queue& queue, DeviceWorld& world, const StepSettings& settings, StepResults& results) {
    m_gatherContacts.finishReads(queue, world, settings.allContacts, results);
  }
  // Before the next step: what the reads brought is gone then.
  void endContactReads(Queue& queue) { m_gatherContacts.endReads(queue); }

 private:
  HostStages& m_hostStages;
  FollowSubstep m_followSubstep;
  ApplyForces m_applyForces;
  PlaceChildren m_placeChildren;
  UpdateAabbs m_updateAabbs;
  PairFinders m_findPairs;
  GroupPairs m_groupPairs;
  CullTriangles m_cullTriangles;
  CollidePrimitives m_collidePrimitives;
  FindSeparatingAxis m_findSeparatingAxis;
  ClipFaces m_clipFaces;
  FindClosestFeatures m_findClosestFeatures;
  ClipConvexFaces m_clipConvexFaces;
  CollideTriangles m_collideTriangles;
  ReduceAndMatchContacts m_reduceAndMatchContacts;
  AppendHostContacts m_appendHostContacts;
  PrepareJoints m_prepareJoints;
  BuildIslands m_buildIslands;
  ColourConstraints m_colourConstraints;
  PrepareContacts m_prepareContacts;
  SolveVelocities m_solveVelocities;
  std::unique_ptr<SplittingStages> m_splitting;  // built when a step first wants it
  std::unique_ptr<BatchingStages> m_batching;    // likewise
  PrepareSoftContacts m_prepareSoftContacts;
  SolveSubsteps m_solveSubsteps;
  IntegratePoses m_integratePoses;
  UpdateActivation m_updateActivation;
  GatherContacts m_gatherContacts;
};

}  // namespace btgpu
