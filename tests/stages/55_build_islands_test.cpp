// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/55_build_islands.h"

#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <set>

#include "gpu_engine/stages/55_build_islands_reference.h"
#include "tests/support/device_test.h"
#include "tests/support/joint_scene.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

// What stage 55 reads, made by hand: one manifold a pair, as stage 48 leaves them.
struct IslandScene {
  WorldBuilder builder;
  std::vector<BodyStep> steps;
  std::vector<Pair> pairs;
  std::vector<Manifold> manifolds, hostManifolds;
  StepSettings settings;
  JointScene joints;

  explicit IslandScene(uint bodies, int state = STATE_ACTIVE) {
    const int shape = builder.sphere(1);
    for (uint i = 0; i < bodies; ++i) builder.activation(builder.add(shape, {})).state = state;
    steps.resize(bodies);
    for (uint i = 0; i < bodies; ++i) setMoves(i, true);
  }
  uint bodyCount() const { return builder.bodyCount(); }
  // Somebody who rests: else nobody asks for islands.
  void setResting(uint body) { activation(body).state = STATE_WANTS_DEACTIVATION; }
  void setMoves(uint body, bool moves) { steps[body].angularVelocity.w = moves ? 1.0f : 0.0f; }
  void setFlags(uint body, uint flags) {
    builder.info(body).flags = BODY_PRESENT | BODY_RIGID | flags;
    if (flags & (BODY_STATIC | BODY_KINEMATIC | BODY_QUARANTINED)) setMoves(body, false);
  }
  BodyActivation& activation(uint body) { return builder.activation(body); }

  void touch(uint a, uint b, int points = 4, uint bucket = BUCKET_SPHERE_SPHERE) {
    pairs.push_back({a, b, NO_INDEX, bucket});
    Manifold m{};
    m.bodyA = a;
    m.bodyB = b;
    m.pointCount = points;
    m.bucket = bucket;
    manifolds.push_back(m);
  }
  // A manifold that the host found for a pair; there may be several.
  void touchOnHost(uint a, uint b, int points = 4) {
    Manifold m{};
    m.bodyA = a;
    m.bodyB = b;
    m.pointCount = points;
    hostManifolds.push_back(m);
  }
  void touchChain(const std::vector<uint>& bodies) {
    for (size_t i = 1; i < bodies.size(); ++i) touch(bodies[i - 1], bodies[i]);
  }
};

struct IslandResult : IslandsReference {
  StepCounters counters;
};

class BuildIslandsTest : public DeviceTest {
 protected:
  IslandResult device(const IslandScene& scene, size_t spare = 0) {
    Capacities room;
    room.bodies = scene.bodyCount() + 3;
    room.pairs = scene.pairs.size() + scene.hostManifolds.size() + spare;
    room.slots = BTGPU_LANES;
    if (room.pairs == 0) room.pairs = 1;
    StageBench bench(queue(), scene.joints.addTo(scene.builder.finish()), scene.settings, room);
    DeviceWorld& world = bench.world();
    bench.poison(world.jointSolved);
    bench.setPairs(scene.pairs);
    std::vector<Manifold> manifolds = scene.manifolds;
    manifolds.insert(manifolds.end(), scene.hostManifolds.begin(), scene.hostManifolds.end());
    bench.setManifolds(manifolds);
    StepParams params = bench.params();
    params.hostManifoldCount = world.hostManifoldCount = static_cast<uint>(scene.hostManifolds.size());
    bench.setParams(params);
    bench.write(world.manifoldCount, {static_cast<uint>(manifolds.size())});
    bench.write(world.steps, scene.steps);
    bench.poison(world.roots);
    bench.poison(world.islandFlags);
    bench.poison(world.solved);
    bench.poison(world.constraints);
    bench.write(world.stepActivations, scene.builder.finish().activations.values);
    bench.run<BuildIslands>();

    const size_t n = scene.bodyCount();
    IslandResult out;
    out.roots = bench.read(world.roots, n);
    out.solved = bench.read(world.solved, n);
    out.activations = bench.read(world.stepActivations, n);
    out.counters = bench.counters();
    out.contactPoints = out.counters.contactPoints;
    out.jointSolved = bench.read(world.jointSolved, scene.joints.joints.size());
    out.constraints = bench.read(world.constraints, out.counters.constraintCount);
    const auto all = bench.read(world.roots);
    for (size_t i = n; i < all.size(); ++i) EXPECT_TRUE(StageBench::isPoison(all[i])) << "written at " << i;
    EXPECT_EQ(bench.read(world.constraintCount, 1).front(), out.counters.constraintCount);
    return out;
  }

