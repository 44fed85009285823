// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// All ways of finding pairs on the same worlds: each against the reference, which tries every body with every other.
#include "gpu_engine/stages/30_pair_finders.h"

#include <btBulletCollisionCommon.h>

#include <algorithm>
#include <set>

#include "gpu_engine/stages/30_find_pairs_reference.h"
#include "tests/support/aabb_world.h"
#include "tests/support/bullet_convert.h"

namespace btgpu {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kMinAndMax[] = {1e-4f, 1e4f};

float4 cube(float halfExtent) { return AabbWorld::cube(halfExtent); }

class PairFindersTest : public DeviceTest {
 protected:
  // Kept open from case to case, with its programs.
  static void SetUpTestSuite() { s_device = ComputeDevice::open("", ComputeDevice::debugKernelsWanted()); }
  static void TearDownTestSuite() { s_device.reset(); }

  FoundPairs find(const AabbWorld& w, size_t capacity, uint overflowBefore = 0) {
    return findPairs(
        queue(), w, capacity, [this](Queue& q, DeviceWorld& world) { m_finders.enqueue(q, world, m_finder); },
        overflowBefore);
  }
  // Returns the number of pairs.
  size_t expectAsReference(const AabbWorld& w) {
    const auto expected = findPairsReference(w.world.finish().infos.values, w.aabbs);
    const FoundPairs found = find(w, expected.size() + 100);
    EXPECT_EQ(found.counters.overflow, 0u);
    EXPECT_EQ(found.counters.pairCount, expected.size());
    EXPECT_TRUE(found.keys == expected) << found.keys.size() << " pairs instead of " << expected.size();
    return expected.size();
  }

  // One of each for all worlds of a case: what it remembers of the world before must not show.
  PairFinders m_finders{device()};
  PairFinder m_finder = PairFinder::Bvh;

 private:
  static std::shared_ptr<ComputeDevice> s_device;
};

std::shared_ptr<ComputeDevice> PairFindersTest::s_device;

class EachPairFinder : public PairFindersTest, public ::testing::WithParamInterface<PairFinder> {
 protected:
  EachPairFinder() { m_finder = GetParam(); }
};

std::string nameOf(const ::testing::TestParamInfo<PairFinder>& finder) {
  const char* names[] = {"Bvh", "Grid", "Sweep", "IncrementalSweep", "BruteForce"};
  return names[static_cast<int>(finder.param)];
}
INSTANTIATE_TEST_SUITE_P(All, EachPairFinder,
                         ::testing::Values(PairFinder::Bvh, PairFinder::Grid, PairFinder::Sweep,
                                           PairFinder::IncrementalSweep, PairFinder::BruteForce),
                         nameOf);

// ---- worlds ---------------------------------------------------------------------------------------------------------

TEST_P(EachPairFinder, NoneOneTwo) {
  AabbWorld w;
  EXPECT_EQ(expectAsReference(w), 0u);
  w.add({}, cube(1));
  EXPECT_EQ(expectAsReference(w), 0u);
  w.add({1, 1, 1, 0}, cube(1));
  EXPECT_EQ(expectAsReference(w), 1u);
  EXPECT_EQ(expectAsReference(AabbWorld()), 0u);
}

TEST_P(EachPairFinder, TouchingCountsAndOneUlpApartDoesNot) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const float gap : {0.0f, 1.0f}) {
      AabbWorld w;
      w.add({}, cube(1));
      w.add({}, cube(1));
      (&w.aabbs[1].lower.x)[axis] = gap == 0 ? 1 : std::nextafter(1.0f, 2.0f);
      (&w.aabbs[1].upper.x)[axis] = 3;
      EXPECT_EQ(expectAsReference(w), gap == 0 ? 1u : 0u);
    }
    AabbWorld zero;  // -0 and 0 are equal
    zero.add({}, cube(1));
    zero.add({}, cube(1));
    (&zero.aabbs[0].upper.x)[axis] = -0.0f;
    (&zero.aabbs[1].lower.x)[axis] = 0.0f;
    EXPECT_EQ(expectAsReference(zero), 1u);
  }
}

