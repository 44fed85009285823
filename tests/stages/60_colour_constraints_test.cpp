// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/60_colour_constraints.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "gpu_engine/stages/60_colour_constraints_reference.h"
#include "kernels/lib/colour.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

// What stage 60 reads. Body 0 can't move.
struct ColourScene {
  uint bodyCount;
  std::vector<BodyStep> steps;
  std::vector<Manifold> manifolds;
  std::vector<uint> constraints;

  explicit ColourScene(uint bodies) : bodyCount(bodies), steps(bodies) {
    for (uint i = 1; i < bodies; ++i) steps[i].angularVelocity.w = 1;
  }
  void add(uint a, uint b, bool constrained = true, int points = 4) {
    if (constrained) constraints.push_back(static_cast<uint>(manifolds.size()));
    Manifold m{};
    m.bodyA = a;
    m.bodyB = b;
    m.pointCount = points;
    manifolds.push_back(m);
  }
};

Capacities enough(const ColourScene& scene) {
  Capacities room;
  room.pairs = std::max<size_t>(1, scene.manifolds.size());
  room.slots = scene.constraints.size() + (COLOUR_LIMIT + 1) * BTGPU_LANES;
  room.colourRounds = 3;  // the rest is for one group to do
  return room;
}

struct Colours {
  std::vector<uint> slotFirst;
  std::vector<SlotHeader> slots;
  StepCounters counters;
};

class ColourConstraintsTest : public DeviceTest {
 protected:
  bool isGpuShape() { return device().shape() == KernelShape::Gpu; }

  Colours colour(const ColourScene& scene, const Capacities& room, uint overflowBefore = 0) {
    WorldBuilder builder;
    for (uint i = 0; i < scene.bodyCount; ++i) builder.addFree();
    StageBench bench(queue(), builder.finish(), {}, room);
    DeviceWorld& world = bench.world();
    const uint count = static_cast<uint>(scene.constraints.size());
    StepCounters counters{};
    counters.overflow = overflowBefore;
    counters.constraintCount = count;
    bench.setCounters(counters);
    bench.write(world.constraintCount, {count});
    bench.setManifolds(scene.manifolds);
    bench.write(world.steps, scene.steps);
    bench.poison(world.constraints);
    bench.write(world.constraints, scene.constraints);
    bench.poison(world.slotFirst);
    bench.poison(world.slots);
    bench.run<ColourConstraints>();
    return {bench.read(world.slotFirst), bench.read(world.slots), bench.counters()};
  }

  // Runs the scene with room enough and compares everything with the reference.
  Colours expectAsReference(const ColourScene& scene) { return expectAsReference(scene, enough(scene).colourRounds); }
  Colours expectAsReference(const ColourScene& scene, uint rounds) {
    Capacities room = enough(scene);
    room.colourRounds = rounds;
    Colours actual = expectAsReference(scene, room);
    if (!isGpuShape()) return actual;
    room.colourGroups = std::max(1u, device().residentGroups());
    const Colours resident = expectAsReference(scene, room);
    EXPECT_EQ(resident.counters.colourRounds, actual.counters.colourRounds);
    return actual;
  }
  Colours expectAsReference(const ColourScene& scene, const Capacities& room) {
    Colours actual = colour(scene, room);
    const ColoursReference expected = colourConstraintsReference(scene.constraints, scene.manifolds, scene.steps);
    EXPECT_EQ(actual.counters.overflow, 0u);
    EXPECT_EQ(actual.counters.colourCount, expected.colourCount);
    EXPECT_EQ(actual.counters.largeColours, expected.largeColours);
    EXPECT_EQ(actual.counters.serialCount, expected.serialCount);
    EXPECT_EQ(actual.counters.slotCount, expected.slots.size());
    EXPECT_EQ(actual.slotFirst, expected.slotFirst);
    for (size_t s = 0; s < expected.slots.size(); ++s) {
      EXPECT_TRUE(sameBits(actual.slots[s], expected.slots[s])) << "slot " << s;
      if (HasFailure()) return actual;
    }
    for (size_t s = expected.slots.size(); s < actual.slots.size(); ++s) {
      EXPECT_TRUE(StageBench::isPoison(actual.slots[s])) << "written at slot " << s;
      if (HasFailure()) return actual;
    }
    expectValid(scene, actual);
    return actual;
  }

  // What any colouring must fulfil, without the reference.
  static void expectValid(const ColourScene& scene, const Colours& c) {
    std::vector<uint> manifolds;
    for (uint colour = 0; colour <= COLOUR_SERIAL; ++colour) {
      EXPECT_EQ(c.slotFirst[colour] % BTGPU_LANES, 0u);
      std::set<uint> moved;
      for (uint s = c.slotFirst[colour]; s < c.slotFirst[colour + 1]; ++s) {
        const SlotHeader& h = c.slots[s];
        if (h.manifold == NO_INDEX) {
          EXPECT_EQ(h.pointCount, 0u);
          EXPECT_EQ(h.bodyA & h.bodyB, NO_INDEX);
          continue;
        }
        manifolds.push_back(h.manifold);
        EXPECT_EQ(h.pointCount, static_cast<uint>(scene.manifolds[h.manifold].pointCount));
        for (const uint body : {h.bodyA, h.bodyB}) {
          if (body == NO_INDEX || colour == COLOUR_SERIAL) continue;
          EXPECT_TRUE(moved.insert(body).second) << "body " << body << " twice in colour " << colour;
        }
      }
    }
    std::sort(manifolds.begin(), manifolds.end());
    EXPECT_EQ(manifolds, scene.constraints) << "each constraint in one slot";
  }
};

