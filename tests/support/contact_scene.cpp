// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/support/contact_scene.h"

#include <cmath>

#include "gpu_engine/stages/10_apply_forces.h"
#include "gpu_engine/stages/60_colour_constraints_reference.h"
#include "kernels/lib/vec.h"

namespace btgpu {
namespace {

constexpr float kNoThreshold = 1e18f;  // Bullet's default m_contactProcessingThreshold

float4 randomNormal(std::mt19937& random) { return rotate(randomTurn(random), {0, 1, 0, 0}); }

bool hasMass(ContactScene& scene, uint body) { return scene.builder.mass(body).inverseInertiaLocal.w != 0; }

uint addRandomBody(ContactScene& scene, std::mt19937& random, const RandomContacts& what) {
  WorldBuilder& b = scene.builder;
  const float4 size = uniform3(random, 0.3f, 0.8f), position = uniform3(random, -4, 4);
  const float4 orientation = randomTurn(random);
  const int shape = random() % 2 ? b.sphere(size.x) : b.box(size);
  const uint kind = b.bodyCount() == 0 ? 15 : random() % 16;  // the first one is dynamic
  // Masses whose inverse is exact, so that Bullet can be given the same.
  const float masses[] = {0.5f, 1, 2, 4};
  uint i;
  if (kind == 0) {
    i = b.add(shape, position, 0, orientation);
  } else if (kind == 1) {
    i = b.addObject(shape, position, orientation);
  } else if (kind == 2) {
    i = b.addKinematic(shape, position, orientation);
  } else {
    i = b.add(shape, position, masses[random() % 4], orientation);
    if (kind == 3) b.info(i).flags |= BODY_KINEMATIC;  // but left with its mass
  }
  if (kind < 2) return i;
  b.velocity(i) = {uniform3(random, -what.maxSpeed, what.maxSpeed), uniform3(random, -what.maxSpeed, what.maxSpeed)};
  if (kind == 2) return i;
  b.forces(i) = {uniform3(random, -20, 20), uniform3(random, -5, 5)};
  if (!what.oddities) return i;
  if (random() % 4 == 0) b.mass(i).linearFactor = uniform3(random, 0.2f, 1);
  if (random() % 4 == 0) b.mass(i).angularFactor = uniform3(random, 0.2f, 1);
  if (random() % 8 == 0) b.mass(i).linearFactor = {0, 0, 0, 0};
  if (random() % 8 == 0) b.mass(i).angularFactor = {0, 1, 0, 0};
  if (random() % 4 == 0) b.info(i).flags |= BODY_ANISOTROPIC;
  if (random() % 4 == 0) b.info(i).flags |= BODY_ANISOTROPIC_ROLLING;
  if (random() % 2 == 0) b.info(i).flags |= BODY_GYRO_IMPLICIT_BODY;
  b.material(i).anisotropicFriction = uniform3(random, 0.1f, 1);
  return i;
}

// What points can have of their own; drawn apart, so that all else is as without it.
void addOddFlags(ContactPoint& p, std::mt19937 random) {
  if (random() % 4 == 0) p.flags |= POINT_FRICTION_ANCHOR;
  if (random() % 8 == 0) {
    p.flags |= POINT_CFM;
    p.combinedStiffness = uniform(random, 0, 0.1f);
  }
  if (random() % 8 == 0) {
    p.flags |= POINT_ERP;
    p.combinedDamping = uniform(random, 0, 1);
  }
  if ((p.flags & POINT_LATERAL_FRICTION_INITIALIZED) && random() % 4 == 0) p.flags |= POINT_MOTION;
}

void addRandomPoint(ContactScene& scene, Manifold& m, std::mt19937& random, const RandomContacts& what) {
  const float4 normal = randomNormal(random);
  ContactPoint& p = scene.addPoint(m, normal, uniform(random, -0.1f, 0.03f), uniform3(random, -0.6f, 0.6f),
                                   uniform3(random, -0.6f, 0.6f));
  p.localPointB.w = uniform(random, 0, 2);
  p.normalWorldOnB.w = uniform(random, -1, 1);
  p.lateralFrictionDir1 = withW(randomNormal(random), uniform(random, -1, 1));
  p.lateralFrictionDir2 = randomNormal(random);
  p.combined = {uniform(random, 0, 1), uniform(random, 0, 0.8f), 0, uniform(random, 0, 0.1f)};
  if (random() % 2) p.combined.z = uniform(random, 0, 0.1f);
  if (random() % 2) p.flags |= POINT_LATERAL_FRICTION_INITIALIZED;
  if (what.oddities && random() % 4 == 0) {
    p.flags |= POINT_STIFFNESS_DAMPING;
    p.combinedStiffness = uniform(random, 10, 2000);
    p.combinedDamping = uniform(random, 0, 50);
  }
  if (what.oddities) addOddFlags(p, std::mt19937(static_cast<unsigned>(scene.manifolds.size())));
}

}  // namespace

Manifold& ContactScene::addManifold(uint a, uint b) {
  Manifold m{};
  m.bodyA = a;
  m.bodyB = b;
  m.breakingThreshold = 0.02f;
  m.processingThreshold = kNoThreshold;
  manifolds.push_back(m);
  return manifolds.back();
}

ContactPoint& ContactScene::addPoint(Manifold& manifold, float4 normalOnB, float distance, float4 armA, float4 armB) {
  ContactPoint& p = manifold.points[manifold.pointCount++];
  p = ContactPoint{};
  p.localPointA = withW(rotateInverse(builder.pose(manifold.bodyA).orientation, armA), distance);
  p.localPointB = rotateInverse(builder.pose(manifold.bodyB).orientation, armB);
  p.normalWorldOnB = normalOnB;
  p.combined = {0.5f, 0, 0, 0};
  return p;
}

StepParams ContactScene::params() const { return makeStepParams(settings, torsionRows); }

ContactScene randomContacts(std::mt19937& random, const RandomContacts& what) {
  ContactScene scene;
  scene.torsionRows = true;
  for (uint i = 0; i < what.bodies; ++i) addRandomBody(scene, random, what);
  scene.builder.material(0).rollingFriction = 1;  // as a world must have where torsional rows are wanted
  while (scene.manifolds.size() < what.manifolds) {
    const uint a = random() % what.bodies, b = random() % what.bodies;
    if (a == b || (!hasMass(scene, a) && !hasMass(scene, b))) continue;
    Manifold& m = scene.addManifold(a, b);
    if (what.oddities && random() % 8 == 0) m.processingThreshold = 0;
    const uint points = 1 + random() % MANIFOLD_POINTS;
    for (uint k = 0; k < points; ++k) addRandomPoint(scene, m, random, what);
  }
  return scene;
}

std::vector<uint> constraintsOf(const ContactScene& scene, const std::vector<BodyStep>& steps) {
  std::vector<uint> constraints;
  for (uint m = 0; m < scene.manifolds.size(); ++m) {
    const uint a = scene.manifolds[m].bodyA, b = scene.manifolds[m].bodyB;
    if (steps[a].angularVelocity.w != 0 || steps[b].angularVelocity.w != 0) constraints.push_back(m);
  }
  return constraints;
}

void writeConstraints(StageBench& bench, const ContactScene& scene, size_t slots) {
  DeviceWorld& world = bench.world();
  Capacities room = world.capacities;
  room.slots = slots;
  world.reserve(bench.queue(), room, scene.settings.twoFrictionDirections, scene.torsionRows);
  const std::vector<uint> constraints = constraintsOf(scene, bench.read(world.steps, world.bodyCount));
  StepCounters counters{};
  counters.constraintCount = static_cast<uint>(constraints.size());
  bench.setCounters(counters);
  bench.write(world.constraintCount, {counters.constraintCount});
  bench.write(world.constraints, constraints);
  bench.poison(world.slots);
  bench.poison(world.slotFirst);
}

std::unique_ptr<StageBench> benchForContacts(Queue& queue, const ContactScene& scene) {
  const WorldInput input = scene.builder.finish();
  Capacities room;
  room.pairs = std::max<size_t>(1, scene.manifolds.size());
  room.slots = scene.manifolds.size() + (COLOUR_LIMIT + 1) * BTGPU_LANES;
  auto bench = std::make_unique<StageBench>(queue, input, scene.settings, room);
  DeviceWorld& world = bench->world();
  if (scene.torsionRows) world.torsion.resize(queue, room.slots * SLOT_TORSION_FIELDS);
  StepParams params = makeStepParams(scene.settings, scene.torsionRows);
  bench->setParams(params);
  bench->run<ApplyForces>();

  const auto steps = bench->read(world.steps, input.bodyCount);
  const std::vector<uint> constraints = constraintsOf(scene, steps);
  const ColoursReference colours = colourConstraintsReference(constraints, scene.manifolds, steps);
  StepCounters counters = bench->counters();
  counters.constraintCount = static_cast<uint>(constraints.size());
  counters.slotCount = static_cast<uint>(colours.slots.size());
  counters.colourCount = colours.colourCount;
  counters.serialCount = colours.serialCount;
  counters.largeColours = colours.colourCount / 2;
  bench->setCounters(counters);
  bench->setManifolds(scene.manifolds);
  bench->write(world.slotFirst, colours.slotFirst);
  bench->write(world.slots, colours.slots);
  // Some colours alone, and a colour or more for the launch of the rest.
  world.capacities.colourLaunches = counters.largeColours;
  return bench;
}

std::vector<SlotHeader> readSlots(StageBench& bench) {
  return bench.read(bench.world().slots, bench.counters().slotCount);
}

PrepareInput prepareInput(StageBench& bench, const ContactScene& scene) {
  const WorldInput in = scene.builder.finish();
  return {bench.params(),   in.infos.values,     in.poses.values, bench.read(bench.world().steps, in.bodyCount),
          in.masses.values, in.materials.values, readSlots(bench)};
}

}  // namespace btgpu
