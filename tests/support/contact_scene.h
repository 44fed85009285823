// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bodies and the manifolds between them, made up without regard to shapes: what the stages of the solver
// need.
#pragma once

#include <memory>

#include "gpu_engine/stages/65_prepare_contacts_reference.h"
#include "gpu_engine/step_settings.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {

struct ContactScene {
  WorldBuilder builder;
  StepSettings settings;
  std::vector<Manifold> manifolds;
  bool torsionRows = false;

  // A manifold without points.
  Manifold& addManifold(uint a, uint b);
  // A point with a friction of 0.5; arms are in world axes from the bodies' centres. The bodies' orientations
  // must be set before. Returns the point, to change.
  ContactPoint& addPoint(Manifold& manifold, float4 normalOnB, float distance, float4 armA, float4 armB);

  StepParams params() const;
};

struct RandomContacts {
  uint bodies = 40, manifolds = 80;
  // Factors, anisotropic friction, soft contacts, friction anchors, contacts that are not solved.
  bool oddities = true;
  float maxSpeed = 3;
};
ContactScene randomContacts(std::mt19937& random, const RandomContacts& what);

// A bench with all that stage 65 reads: steps from stage 10, slots from the reference of stage 60; room for
// the rows of all of them. Manifolds that neither body of can move get no slot.
std::unique_ptr<StageBench> benchForContacts(Queue& queue, const ContactScene& scene);

// Makes the bench what stage 60 finds in a step: the manifolds with a body that moves are its constraints. With room
// for so many slots.
void writeConstraints(StageBench& bench, const ContactScene& scene, size_t slots);
std::vector<uint> constraintsOf(const ContactScene& scene, const std::vector<BodyStep>& steps);

// The same for the references: reads back what the bench was given.
PrepareInput prepareInput(StageBench& bench, const ContactScene& scene);

// Slots of the scene as they lie on the device.
std::vector<SlotHeader> readSlots(StageBench& bench);

}  // namespace btgpu