  static IslandsReference reference(const IslandScene& scene) {
    const WorldInput in = scene.builder.finish();
    std::vector<Manifold> manifolds = scene.manifolds;
    manifolds.insert(manifolds.end(), scene.hostManifolds.begin(), scene.hostManifolds.end());
    return buildIslandsReference(makeStepParams(scene.settings, false), in.infos.values, scene.steps,
                                 in.activations.values, scene.pairs, manifolds, scene.joints.joints);
  }

  IslandResult expectAsReference(const IslandScene& scene, size_t spare = 0) {
    IslandResult actual = device(scene, spare);
    const IslandsReference expected = reference(scene);
    EXPECT_EQ(actual.roots, expected.roots);
    EXPECT_EQ(actual.solved, expected.solved);
    EXPECT_EQ(actual.constraints, expected.constraints);
    EXPECT_EQ(actual.contactPoints, expected.contactPoints);
    EXPECT_EQ(actual.jointSolved, expected.jointSolved);
    for (uint i = 0; i < scene.bodyCount(); ++i) {
      EXPECT_TRUE(sameBits(actual.activations[i], expected.activations[i]))
          << "body " << i << " got state " << actual.activations[i].state << " instead of "
          << expected.activations[i].state;
      if (HasFailure()) break;
    }
    return actual;
  }
};

// ---- manifolds of the host

TEST_F(BuildIslandsTest, HostManifoldsAreSelectedBehindThoseOfThePairsSmall) {
  IslandScene scene(6);
  scene.setResting(0);
  scene.setFlags(5, BODY_STATIC);
  scene.touch(0, 1);
  scene.touch(2, 3, 0, BUCKET_HOST);
  scene.touch(4, 5, 0, BUCKET_HOST);
  scene.touchOnHost(2, 3);
  scene.touchOnHost(2, 3, 1);
  scene.touchOnHost(4, 5, 0);
  scene.touchOnHost(4, 5, 2);
  const auto result = expectAsReference(scene);
  EXPECT_EQ(result.constraints, (std::vector<uint>{0, 3, 4, 6}));
  EXPECT_EQ(result.contactPoints, 4u + 4 + 1 + 2);
  EXPECT_EQ(result.roots, (std::vector<uint>{0, 0, 2, 2, 4, 5}));
}

TEST_F(BuildIslandsTest, HostManifoldsWakeByContactSmall) {
  for (const bool byContact : {false, true}) {
    IslandScene scene(6, STATE_SLEEPING);
    scene.settings.wakeByContact = byContact;
    for (const uint platform : {1u, 3u}) {
      scene.setFlags(platform, BODY_KINEMATIC);
      scene.activation(platform).state = STATE_ACTIVE;
    }
    scene.touch(0, 1, 0, BUCKET_HOST);
    scene.touch(2, 3, 0, BUCKET_HOST);
    scene.touchOnHost(0, 1, 0);
    scene.touchOnHost(3, 2, 1);
    const auto result = expectAsReference(scene);
    EXPECT_EQ(result.activations[0].state, byContact ? STATE_SLEEPING : STATE_ACTIVE);
    EXPECT_EQ(result.activations[2].state, STATE_ACTIVE);
  }
}

// ---- roots

TEST_F(BuildIslandsTest, NoPairsSmall) {
  const auto result = expectAsReference(IslandScene(5));
  EXPECT_EQ(result.roots, (std::vector<uint>{0, 1, 2, 3, 4}));
  EXPECT_TRUE(result.constraints.empty());
}

