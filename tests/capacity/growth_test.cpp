// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Every array grows as needed: a step that overflowed is done again, and comes out bit for bit as in a world
// that had room for everything from the start. Nothing is dropped, whatever the numbers.

#include <algorithm>

#include "gpu_engine/world_engine.h"
#include "tests/support/device_test.h"
#include "tests/support/roomy_world.h"
#include "tests/support/scoped_environment.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

// Room for `pairs`, all of them in contact, in any number of colours.
Capacities roomFor(size_t bodies, size_t pairs, uint rounds = 100) {
  return {bodies, pairs, pairs + (COLOUR_LIMIT + 1) * BTGPU_LANES, COLOUR_LIMIT, rounds};
}

// The first `count` bodies of `all`, those from `known` on new.
void growTo(WorldInput& input, const WorldInput& all, uint count) {
  const auto grow = [&](auto& to, const auto& from) {
    for (uint i = input.bodyCount; i < count; ++i) {
      to.values.push_back(from.values[i]);
      to.changed.push_back(i);
    }
  };
  grow(input.infos, all.infos);
  grow(input.poses, all.poses);
  grow(input.velocities, all.velocities);
  grow(input.forces, all.forces);
  grow(input.masses, all.masses);
  grow(input.materials, all.materials);
  grow(input.dampings, all.dampings);
  grow(input.activations, all.activations);
  for (uint i = input.bodyCount; i < count; ++i) input.born.push_back(i);
  if (input.bodyCount == 0) input.shapes = all.shapes;
  input.bodyCount = count;
}

void place(WorldInput& input, uint body, float4 position) {
  input.poses.values[body].position = position;
  input.velocities.values[body] = {};
  input.poses.changed.push_back(body);
  input.velocities.changed.push_back(body);
}

// Points beyond a manifold's count are whatever its place held before.
bool sameManifolds(std::vector<Manifold> a, std::vector<Manifold> b) {
  for (std::vector<Manifold>* manifolds : {&a, &b}) {
    for (Manifold& m : *manifolds) std::fill(m.points + m.pointCount, m.points + MANIFOLD_POINTS, ContactPoint{});
  }
  return same(a, b);
}

// The engine beside a world with room, fed with the same input.
class Growth : public DeviceTest {
 protected:
  StepSettings settings() {
    StepSettings s;
    s.keepContacts = true;
    return s;
  }

  // Steps both and compares all that comes out. The input then holds the results.
  StepResults stepBoth(WorldEngine& engine, RoomyWorld& roomy, WorldInput& input, const std::string& what) {
    const StepResults expected = roomy.step(input, settings());
    EXPECT_EQ(expected.counters.overflow, 0u) << what << ": the test's own room is too small";
    StepResults results;
    engine.begin(input, settings());
    engine.finish(results);
    expectSame(results, expected, what);
    accept(input, results);
    return results;
  }

  static void expectSame(const StepResults& a, const StepResults& b, const std::string& what) {
    EXPECT_TRUE(same(a.poses, b.poses)) << what;
    EXPECT_TRUE(same(a.velocities, b.velocities)) << what;
    EXPECT_TRUE(same(a.activations, b.activations)) << what;
    EXPECT_TRUE(sameManifolds(a.manifolds, b.manifolds)) << what;
    EXPECT_TRUE(sameBits(a.counters, b.counters)) << what;
  }

  static void accept(WorldInput& input, const StepResults& results) {
    input.poses.values = results.poses;
    input.velocities.values = results.velocities;
    input.activations.values = results.activations;
    input.clearChanges();
  }
};

// Balls and boxes in a heap of touching layers on a plane, falling.
WorldInput heap(uint bodies, uint side) {
  WorldBuilder b;
  const int plane = b.plane({0, 1, 0, 0}, 0), ball = b.sphere(0.5f), box = b.box({0.5f, 0.5f, 0.5f, 0});
  b.add(plane, {0, 0, 0, 0}, 0);
  for (uint i = 0; i + 1 < bodies; ++i) {
    const uint x = i % side, z = i / side % side, y = i / side / side;
    const float shift = y % 2 ? 0.45f : 0;
    b.add((x + y + z) % 2 ? ball : box,
          {0.97f * float(x) + shift, 0.49f + 0.97f * float(y), 0.97f * float(z) + shift, 0});
    b.forces(i + 1).force = {0, -10, 0, 0};
  }
  return b.finish();
}

// A solver whose groups can't all run at once: the step is done again, and others are not tried that way.
TEST_F(Growth, AbsentGroupsOfTheSolver) {
  const ScopedVariable groups("BTGPU_RESIDENT_GROUPS", "4000");
  WorldInput input = heap(40, 3);
  RoomyWorld roomy(queue(), roomFor(40, 500));
  WorldEngine engine({});
  for (int step = 0; step < 3; ++step) {
    const StepResults results = stepBoth(engine, roomy, input, std::to_string(step));
    EXPECT_EQ(results.redos, step == 0 && device().shape() == KernelShape::Gpu ? 1 : 0);
  }
}