TEST_P(EachPairFinder, RandomOfAllCounts) {
  std::mt19937 random(2);
  for (const uint count : {2u, 7u, 8u, 9u, 63u, 64u, 65u, 127u, 128u, 129u, 257u, 1000u, 3001u, 100u}) {
    SCOPED_TRACE(count);
    expectAsReference(randomAabbs(random, count));
  }
}

TEST_P(EachPairFinder, HugeAndTinyMixed) {
  std::mt19937 random(4);
  for (const uint count : {50u, 900u}) {
    AabbWorld w;
    for (uint i = 0; i < count; ++i) {
      w.add(uniform3(random, -100, 100), cube(std::pow(10.0f, uniform(random, -4, 2))), random() % 5 == 0 ? 0 : 1);
    }
    EXPECT_GT(expectAsReference(w), 0u);
  }
}

TEST_P(EachPairFinder, ExtremeSizes) {
  std::mt19937 random(20);
  for (const float size : kMinAndMax) {
    AabbWorld w;
    for (uint i = 0; i < 400; ++i) w.add(uniform3(random, -5 * size, 5 * size), uniform3(random, 0, size));
    for (uint i = 0; i < 20; ++i) w.add(uniform3(random, -5 * size, 5 * size), {});  // points
    EXPECT_GT(expectAsReference(w), 100u);
  }
}

TEST_P(EachPairFinder, FarFromTheOrigin) {
  std::mt19937 random(21);
  AabbWorld w;  // a few floats wide, so that all is rounded
  for (uint i = 0; i < 300; ++i) w.add(uniform3(random, 1e7f, 1e7f + 40), cube(1));
  EXPECT_GT(expectAsReference(w), 50u);
}

TEST_P(EachPairFinder, AllInOneCell) {
  std::mt19937 random(5);
  AabbWorld w;
  for (int i = 0; i < 150; ++i) w.add(uniform3(random, -1e-6f, 1e-6f), cube(uniform(random, 0, 1e-6f)));
  w.add({1e4f, 1e4f, 1e4f, 0}, cube(1));  // makes the cell of all others tiny
  w.add({-1e4f, -1e4f, -1e4f, 0}, cube(1));
  EXPECT_GT(expectAsReference(w), 0u);
}

TEST_P(EachPairFinder, AllOnOneAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    AabbWorld w;
    for (int i = 0; i < 200; ++i) {
      float4 centre{};
      (&centre.x)[axis] = static_cast<float>(i * 7 % 200);
      w.add(centre, cube(1.25f));
    }
    EXPECT_EQ(expectAsReference(w), 199u + 198u);  // each with its next two
  }
}

// Far more cells than numbers for them, on one plane and in rows: neighbours across every border of the numbers.
TEST_P(EachPairFinder, CellsThatShareANumber) {
  std::mt19937 random(22);
  for (const float4 extent : {float4{300, 300, 300, 0}, float4{1000, 1, 1000, 0}, float4{1, 3000, 1, 0}}) {
    AabbWorld w;
    for (uint i = 0; i < 600; ++i) {
      const float4 at = uniform3(random, -1, 1);
      const float4 centre{at.x * extent.x, at.y * extent.y, at.z * extent.z, 0};
      w.add(centre, cube(0.5f));
      w.add(centre + uniform3(random, -1.1f, 1.1f), cube(0.5f));
    }
    EXPECT_GT(expectAsReference(w), 200u);
  }
}

TEST_P(EachPairFinder, AllIdentical) {
  AabbWorld points, cubes;
  for (int i = 0; i < 300; ++i) {
    points.add({}, {});
    cubes.add({3, 4, 5, 0}, cube(1));
  }
  EXPECT_EQ(expectAsReference(points), 300u * 299u / 2);
  EXPECT_EQ(expectAsReference(cubes), 300u * 299u / 2);
}