TEST_F(BuildIslandsTest, OneBodySmall) { expectAsReference(IslandScene(1)); }

TEST_F(BuildIslandsTest, TwoComponentsSmall) {
  IslandScene scene(6);
  scene.setResting(0);
  scene.touchChain({5, 3, 1});
  scene.touchChain({4, 2});
  const auto result = expectAsReference(scene);
  EXPECT_EQ(result.roots, (std::vector<uint>{0, 1, 2, 1, 2, 1}));
  EXPECT_EQ(result.constraints, (std::vector<uint>{0, 1, 2}));
}

// Neither static bodies nor bodies without response join what they touch; both ends of a pair are tried.
TEST_F(BuildIslandsTest, WhatDoesNotMergeSmall) {
  for (const uint flag : {BODY_STATIC, BODY_KINEMATIC, BODY_NO_RESPONSE, BODY_QUARANTINED}) {
    for (const bool swapped : {false, true}) {
      IslandScene scene(4);
      scene.setResting(3);
      scene.setFlags(1, flag);
      scene.touch(swapped ? 1 : 0, swapped ? 0 : 1);
      scene.touch(swapped ? 2 : 1, swapped ? 1 : 2);
      const auto result = expectAsReference(scene);
      EXPECT_EQ(result.roots, (std::vector<uint>{0, 1, 2, 3})) << "flag " << flag;
    }
  }
}

TEST_F(BuildIslandsTest, ChainsOf20000) {
  constexpr uint kBodies = 20000;
  std::vector<uint> order(kBodies);
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937 random(1);
  for (int kind = 0; kind < 3; ++kind) {  // ascending, descending, shuffled
    if (kind == 1) std::reverse(order.begin(), order.end());
    if (kind == 2) std::shuffle(order.begin(), order.end(), random);
    IslandScene scene(kBodies);
    scene.setResting(9);
    scene.touchChain(order);
    const auto result = device(scene);
    EXPECT_EQ(result.roots, std::vector<uint>(kBodies, 0));
    EXPECT_EQ(result.constraints.size(), kBodies - 1);
  }
}

TEST_F(BuildIslandsTest, Stars) {
  for (const uint centre : {0u, 777u, 1999u}) {
    IslandScene scene(2000);
    scene.setResting(9);
    for (uint i = 0; i < 2000; ++i) {
      if (i != centre) scene.touch(std::min(i, centre), std::max(i, centre));
    }
    EXPECT_EQ(expectAsReference(scene).roots, std::vector<uint>(2000, 0));
  }
}