TEST_F(Growth, FromOneBodyToThousands) {
  const WorldInput all = heap(3001, 15);
  WorldInput input;
  WorldEngine engine({});
  RoomyWorld roomy(queue(), roomFor(3001, 60000));
  int redos = 0;
  for (const uint size : {1u, 2u, 33u, 128u, 129u, 700u, 3001u}) {
    growTo(input, all, size);
    for (int k = 0; k < 2; ++k) {
      const StepResults r = stepBoth(engine, roomy, input, std::to_string(size) + " bodies");
      EXPECT_EQ(r.poses.size(), size);
      EXPECT_EQ(r.manifolds.size(), r.counters.pairCount);
      redos += r.redos;
      if (k == 1) { EXPECT_EQ(r.redos, 0) << size; }
    }
  }
  EXPECT_GE(redos, 3);
}

// All bodies of a wide field put into one place: each overlaps each other.
TEST_F(Growth, PairsOfAllBodiesInOneStep) {
  constexpr uint kBodies = 500, kPairs = kBodies * (kBodies - 1) / 2;
  WorldBuilder b;
  const int ball = b.sphere(0.5f), box = b.box({0.5f, 0.5f, 0.5f, 0});
  for (uint i = 0; i < kBodies; ++i) b.add(i % 3 ? ball : box, {3.0f * float(i), 0, 0, 0});
  WorldInput input = b.finish();
  WorldEngine engine({});
  RoomyWorld roomy(queue(), roomFor(kBodies, kPairs, 800));
  EXPECT_EQ(stepBoth(engine, roomy, input, "apart").counters.pairCount, 0u);

  std::mt19937 random(5);
  for (uint i = 0; i < kBodies; ++i) place(input, i, uniform3(random, -0.1f, 0.1f));
  const StepResults together = stepBoth(engine, roomy, input, "together");
  EXPECT_EQ(together.counters.pairCount, kPairs);
  EXPECT_EQ(together.counters.constraintCount, kPairs);
  EXPECT_EQ(together.counters.colourCount, uint{COLOUR_LIMIT});
  EXPECT_GT(together.counters.serialCount, 0u);
  EXPECT_GE(together.redos, 2);

  for (uint i = 0; i < kBodies; ++i) place(input, i, {3.0f * float(i), 0, 0, 0});
  EXPECT_EQ(stepBoth(engine, roomy, input, "apart again").counters.pairCount, 0u);
}

// A plate with n balls on it, each touching the plate alone: n colours are needed, and beyond 64 the serial
// batch.
TEST_F(Growth, ManyConstraintsOnOneBody) {
  for (const uint n : {16u, 17u, 63u, 64u, 65u, 97u, 300u}) {
    WorldBuilder b;
    b.add(b.box({40, 0.5f, 40, 0}), {0, 0, 0, 0}, 100);
    const int ball = b.sphere(0.5f);
    for (uint i = 0; i < n; ++i) b.add(ball, {2.0f * float(i % 18) - 18, 5, 2.0f * float(i / 18) - 18, 0});
    WorldInput input = b.finish();
    WorldEngine engine({});
    RoomyWorld roomy(queue(), roomFor(n + 1, 1000, 400));
    const std::string what = std::to_string(n) + " balls";
    EXPECT_EQ(stepBoth(engine, roomy, input, what).counters.constraintCount, 0u);

    for (uint i = 1; i <= n; ++i) {
      float4 p = input.poses.values[i].position;
      p.y = 0.99f;
      place(input, i, p);
    }
    const StepResults r = stepBoth(engine, roomy, input, what);
    EXPECT_EQ(r.counters.constraintCount, n);
    EXPECT_EQ(r.counters.colourCount, std::min<uint>(n, COLOUR_LIMIT));
    EXPECT_EQ(r.counters.serialCount, n > COLOUR_LIMIT ? n - COLOUR_LIMIT : 0u);
    if (n > 60) { EXPECT_GE(r.redos, 1) << what << ": each colour needs a block of slots, and there were enough"; }
    EXPECT_EQ(stepBoth(engine, roomy, input, what).redos, 0) << what;
  }
}

// Manifolds from the stock path, more of them than the engine has room for in its first step.
TEST_F(Growth, ManifoldsOfTheStockPath) {
  const WorldInput all = heap(400, 7);
  WorldInput input = all;
  RoomyWorld first(queue(), roomFor(400, 10000));
  StepResults r;
  for (int i = 0; i < 3; ++i) {
    r = first.step(input, settings());
    accept(input, r);
  }
  ASSERT_EQ(r.counters.overflow, 0u);
  // The stock path knows many more pairs than there will be in the next step: all others came apart.
  std::vector<Manifold> known;
  for (uint a = 0; a < 400; ++a) {
    for (uint c = a + 1; c < 400; ++c) {
      Manifold m{};
      m.bodyA = a;
      m.bodyB = c;
      m.breakingThreshold = 0.02f;
      known.push_back(m);
    }
  }
  const auto order = [](const Manifold& x, const Manifold& y) {
    return pairKeyOf(x.bodyA, x.bodyB) < pairKeyOf(y.bodyA, y.bodyB);
  };
  for (const Manifold& m : r.manifolds) { *std::lower_bound(known.begin(), known.end(), m, order) = m; }
  const StepResults expected = first.step(input, settings());
  ASSERT_EQ(expected.counters.overflow, 0u);

  // To an engine that knows nothing yet all bodies are new, and the manifolds are theirs nevertheless.
  WorldInput again = all;
  again.poses.values = input.poses.values;
  again.velocities.values = input.velocities.values;
  again.activations.values = input.activations.values;
  again.replaceManifolds = true;
  again.manifolds = known;
  WorldEngine engine({});
  StepResults results;
  engine.begin(again, settings());
  engine.finish(results);
  EXPECT_TRUE(same(results.poses, expected.poses));
  EXPECT_TRUE(same(results.velocities, expected.velocities));
  EXPECT_TRUE(sameManifolds(results.manifolds, expected.manifolds));
}