// ---- the order

TEST(Permutation, IsInvertedAndComplete) {
  for (uint bits = 1; bits <= 17; ++bits) {
    std::vector<char> seen(size_t{1} << bits, 0);
    for (uint x = 0; x < seen.size(); ++x) {
      const uint y = permute(x, bits);
      ASSERT_LT(y, seen.size());
      ASSERT_FALSE(seen[y]++) << bits << " bits";
      ASSERT_EQ(unpermute(y, bits), x);
    }
  }
  std::mt19937 random(1);
  for (uint bits = 18; bits <= 32; ++bits) {
    for (int i = 0; i < 1000; ++i) {
      const uint x = random() & lowMask(bits);
      ASSERT_EQ(unpermute(permute(x, bits), bits), x);
    }
  }
}

TEST(Permutation, BitsOfACount) {
  EXPECT_EQ(indexBits(1), 1u);
  EXPECT_EQ(indexBits(2), 1u);
  EXPECT_EQ(indexBits(3), 2u);
  EXPECT_EQ(indexBits(256), 8u);
  EXPECT_EQ(indexBits(257), 9u);
  EXPECT_EQ(indexBits(0xffffffffu), 32u);
}

// ---- by hand

TEST_F(ColourConstraintsTest, NoneSmall) {
  const Colours c = expectAsReference(ColourScene(3));
  EXPECT_EQ(c.slotFirst, std::vector<uint>(COLOUR_TABLE, 0));
  EXPECT_EQ(c.counters.colourCount, 0u);
}

TEST_F(ColourConstraintsTest, OneSmall) {
  ColourScene scene(2);
  scene.add(0, 1);
  const Colours c = expectAsReference(scene);
  EXPECT_EQ(c.slots[0].bodyA, NO_INDEX) << "the fixed body is not named";
  EXPECT_EQ(c.slots[0].bodyB, 1u);
  EXPECT_EQ(c.counters.slotCount, static_cast<uint>(BTGPU_LANES));
}

TEST_F(ColourConstraintsTest, NeitherMovesSmall) {
  ColourScene scene(3);
  scene.steps[1].angularVelocity.w = scene.steps[2].angularVelocity.w = 0;
  scene.add(0, 1);
  scene.add(1, 2);
  EXPECT_EQ(expectAsReference(scene).counters.colourCount, 1u);
}

// All on the fixed body: one colour, whatever their number; whole blocks and one more or less.
TEST_F(ColourConstraintsTest, OneColourSmall) {
  for (const uint count : {1u, 31u, 32u, 33u, 63u}) {
    ColourScene scene(count + 1);
    for (uint i = 1; i <= count; ++i) scene.add(i % 2 ? 0 : i, i % 2 ? i : 0);
    const Colours c = expectAsReference(scene);
    EXPECT_EQ(c.counters.colourCount, 1u);
    EXPECT_EQ(c.counters.slotCount, (count + 31) / 32 * 32);
  }
}

// Manifolds that are not solved get no slot, and keep no two others apart.
TEST_F(ColourConstraintsTest, SomeManifoldsOnlySmall) {
  ColourScene scene(8);
  for (uint i = 1; i < 8; ++i) scene.add(i, (i + 1) % 8, i % 2 == 1, static_cast<int>(i % 5));
  EXPECT_EQ(expectAsReference(scene).counters.colourCount, 1u);
}

TEST_F(ColourConstraintsTest, TriangleSmall) {
  ColourScene scene(4);
  scene.add(1, 2);
  scene.add(2, 3);
  scene.add(3, 1);
  EXPECT_EQ(expectAsReference(scene).counters.colourCount, 3u);
}

// Pairs apart from each other all get the first colour.
TEST_F(ColourConstraintsTest, LargeColours) {
  for (const uint pairs : {SMALL_COLOUR, SMALL_COLOUR + 1}) {
    ColourScene scene(2 * pairs);
    for (uint i = 0; i < pairs; ++i) scene.add(2 * i, 2 * i + 1);
    EXPECT_EQ(expectAsReference(scene).counters.largeColours, pairs > SMALL_COLOUR ? 1u : 0u);
  }
}

// A body with more constraints than there are colours: the rest goes to the serial batch.
ColourScene star(uint arms) {
  ColourScene scene(arms + 2);
  for (uint i = 0; i < arms; ++i) scene.add(i % 3 ? 1 : i + 2, i % 3 ? i + 2 : 1);
  return scene;
}

TEST_F(ColourConstraintsTest, StarSmall) { EXPECT_EQ(expectAsReference(star(10)).counters.colourCount, 10u); }