// Nobody rests: pairs and joints are selected without asking for islands, and a waker still resets timers.
TEST_F(BuildIslandsTest, AllStayAwakeSmall) {
  IslandScene scene(7);
  scene.activation(2).state = STATE_DISABLE_DEACTIVATION;
  scene.activation(4).deactivationTime = 1.5f;
  scene.setFlags(5, BODY_KINEMATIC);
  scene.setFlags(6, BODY_STATIC);
  scene.activation(6).state = STATE_SLEEPING;  // in no island
  scene.touchChain({0, 1, 2, 3});
  scene.touch(4, 5);
  scene.touch(3, 6);
  scene.joints.add(0, 4);
  const auto result = expectAsReference(scene);
  EXPECT_EQ(result.roots, (std::vector<uint>{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(result.constraints, (std::vector<uint>{0, 1, 2, 3, 4}));
  EXPECT_EQ(result.jointSolved, (std::vector<uint>{1}));
  EXPECT_EQ(result.activations[4].deactivationTime, 0.0f);
}

// One stage through steps in which somebody rests and others in which nobody does.
TEST_F(BuildIslandsTest, WhoRestsIsAskedInEachStepSmall) {
  IslandScene scene(4);
  scene.touchChain({0, 1, 2});
  StageBench bench(queue(), scene.builder.finish(), scene.settings, Capacities{7, 3, BTGPU_LANES});
  DeviceWorld& world = bench.world();
  bench.setPairs(scene.pairs);
  bench.setManifolds(scene.manifolds);
  bench.write(world.steps, scene.steps);
  BuildIslands stage(DeviceTest::device());
  for (const bool rests : {true, false, false, true, true, false}) {
    scene.activation(3).state = rests ? STATE_WANTS_DEACTIVATION : STATE_ACTIVE;
    bench.write(world.stepActivations, scene.builder.finish().activations.values);
    stage.enqueue(queue(), world);
    queue().finish();
    EXPECT_EQ(bench.read(world.roots, 4), rests ? (std::vector<uint>{0, 0, 0, 3}) : (std::vector<uint>{0, 1, 2, 3}));
  }
}

// ---- sleep

// Bullet's decision for an island of two, by all pairs of states.
TEST_F(BuildIslandsTest, AllPairsOfStatesSmall) {
  IslandScene scene(2 * 7 * 7);
  for (uint i = 0; i < 49; ++i) {
    scene.activation(2 * i) = {static_cast<int>(i / 7), 1.5f};
    scene.activation(2 * i + 1) = {static_cast<int>(i % 7), 2.5f};
    scene.touch(2 * i, 2 * i + 1);
  }
  expectAsReference(scene);
}

TEST_F(BuildIslandsTest, AllWantSleepSmall) {
  IslandScene scene(3, STATE_WANTS_DEACTIVATION);
  scene.touchChain({0, 1, 2});
  const auto result = expectAsReference(scene);
  for (const auto& a : result.activations) EXPECT_EQ(a.state, STATE_SLEEPING);
  EXPECT_EQ(result.solved, (std::vector<uint>{0, 0, 0}));
  EXPECT_TRUE(result.constraints.empty());
  EXPECT_EQ(result.contactPoints, 8u);
}

TEST_F(BuildIslandsTest, OneAwakeKeepsAllAwakeSmall) {
  for (const int awake : {STATE_ACTIVE, STATE_DISABLE_DEACTIVATION}) {
    IslandScene scene(4, STATE_SLEEPING);
    for (uint i = 0; i < 4; ++i) scene.activation(i).deactivationTime = 3;
    scene.activation(3) = {awake, 0.5f};
    scene.activation(2) = {STATE_DISABLE_SIMULATION, 3};
    scene.touchChain({3, 1, 0, 2});
    const auto result = expectAsReference(scene);
    EXPECT_EQ(result.activations[0].state, STATE_WANTS_DEACTIVATION);
    EXPECT_EQ(result.activations[0].deactivationTime, 0.0f);
    EXPECT_EQ(result.activations[2].state, STATE_DISABLE_SIMULATION);
    EXPECT_EQ(result.activations[2].deactivationTime, 3.0f);
    EXPECT_EQ(result.activations[3].state, awake);
    EXPECT_EQ(result.activations[3].deactivationTime, 0.5f);
    EXPECT_EQ(result.constraints.size(), 3u);
  }
}

// What a kinematic body wakes: by its own state, its response, and whether the pair has a manifold.
TEST_F(BuildIslandsTest, KinematicWakesSmall) {
  struct Case {
    uint flags;
    int state;
    uint bucket;
    bool wakes;
  };
  const Case cases[] = {
      {BODY_KINEMATIC, STATE_ACTIVE, BUCKET_SPHERE_SPHERE, true},
      {BODY_KINEMATIC, STATE_DISABLE_DEACTIVATION, BUCKET_SPHERE_SPHERE, true},
      {BODY_KINEMATIC, STATE_DISABLE_SIMULATION, BUCKET_CARRY, true},
      {BODY_KINEMATIC, STATE_DISABLE_SIMULATION, BUCKET_NONE, false},
      {BODY_KINEMATIC, STATE_ACTIVE, BUCKET_NONE, false},
      {BODY_KINEMATIC, STATE_SLEEPING, BUCKET_SPHERE_SPHERE, false},
      {BODY_KINEMATIC | BODY_NO_RESPONSE, STATE_ACTIVE, BUCKET_SPHERE_SPHERE, false},
      {BODY_STATIC, STATE_ACTIVE, BUCKET_SPHERE_SPHERE, false},
  };
  for (size_t c = 0; c < std::size(cases); ++c) {
    for (const bool swapped : {false, true}) {
      IslandScene scene(3, STATE_SLEEPING);
      for (uint i = 0; i < 3; ++i) scene.activation(i).deactivationTime = 4;
      scene.setFlags(0, cases[c].flags);
      scene.activation(0).state = cases[c].state;
      scene.touch(swapped ? 1 : 0, swapped ? 0 : 1, 0, cases[c].bucket);
      scene.touch(1, 2);
      const auto result = expectAsReference(scene);
      EXPECT_EQ(result.activations[1].state, cases[c].wakes ? STATE_ACTIVE : STATE_SLEEPING) << "case " << c;
      EXPECT_EQ(result.activations[1].deactivationTime, cases[c].wakes ? 0.0f : 4.0f) << "case " << c;
      EXPECT_EQ(result.activations[2].state, STATE_SLEEPING) << "only what it touches, case " << c;
      // Its island is solved, with the manifold to the body that still sleeps.
      EXPECT_EQ(result.constraints.size(), cases[c].wakes ? 1u : 0u) << "case " << c;
    }
  }
}

// btDispatcherInfo::m_deterministicOverlappingPairs: a manifold without points wakes nobody.
TEST_F(BuildIslandsTest, KinematicWakesByContactSmall) {
  for (const bool byContact : {false, true}) {
    for (const int points : {0, 1}) {
      IslandScene scene(2, STATE_SLEEPING);
      scene.settings.wakeByContact = byContact;
      scene.setFlags(0, BODY_KINEMATIC);
      scene.activation(0).state = STATE_ACTIVE;
      scene.touch(0, 1, points);
      const auto result = expectAsReference(scene);
      EXPECT_EQ(result.activations[1].state, byContact && points == 0 ? STATE_SLEEPING : STATE_ACTIVE);
    }
  }
}

// ---- which manifolds are solved

TEST_F(BuildIslandsTest, SelectionSmall) {
  IslandScene scene(8);
  scene.setFlags(0, BODY_STATIC);
  scene.setFlags(1, BODY_KINEMATIC);
  scene.setFlags(2, BODY_NO_RESPONSE);
  scene.setFlags(3, BODY_KINEMATIC);
  scene.setMoves(3, true);   // kinematic, but left with mass
  scene.setMoves(4, false);  // dynamic without mass
  scene.touch(0, 5);         // 0: yes
  scene.touch(0, 1);         // 1: none is in an island
  scene.touch(2, 5);         // 2: no response
  scene.touch(5, 6, 0);      // 3: no points
  scene.touch(5, 6, 1);      // 4: yes
  scene.touch(3, 7);         // 5: yes, and body 3 is written back
  scene.touch(0, 4);         // 6: nothing moves
  scene.touch(1, 4);         // 7: nothing moves
  scene.touch(3, 4);         // 8: yes: the kinematic one moves
  scene.touch(7, 1);         // 9: yes
  const auto result = expectAsReference(scene, 5);
  EXPECT_EQ(result.constraints, (std::vector<uint>{0, 4, 5, 8, 9}));
  EXPECT_EQ(result.solved, (std::vector<uint>{0, 0, 1, 1, 1, 1, 1, 1}));
  EXPECT_EQ(result.contactPoints, 33u);
}

// After an overflow earlier in the step nothing is decided.
TEST_F(BuildIslandsTest, NothingAfterOverflowSmall) {
  IslandScene scene(4, STATE_WANTS_DEACTIVATION);
  scene.touchChain({0, 1, 2, 3});
  StageBench bench(queue(), scene.builder.finish());
  bench.setPairs(scene.pairs);
  bench.setManifolds(scene.manifolds);
  bench.write(bench.world().steps, scene.steps);
  bench.write(bench.world().stepActivations, scene.builder.finish().activations.values);
  StepCounters counters = bench.counters();
  counters.overflow = OVERFLOW_PAIRS;
  bench.setCounters(counters);
  bench.poison(bench.world().solved);
  bench.run<BuildIslands>();
  EXPECT_EQ(bench.read(bench.world().stepActivations, 4)[0].state, STATE_WANTS_DEACTIVATION);
  EXPECT_TRUE(StageBench::isPoison(bench.read(bench.world().solved, 1)[0]));
  EXPECT_EQ(bench.counters().constraintCount, 0u);
}

// ---- random

// `degree`: pairs a body; below a half the graph falls into small components, above into a giant one.
IslandScene randomScene(uint bodies, double degree, unsigned seed) {
  std::mt19937 random(seed);
  IslandScene scene(bodies);
  const uint kinds[] = {0,
                        0,
                        0,
                        0,
                        0,
                        0,
                        BODY_STATIC,
                        BODY_KINEMATIC,
                        BODY_NO_RESPONSE,
                        BODY_QUARANTINED,
                        BODY_KINEMATIC | BODY_NO_RESPONSE};
  // Mostly bodies that may sleep, so that islands of both kinds arise.
  const int states[] = {0, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 5, 6};
  for (uint i = 0; i < bodies; ++i) {
    scene.setFlags(i, kinds[random() % std::size(kinds)]);
    scene.activation(i) = {states[random() % std::size(states)], uniform(random, 0, 5)};
    // Dynamic bodies without mass, kinematic ones with it.
    const bool quarantined = scene.builder.info(i).flags & BODY_QUARANTINED;
    if (!quarantined && random() % 8 == 0) scene.setMoves(i, random() % 2 == 0);
    if (random() % 32 == 0) {
      scene.builder.info(i).flags &= ~BODY_PRESENT;
      scene.setMoves(i, false);
    }
  }
  std::set<std::pair<uint, uint>> keys;
  while (keys.size() < static_cast<size_t>(degree * bodies)) {
    const uint a = random() % bodies, b = random() % bodies;
    if (a != b) keys.insert({std::min(a, b), std::max(a, b)});
  }
  for (const auto& [low, high] : keys) {
    const bool swapped = random() % 2 == 0;
    const int points = static_cast<int>(random() % 5);
    scene.touch(swapped ? high : low, swapped ? low : high, points, random() % BUCKET_COUNT);
  }
  return scene;
}

TEST_F(BuildIslandsTest, RandomSmall) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    IslandScene scene = randomScene(61, 0.7, seed);
    scene.settings.oneIsland = seed % 2 == 1;
    scene.settings.islandRoots = seed > 1;
    expectAsReference(scene);
  }
}

TEST_F(BuildIslandsTest, RandomMedium) {
  for (const double degree : {0.2, 0.5, 1.0, 3.0}) {
    IslandScene scene = randomScene(1500, degree, 7);
    expectAsReference(scene, 100);
    scene.settings.oneIsland = true;
    expectAsReference(scene, 100);
  }
}

TEST_F(BuildIslandsTest, Random20000) {
  expectAsReference(randomScene(20000, 0.8, 11));
  expectAsReference(randomScene(20000, 4, 12));
}

// ---- joints

// Joints unite islands and wake what sleeps; disabled ones and those to held bodies don't.
TEST_F(BuildIslandsTest, JointsSmall) {
  IslandScene scene(6, STATE_SLEEPING);
  scene.activation(2).state = STATE_ACTIVE;
  scene.setFlags(1, BODY_NO_RESPONSE);
  scene.joints.add(2, 1);
  scene.joints.add(1, 4);
  scene.joints.add(3, NO_INDEX);
  scene.joints.add(2, 5).enabled = 0;
  scene.joints.add(5, 2).enabled = 0;
  scene.joints.add(NO_INDEX, NO_INDEX);
  const auto result = expectAsReference(scene);
  EXPECT_EQ(result.roots, (std::vector<uint>{0, 1, 1, 3, 1, 5}));
  EXPECT_EQ(result.activations[4].state, STATE_WANTS_DEACTIVATION);
  EXPECT_EQ(result.activations[5].state, STATE_SLEEPING);
  // A disabled joint belongs to its first body's island.
  EXPECT_EQ(result.jointSolved, (std::vector<uint>{1, 1, 0, 1, 0, 0}));
}

// A kinematic body that was left with mass is in no island, but a joint of one that is awake moves it.
TEST_F(BuildIslandsTest, JointMovesBodyOutsideIslandsSmall) {
  for (const bool rows : {false, true}) {
    IslandScene scene(2);
    scene.setFlags(1, BODY_KINEMATIC);
    scene.setMoves(1, true);
    Joint& joint = scene.joints.add(0, 1);
    joint.islandB = NO_INDEX;
    if (rows) scene.joints.addRow({1, 0, 0, 0}, {}, {-1, 0, 0, 0}, {});
    EXPECT_EQ(expectAsReference(scene).solved[1], rows ? 1u : 0u);
  }
}

TEST_F(BuildIslandsTest, RandomJoints) {
  std::mt19937 random(5);
  for (unsigned seed = 20; seed < 24; ++seed) {
    IslandScene scene = randomScene(1500, 0.3, seed);
    const WorldInput in = scene.builder.finish();
    std::vector<bool> moves;
    for (uint i = 0; i < scene.bodyCount(); ++i) moves.push_back(scene.steps[i].angularVelocity.w != 0);
    scene.joints = randomJoints(random, moves, 700);
    for (Joint& j : scene.joints.joints) {
      for (uint* island : {&j.islandA, &j.islandB}) {
        if (*island != NO_INDEX && (in.infos.values[*island].flags & (BODY_STATIC | BODY_KINEMATIC)))
          *island = NO_INDEX;
      }
    }
    const auto result = expectAsReference(scene);
    EXPECT_GT(std::count(result.jointSolved.begin(), result.jointSolved.end(), 1u), 50);
    EXPECT_GT(std::count(result.jointSolved.begin(), result.jointSolved.end(), 0u), 50);
  }
}

// ---- Bullet

// A Bullet world of spheres, the same pairs and manifolds for the device, and Bullet's own island manager.
class BulletIslands {
 public:
  BulletIslands(unsigned seed, int bodies) : m_world(&m_dispatcher, &m_broadphase, nullptr, &m_configuration) {
    std::mt19937 random(seed);
    for (int i = 0; i < bodies; ++i) add(random);
    // All awake, so that every pair gets its manifold; then the states that the test is about.
    m_world.performDiscreteCollisionDetection();
    const int states[] = {ACTIVE_TAG,         ISLAND_SLEEPING,      ISLAND_SLEEPING,
                          ISLAND_SLEEPING,    WANTS_DEACTIVATION,   WANTS_DEACTIVATION,
                          WANTS_DEACTIVATION, DISABLE_DEACTIVATION, DISABLE_SIMULATION};
    for (const auto& body : m_bodies) {
      body->forceActivationState(states[random() % std::size(states)]);
      body->setDeactivationTime(uniform(random, 0, 3));
    }
  }
  ~BulletIslands() {
    for (const auto& body : m_bodies) m_world.removeRigidBody(body.get());
  }

  IslandScene scene() const {
    IslandScene scene(static_cast<uint>(m_bodies.size()));
    for (uint i = 0; i < m_bodies.size(); ++i) {
      const int flags = m_bodies[i]->getCollisionFlags();
      uint kind = flags & btCollisionObject::CF_STATIC_OBJECT ? BODY_STATIC : 0;
      if (flags & btCollisionObject::CF_KINEMATIC_OBJECT) kind |= BODY_KINEMATIC;
      if (flags & btCollisionObject::CF_NO_CONTACT_RESPONSE) kind |= BODY_NO_RESPONSE;
      scene.setFlags(i, kind);
      scene.activation(i) = {m_bodies[i]->getActivationState(), m_bodies[i]->getDeactivationTime()};
    }
    const auto& dispatcher = static_cast<const btDispatcher&>(m_dispatcher);
    for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
      const auto* manifold = const_cast<btCollisionDispatcher&>(m_dispatcher).getManifoldByIndexInternal(m);
      scene.touch(static_cast<uint>(manifold->getBody0()->getUserIndex()),
                  static_cast<uint>(manifold->getBody1()->getUserIndex()), manifold->getNumContacts());
    }
    return scene;
  }

  // btDiscreteDynamicsWorld::calculateSimulationIslands and the solver's buildIslands.
  void decide() {
    btSimulationIslandManager& manager = *m_world.getSimulationIslandManager();
    manager.updateActivationState(&m_world, &m_dispatcher);
    manager.storeIslandActivationState(&m_world);
    manager.buildIslands(&m_dispatcher, &m_world);
  }
  const btRigidBody& body(size_t i) const { return *m_bodies[i]; }

 private:
  void add(std::mt19937& random) {
    const bool isStatic = random() % 8 == 0;
    btRigidBody::btRigidBodyConstructionInfo info(isStatic ? 0.0f : 1.0f, nullptr, &m_shape, btVector3(1, 1, 1));
    info.m_startWorldTransform.setIdentity();
    const float4 p = uniform3(random, -5, 5);
    info.m_startWorldTransform.setOrigin({p.x, p.y, p.z});
    m_bodies.push_back(std::make_unique<btRigidBody>(info));
    btRigidBody& body = *m_bodies.back();
    int flags = body.getCollisionFlags();
    if (!isStatic && random() % 8 == 0) flags |= btCollisionObject::CF_KINEMATIC_OBJECT;
    if (random() % 10 == 0) flags |= btCollisionObject::CF_NO_CONTACT_RESPONSE;
    body.setCollisionFlags(flags);
    body.setUserIndex(static_cast<int>(m_bodies.size()) - 1);
    m_world.addRigidBody(&body);
  }

  btDefaultCollisionConfiguration m_configuration;
  btCollisionDispatcher m_dispatcher{&m_configuration};
  btDbvtBroadphase m_broadphase;
  btSphereShape m_shape{0.7f};
  btDiscreteDynamicsWorld m_world;
  std::vector<std::unique_ptr<btRigidBody>> m_bodies;
};