TEST_P(EachPairFinder, PlanesAndInfiniteBoxes) {
  std::mt19937 random(6);
  AabbWorld w = randomAabbs(random, 700, 0.3f);
  w.addPlane();
  w.world.info(w.addPlane()).filterMask = -1;
  w.aabbs[w.add({}, cube(1))] = {{-kInfinity, -kInfinity, -kInfinity, 0}, {kInfinity, kInfinity, kInfinity, 0}};
  w.aabbs[w.add({}, cube(1))] = {{-1e18f, -3, -3, 0}, {1e18f, 3, 3, 0}};
  w.addFree();
  EXPECT_GT(expectAsReference(w), 700u);
  AabbWorld planes;
  for (int i = 0; i < 3; ++i) planes.world.info(planes.addPlane()).filterMask = -1;
  EXPECT_EQ(expectAsReference(planes), 3u);
}

TEST_P(EachPairFinder, StaticsAgainstDynamics) {
  std::mt19937 random(7);
  for (const float share : {0.0f, 0.5f, 0.97f, 1.0f}) {
    EXPECT_EQ(expectAsReference(randomAabbs(random, 160, share)) == 0, share == 1.0f);
  }
}

TEST_P(EachPairFinder, RandomFilters) {
  std::mt19937 random(9);
  AabbWorld w = randomAabbs(random, 700);
  for (uint i = 0; i < 700; ++i) {
    w.world.info(i).filterGroup = 1 << random() % 3;
    w.world.info(i).filterMask = static_cast<int>(random() % 8);
  }
  EXPECT_GT(expectAsReference(w), 0u);
}

TEST_P(EachPairFinder, WhatTakesNoPartIsNeverPaired) {
  std::mt19937 random(10);
  AabbWorld w;
  for (int i = 0; i < 200; ++i) {
    if (random() % 3 == 0) w.addFree();
    const uint body = w.add(uniform3(random, -2, 2), cube(0.7f));
    const uint reason = random() % 12;
    if (reason == 0) w.world.info(body).flags |= BODY_QUARANTINED;
    if (reason == 1) w.world.info(body).flags &= ~BODY_PRESENT;
    if (reason == 2) w.world.info(body).shapeIndex = -1;
    if (reason <= 2 && random() % 2) w.aabbs[body] = AabbWorld::noAabb();
  }
  EXPECT_GT(expectAsReference(w), 0u);
  for (uint i = 0; i < w.count(); ++i) w.remove(i);
  EXPECT_EQ(expectAsReference(w), 0u);
}

// Shapes of one compound don't meet, in whatever slots they are.
TEST_P(EachPairFinder, ShapesOfCompounds) {
  std::mt19937 random(24);
  AabbWorld w;
  for (uint i = 0; i < 300; ++i) {
    BodyInfo& info = w.world.info(w.add(uniform3(random, -3, 3), cube(0.7f)));
    if (random() % 4 == 0) continue;
    info.flags |= BODY_CHILD;
    info.parent = random() % 20;
  }
  const size_t before = expectAsReference(w);
  EXPECT_GT(before, 300u);
  for (uint i = 0; i < 300; i += 2) w.world.info(i).parent = 7;  // nothing moves
  EXPECT_LT(expectAsReference(w), before);
}

// What has no AABB yet, lower beyond upper, still overlaps what reaches beyond both.
TEST_P(EachPairFinder, EmptyBoxes) {
  std::mt19937 random(23);
  AabbWorld w = randomAabbs(random, 200, 0);
  for (uint i = 0; i < 200; i += 7) w.aabbs[i] = {{1, 1, 1, 0}, {-1, -1, -1, 0}};
  w.add({}, cube(2));
  EXPECT_GT(expectAsReference(w), 20u);
}

TEST_P(EachPairFinder, CapacityReachedAndExceeded) {
  std::mt19937 random(11);
  for (const uint count : {20u, 1500u}) {
    const AabbWorld w = randomAabbs(random, count);
    const auto expected = findPairsReference(w.world.finish().infos.values, w.aabbs);
    const FoundPairs exact = find(w, expected.size());
    EXPECT_EQ(exact.counters.overflow, 0u);
    EXPECT_TRUE(exact.keys == expected);
    for (const size_t missing : {size_t{1}, expected.size() / 2, expected.size() - 1}) {
      const FoundPairs tooMany = find(w, expected.size() - missing);
      EXPECT_EQ(tooMany.counters.overflow, OVERFLOW_PAIRS);
      EXPECT_EQ(tooMany.counters.pairCount, expected.size());
      for (const ulong key : tooMany.keys) ASSERT_TRUE(StageBench::isPoison(key));
    }
    EXPECT_TRUE(find(w, expected.size()).keys == expected);  // the step done again
  }
}