TEST_F(ColourConstraintsTest, Stars) {
  for (const uint arms : {63u, 64u, 65u, 200u}) {
    const Colours c = expectAsReference(star(arms));
    EXPECT_EQ(c.counters.colourCount, std::min<uint>(arms, COLOUR_LIMIT));
    EXPECT_EQ(c.counters.serialCount, arms - std::min<uint>(arms, COLOUR_LIMIT));
  }
}

// Two hubs that share a constraint, one of them overfull.
TEST_F(ColourConstraintsTest, TwoHubs) {
  ColourScene scene(300);
  scene.add(1, 2);
  for (uint i = 3; i < 150; ++i) scene.add(1, i);
  for (uint i = 150; i < 200; ++i) scene.add(2, i);
  expectAsReference(scene);
}

// ---- random

ColourScene randomScene(uint bodies, uint count, unsigned seed) {
  std::mt19937 random(seed);
  ColourScene scene(bodies);
  for (uint i = 1; i < bodies; ++i) scene.steps[i].angularVelocity.w = random() % 10 ? 1.0f : 0.0f;
  while (scene.constraints.size() < count) {
    const uint a = random() % bodies, b = random() % bodies;
    if (a != b) scene.add(a, b, random() % 4 != 0, static_cast<int>(1 + random() % 4));
  }
  return scene;
}

TEST_F(ColourConstraintsTest, RandomSmall) {
  for (unsigned seed = 0; seed < 3; ++seed) expectAsReference(randomScene(31, 60, seed));
}

TEST_F(ColourConstraintsTest, Random) {
  expectAsReference(randomScene(100, 1023, 1));  // some 20 constraints a body
  expectAsReference(randomScene(1000, 1025, 2));
  expectAsReference(randomScene(20000, 60000, 3));
}

TEST_F(ColourConstraintsTest, LongChain) {
  ColourScene scene(20001);
  for (uint i = 1; i < 20000; ++i) scene.add(i, i + 1);
  EXPECT_LE(expectAsReference(scene).counters.colourCount, 3u) << "greedy needs at most one more than the degree";
}

// ---- overflows

TEST_F(ColourConstraintsTest, SlotOverflowSmall) {
  const ColourScene scene = star(3);
  Capacities room = enough(scene);
  room.slots = 3 * BTGPU_LANES;
  EXPECT_EQ(colour(scene, room).counters.overflow, 0u) << "just enough";
  room.slots = 2 * BTGPU_LANES;
  const Colours c = colour(scene, room);
  EXPECT_EQ(c.counters.overflow, OVERFLOW_SLOTS);
  EXPECT_EQ(c.counters.slotCount, 3u * BTGPU_LANES) << "what is needed";
  EXPECT_TRUE(StageBench::isPoison(c.slots[0]));
}

// How many rounds get a launch is no concern of the result. The CPU shape colours in one pass.
TEST_F(ColourConstraintsTest, AnyNumberOfRoundsSmall) {
  for (const uint rounds : {0u, 1u, 9u, 11u}) {
    EXPECT_EQ(expectAsReference(star(9), rounds).counters.colourRounds, 0u) << "not worth a launch";
  }
}

TEST_F(ColourConstraintsTest, AnyNumberOfRounds) {
  const ColourScene scene = randomScene(3000, 15000, 1);
  const uint worth = expectAsReference(scene, 0).counters.colourRounds;
  EXPECT_EQ(worth > 0, isGpuShape());
  for (const uint rounds : {1u, worth / 2, worth, worth + 1, worth + 5}) {
    EXPECT_EQ(expectAsReference(scene, rounds).counters.colourRounds, worth) << rounds;
  }
}

// A body that has all colours sends its other constraints to the serial batch, in a round with a launch or later.
TEST_F(ColourConstraintsTest, FullBodies) {
  for (const uint rounds : {0u, 64u, 65u, 69u}) {
    EXPECT_EQ(expectAsReference(star(100), rounds).counters.serialCount, 100u - COLOUR_LIMIT);
  }
  EXPECT_EQ(expectAsReference(star(20000), 70).counters.colourRounds, isGpuShape() ? COLOUR_LIMIT + 2u : 0u);
}

// Groups that can't all run at the same time do nothing, and say so.
TEST_F(ColourConstraintsTest, GroupsThatAreAbsent) {
  if (!isGpuShape()) return;  // the CPU shape has none, and waits for nobody
  const ColourScene scene = star(3);
  Capacities room = enough(scene);
  room.colourGroups = 16000;
  const Colours c = colour(scene, room);
  EXPECT_EQ(c.counters.overflow, OVERFLOW_ABSENT);
  EXPECT_TRUE(StageBench::isPoison(c.slots[0]));
}

TEST_F(ColourConstraintsTest, NothingAfterOverflowSmall) {
  const ColourScene scene = star(3);
  const Colours c = colour(scene, enough(scene), OVERFLOW_PAIRS);
  EXPECT_EQ(c.counters.overflow, OVERFLOW_PAIRS) << "the first overflow alone is told";
  EXPECT_EQ(c.counters.slotCount, 0u);
  EXPECT_TRUE(StageBench::isPoison(c.slots[0]));
}

}  // namespace
}  // namespace btgpu
