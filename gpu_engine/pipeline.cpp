// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "pipeline.h"

#include <algorithm>

#include "stage_numbers.h"

namespace btgpu {
namespace {

std::vector<ArrayInUse> arraysInUse(const DeviceWorld& world) {
  std::vector<ArrayInUse> arrays;
  world.forEachArray([&](const auto& array) { arrays.push_back({array.buffer(), array.name(), array.sizeBytes()}); });
  return arrays;
}

// For captures: what the stage's reference is to be given when the stage is replayed.
void showStage(Queue& queue, const DeviceWorld& world, const StepSettings& settings, const char* stage) {
  if (!queue.recorder()) return;
  queue.recorder()->beforeStage(queue, stage, [&] {
    const auto reference = hostStage(stage);
    return StageInputs{arraysInUse(world), reference ? reference->alsoReads() : std::vector<std::string>(),
                       stageNumbers(world, settings)};
  });
}

}  // namespace

WorldTraits traitsOf(const WorldInput& input) {
  WorldTraits traits;
  for (const Shape& shape : input.shapes.values) traits.shapeTypes |= 1u << shape.type;
  traits.torsionRows = std::any_of(input.materials.values.begin(), input.materials.values.end(),
                                   [](const BodyMaterial& m) { return m.rollingFriction != 0.0f; });
  return traits;
}

Pipeline::Pipeline(ComputeDevice& device, HostStages& hostStages)
    : m_hostStages(hostStages),
      m_followSubstep(device),
      m_applyForces(device),
      m_updateAabbs(device),
      m_findPairs(device),
      m_groupPairs(device),
      m_cullTriangles(device),
      m_findSeparatingAxis(device),
      m_clipFaces(device),
      m_findClosestFeatures(device),
      m_reduceAndMatchContacts(device),
      m_appendHostContacts(device),
      m_buildIslands(device),
      m_colourConstraints(device),
      m_prepareContacts(device),
      m_solveVelocities(device),
      m_integratePoses(device),
      m_updateActivation(device),
      m_gatherContacts(device) {}

void Pipeline::enqueueStep(Queue& queue, DeviceWorld& world, const StepSettings& settings, const WorldTraits& traits) {
  DeviceStageIo io(queue, world, settings);
  const auto stage = [&](const char* name, auto& on, const auto&... arguments) {
    showStage(queue, world, settings, name);
    m_hostStages.run(name, io, [&] { on.enqueue(queue, world, arguments...); });
    if (queue.recorder()) queue.recorder()->afterStage(queue, [&] { return arraysInUse(world); });
  };
  const bool boxes = traits.has(SHAPE_BOX);
  stage("10_apply_forces", m_applyForces);
  if (!world.childPoses.empty()) stage("15_place_children", m_placeChildren);
  stage("20_update_aabbs", m_updateAabbs);
  stage(PairFinders::stageOf(settings.pairFinder), m_findPairs, settings.pairFinder);
  stage("35_group_pairs", m_groupPairs);
  if (traits.has(SHAPE_MESH)) stage("40_cull_triangles", m_cullTriangles);
  stage("42_collide_primitives", m_collidePrimitives, traits.shapeTypes);
  if (boxes) stage("44_find_separating_axis", m_findSeparatingAxis);
  if (boxes) stage("46_clip_faces", m_clipFaces);
  if (traits.convexPairs() || traits.curvedPairs()) {
    stage("44_find_closest_features", m_findClosestFeatures, traits.convexPairs(), traits.curvedPairs());
    stage("46_clip_convex_faces", m_clipConvexFaces, traits.convexPairs(), traits.curvedPairs());
  }
  if (traits.has(SHAPE_MESH)) stage("47_collide_triangles", m_collideTriangles, traits.shapeTypes);
  stage("48_reduce_and_match_contacts", m_reduceAndMatchContacts);
  if (world.hostManifoldCount > 0) stage("50_append_host_contacts", m_appendHostContacts);
  if (settings.keepContacts) world.keepMatchedManifolds(queue);
  if (world.jointCount > 0) stage("52_prepare_joints", m_prepareJoints);
  stage("55_build_islands", m_buildIslands);
  if (settings.solver == Solver::MassSplitting) {
    if (!m_splitting) m_splitting = std::make_unique<SplittingStages>(queue.device());
    stage("60_split_bodies", m_splitting->splitBodies);
    stage("65_prepare_contacts", m_prepareContacts);
    stage("67_split_masses", m_splitting->splitMasses);
    stage("70_solve_splits", m_splitting->solveSplits, settings, traits.torsionRows);
  } else if (settings.solver == Solver::TwoLevel) {
    if (!m_batching) m_batching = std::make_unique<BatchingStages>(queue.device());
    stage("60_batch_constraints", m_batching->batchConstraints, settings);
    stage("65_prepare_contacts", m_prepareContacts);
    stage("70_solve_batches", m_batching->solveBatches, settings, traits.torsionRows);
  } else if (settings.solver == Solver::Fast) {
    stage("60_colour_constraints", m_colourConstraints);
    stage("65_prepare_soft_contacts", m_prepareSoftContacts);
    stage("70_solve_substeps", m_solveSubsteps, settings);
  } else {
    stage("60_colour_constraints", m_colourConstraints);
    stage("65_prepare_contacts", m_prepareContacts);
    stage("70_solve_velocities", m_solveVelocities, settings, traits.torsionRows);
  }
  stage("80_integrate_poses", m_integratePoses);
  stage("90_update_activation", m_updateActivation);
  if (settings.sendsContacts()) stage("95_gather_contacts", m_gatherContacts, settings.allContacts);
}

}  // namespace btgpu