// ---- steps ----------------------------------------------------------------------------------------------------------

// What may happen to a body between two steps.
void disturb(std::mt19937& random, AabbWorld& w, uint body, float extent) {
  const auto place = [&](float4 centre, float4 half) { w.aabbs[body] = {centre - half, centre + half}; };
  switch (random() % 7) {
    case 0:
      return w.remove(body);
    case 1: {  // another body in the same slot, or one that comes back
      w.world.info(body) = w.world.info(0);
      w.world.info(body).filterMask = -1;
      return place(uniform3(random, -extent, extent), uniform3(random, 0.2f, 0.9f));
    }
    case 2:
      w.world.info(body).filterMask ^= 1;
      return;
    case 3:
      w.world.info(body).flags ^= BODY_QUARANTINED;
      return;
    case 4:
      return place(uniform3(random, -extent, extent), uniform3(random, 0.2f, 3.0f));
    case 5:
      w.aabbs[body].upper = w.aabbs[body].upper + uniform3(random, 0, 2);
      return;
    default:
      w.world.info(body).flags ^= BODY_KINEMATIC;
  }
}

// What leaves the scene comes back at its middle.
void move(std::mt19937& random, AabbWorld& w, float speed) {
  for (uint i = 1; i < w.count(); ++i) {
    if (w.info(i).flags == 0 || random() % 4 == 0) continue;
    const float4 at = w.aabbs[i].lower;
    if (std::max({std::fabs(at.x), std::fabs(at.y), std::fabs(at.z)}) > 7) w.aabbs[i] = {{}, cube(0.7f)};
    const float4 by = uniform3(random, -speed, speed), grow = uniform3(random, -0.1f * speed, 0.1f * speed);
    w.aabbs[i] = {w.aabbs[i].lower + by - grow, w.aabbs[i].upper + by + grow};
  }
}

TEST_P(EachPairFinder, BodiesComeGoAndMove) {
  std::mt19937 random(31);
  for (const float speed : {0.02f, 0.4f, 3.0f}) {
    AabbWorld w = randomAabbs(random, 250);
    for (int step = 0; step < 40; ++step) {
      SCOPED_TRACE(testing::Message() << "speed " << speed << ", step " << step);
      EXPECT_GT(expectAsReference(w), 50u);
      move(random, w, speed);
      for (int k = 0; k < 5; ++k) disturb(random, w, 1 + random() % (w.count() - 1), 5);
      if (step % 10 == 3) w.add(uniform3(random, -5, 5), cube(1));
      if (step % 10 == 5) find(w, 50);                     // a step that finds no room
      if (step % 10 == 7) find(w, 5000, OVERFLOW_BEFORE);  // one that is to do nothing
      if (::testing::Test::HasFailure()) return;
    }
  }
}

// On a lattice many ends are equal, before and after.
TEST_P(EachPairFinder, StepsOnALattice) {
  std::mt19937 random(32);
  AabbWorld w;
  for (int i = 0; i < 150; ++i) w.add({}, cube(1));
  for (int step = 0; step < 60; ++step) {
    SCOPED_TRACE(step);
    for (uint i = 0; i < w.count(); ++i) {
      if (random() % 3) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const float lower = float(int(random() % 9)) - 4.0f;
        (&w.aabbs[i].lower.x)[axis] = lower == 0 && random() % 2 ? -0.0f : lower;
        (&w.aabbs[i].upper.x)[axis] = lower + float(random() % 4) - float(random() % 20 == 0);  // some are empty
      }
    }
    EXPECT_GT(expectAsReference(w), 300u);
    if (::testing::Test::HasFailure()) return;
  }
}

// What a finder remembers is of a world with more bodies, or fewer.
TEST_P(EachPairFinder, OtherWorldsInTurn) {
  std::mt19937 random(33);
  for (const uint count : {300u, 20u, 301u, 1u, 0u, 150u, 150u}) {
    SCOPED_TRACE(count);
    expectAsReference(randomAabbs(random, count));
  }
}