// The room that a step needs, found in a world that has plenty.
class ExactRoom : public Growth {
 protected:
  void expectFits(const WorldInput& world, const Capacities& room, const StepResults& expected, const char* what) {
    RoomyWorld roomy(queue(), room);
    const StepResults r = roomy.step(world, settings());
    EXPECT_EQ(r.counters.overflow, 0u) << what;
    expectSame(r, expected, what);
  }
  void expectOverflow(const WorldInput& world, const Capacities& room, uint flag, const char* what) {
    RoomyWorld roomy(queue(), room);
    EXPECT_EQ(roomy.step(world, settings()).counters.overflow, flag) << what;
    EXPECT_TRUE(roomy.untouched()) << what << ": the step can't be repeated";
  }

  // Exactly the room that is needed, and one less, of each kind.
  void exactAndOneOver(const WorldInput& world, const Capacities& plenty) {
    RoomyWorld roomy(queue(), plenty);
    const StepResults expected = roomy.step(world, settings());
    const StepCounters& c = expected.counters;
    ASSERT_EQ(c.overflow, 0u);
    EXPECT_FALSE(roomy.untouched()) << "nothing happens in this world";
    Capacities exact = plenty;
    exact.pairs = c.pairCount;
    exact.slots = c.slotCount;
    exact.colourRounds = 0;  // one group does what is not launched
    expectFits(world, exact, expected, "all exact");

    Capacities less = exact;
    --less.pairs;
    expectOverflow(world, less, OVERFLOW_PAIRS, "pairs");
    less = exact;
    less.slots -= BTGPU_LANES;
    expectOverflow(world, less, OVERFLOW_SLOTS, "slots");
  }
};

// Few launches, for the interpreter: it sees accesses beyond the end, where the room is just enough or too
// little.
TEST_F(ExactRoom, HeapSmall) {
  StepSettings quick = settings();
  quick.iterations = 1;
  quick.warmStarting = false;
  const WorldInput world = heap(10, 2);
  Capacities room{10, 64, 512, 8, 16};
  RoomyWorld plenty(queue(), room);
  const StepCounters c = plenty.step(world, quick).counters;
  ASSERT_EQ(c.overflow, 0u);
  ASSERT_GT(c.pairCount, 16u);
  room.pairs = c.pairCount;
  room.slots = c.slotCount;
  RoomyWorld exact(queue(), room);
  EXPECT_EQ(exact.step(world, quick).counters.overflow, 0u);
  --room.pairs;
  RoomyWorld less(queue(), room);
  EXPECT_EQ(less.step(world, quick).counters.overflow, OVERFLOW_PAIRS);
  EXPECT_TRUE(less.untouched());
}

TEST_F(ExactRoom, Heap) { exactAndOneOver(heap(700, 8), roomFor(700, 9000)); }

TEST_F(ExactRoom, SerialBatch) {
  WorldBuilder b;
  b.add(b.box({40, 0.5f, 40, 0}), {0, 0, 0, 0}, 100);
  const int ball = b.sphere(0.5f);
  for (uint i = 0; i < 70; ++i) b.add(ball, {2.0f * float(i % 18) - 18, 0.99f, 2.0f * float(i / 18) - 18, 0});
  exactAndOneOver(b.finish(), roomFor(71, 300, 100));
}

// The engine's own room at its edge: no step is repeated while it suffices.
TEST_F(ExactRoom, PairCapacityOfTheEngine) {
  const WorldInput world = heap(700, 8);
  RoomyWorld roomy(queue(), roomFor(700, 9000));
  const StepResults expected = roomy.step(world, settings());
  const uint pairs = expected.counters.pairCount;
  ASSERT_GT(pairs, 6 * 700u) << "the engine starts with six pairs a body anyway";
  for (const uint room : {pairs, pairs - 1}) {
    EngineSettings engineSettings;
    engineSettings.pairCapacity = room;
    WorldEngine engine(engineSettings);
    StepResults r;
    engine.begin(world, settings());
    engine.finish(r);
    expectSame(r, expected, "room for " + std::to_string(room));
    if (room < pairs) { EXPECT_GE(r.redos, 1); }
  }
}

}  // namespace
}  // namespace btgpu