class BuildIslandsAsBullet : public BuildIslandsTest {
 protected:
  void expectAsBullet(unsigned seed, int bodies) {
    BulletIslands bullet(seed, bodies);
    const IslandScene scene = bullet.scene();
    const auto result = device(scene);
    bullet.decide();
    std::vector<int> rootOfTag(static_cast<size_t>(bodies), -1);
    std::set<int> states;
    for (size_t i = 0; i < static_cast<size_t>(bodies); ++i) {
      EXPECT_EQ(result.activations[i].state, bullet.body(i).getActivationState()) << "body " << i;
      EXPECT_EQ(result.activations[i].deactivationTime, bullet.body(i).getDeactivationTime()) << "body " << i;
      states.insert(result.activations[i].state);
      const int tag = bullet.body(i).getIslandTag();
      if (tag < 0) continue;
      int& root = rootOfTag[static_cast<size_t>(tag)];
      if (root < 0) root = static_cast<int>(result.roots[i]);  // the lowest body of the tag comes first
      EXPECT_EQ(static_cast<int>(result.roots[i]), root) << "body " << i;
    }
    EXPECT_GE(states.size(), 4u) << "a scene in which hardly anything happens";
  }
};

TEST_F(BuildIslandsAsBullet, RandomSpheresSmall) { expectAsBullet(3, 40); }
TEST_F(BuildIslandsAsBullet, RandomSpheres) {
  for (unsigned seed = 0; seed < 8; ++seed) expectAsBullet(seed, 300);
}

}  // namespace
}  // namespace btgpu