// Oclgrind takes seconds for each world. All kinds at once, then a step in which all of them change.
class PairFindersTwice : public PairFindersTest {
 protected:
  void expectAllKindsTwice(PairFinder finder) {
    m_finder = finder;
    std::mt19937 random(14);
    AabbWorld w = randomAabbs(random, 7, 0.1f);
    w.aabbs[w.add({}, cube(1))] = {{-6, -3, -3, 0}, {6, 3, 3, 0}};
    w.addFree();
    w.world.info(w.add({}, cube(1))).flags |= BODY_QUARANTINED;
    w.world.info(w.add({}, cube(1))).filterMask = 2;
    w.addPlane();
    EXPECT_GT(expectAsReference(w), 5u);
    move(random, w, 0.5f);
    w.remove(3);
    w.aabbs[4] = {{1, 1, 1, 0}, {2, 2, 2, 0}};
    EXPECT_GT(expectAsReference(w), 5u);
  }
};
TEST_F(PairFindersTwice, GridSmall) { expectAllKindsTwice(PairFinder::Grid); }
TEST_F(PairFindersTwice, SweepSmall) { expectAllKindsTwice(PairFinder::Sweep); }
TEST_F(PairFindersTwice, IncrementalSweepSmall) { expectAllKindsTwice(PairFinder::IncrementalSweep); }
TEST_F(PairFindersTwice, BruteForceSmall) { expectAllKindsTwice(PairFinder::BruteForce); }

// ---- Bullet ---------------------------------------------------------------------------------------------------------

// Bullet's dynamic tree keeps pairs of enlarged AABBs, and some for longer than they overlap: it must have all of ours.
TEST_P(EachPairFinder, InsideDbvtBroadphase) {
  std::mt19937 random(12);
  const uint count = 600;
  AabbWorld w = randomAabbs(random, count);
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  std::vector<uint> indices(count);
  std::vector<btBroadphaseProxy*> proxies(count);
  for (uint i = 0; i < count; ++i) {
    indices[i] = i;
    proxies[i] = broadphase.createProxy(toBullet(w.aabbs[i].lower), toBullet(w.aabbs[i].upper), SPHERE_SHAPE_PROXYTYPE,
                                        &indices[i], w.info(i).filterGroup, w.info(i).filterMask, &dispatcher);
  }
  for (int step = 0; step < 8; ++step) {
    move(random, w, 0.3f);
    for (uint i = 0; i < count; ++i) {
      broadphase.setAabb(proxies[i], toBullet(w.aabbs[i].lower), toBullet(w.aabbs[i].upper), &dispatcher);
    }
    broadphase.calculateOverlappingPairs(&dispatcher);
    std::set<ulong> bullets;
    const btBroadphasePairArray& array = broadphase.getOverlappingPairCache()->getOverlappingPairArray();
    for (int k = 0; k < array.size(); ++k) {
      bullets.insert(pairKeyOf(*static_cast<uint*>(array[k].m_pProxy0->m_clientObject),
                               *static_cast<uint*>(array[k].m_pProxy1->m_clientObject)));
    }
    const FoundPairs found = find(w, 10000);
    EXPECT_GT(found.keys.size(), 400u);
    for (const ulong key : found.keys) {
      EXPECT_EQ(bullets.count(key), 1u) << "Bullet lacks " << (key >> 32) << ", " << static_cast<uint>(key);
    }
    for (const ulong key : bullets) {
      const auto low = static_cast<uint>(key >> 32), high = static_cast<uint>(key);
      if (!TestAabbAgainstAabb2(toBullet(w.aabbs[low].lower), toBullet(w.aabbs[low].upper),
                                toBullet(w.aabbs[high].lower), toBullet(w.aabbs[high].upper))) {
        continue;
      }
      EXPECT_TRUE(std::binary_search(found.keys.begin(), found.keys.end(), key)) << "we lack " << low << ", " << high;
    }
  }
  for (btBroadphaseProxy* proxy : proxies) broadphase.destroyProxy(proxy, &dispatcher);
}

}  // namespace
}  // namespace btgpu
