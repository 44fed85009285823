// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/30_find_pairs.h"

#include <btBulletCollisionCommon.h>

#include <algorithm>
#include <set>

#include "gpu_engine/stages/30_find_pairs_reference.h"
#include "tests/support/aabb_world.h"
#include "tests/support/bullet_convert.h"

namespace btgpu {
namespace {

float4 cube(float halfExtent) { return AabbWorld::cube(halfExtent); }

class FindPairsTest : public DeviceTest {
 protected:
  FoundPairs find(const AabbWorld& b, size_t capacity) {
    return findPairs(queue(), b, capacity, [this](Queue& q, DeviceWorld& w) { m_stage.enqueue(q, w); });
  }

  // Returns the number of pairs.
  size_t expectAsReference(const AabbWorld& b) {
    const auto expected = findPairsReference(b.world.finish().infos.values, b.aabbs);
    const FoundPairs found = find(b, expected.size() + 100);
    EXPECT_EQ(found.counters.overflow, 0u);
    EXPECT_EQ(found.counters.pairCount, expected.size());
    EXPECT_TRUE(found.keys == expected) << found.keys.size() << " pairs instead of " << expected.size();
    return expected.size();
  }

  // One stage for all worlds of a case: it must not remember anything of the world before.
  FindPairs m_stage{device()};
};

TEST_F(FindPairsTest, NoneOneTwo) {
  AabbWorld b;
  EXPECT_EQ(expectAsReference(b), 0u);
  b.add({}, cube(1));
  EXPECT_EQ(expectAsReference(b), 0u);
  b.add({1, 1, 1, 0}, cube(1));
  EXPECT_EQ(expectAsReference(b), 1u);
}

TEST_F(FindPairsTest, TouchingCountsAndOneUlpApartDoesNot) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const float gap : {0.0f, 1.0f}) {
      AabbWorld b;
      b.add({}, cube(1));
      b.add({}, cube(1));
      float* lower = &b.aabbs[1].lower.x + axis;
      float* upper = &b.aabbs[1].upper.x + axis;
      *lower = gap == 0 ? 1 : std::nextafter(1.0f, 2.0f);
      *upper = 3;
      EXPECT_EQ(expectAsReference(b), gap == 0 ? 1u : 0u);
    }
  }
}

TEST_F(FindPairsTest, CountsAroundTheTreesArity) {
  std::mt19937 random(1);
  for (const uint count : {3u, 7u, 8u, 9u, 31u, 33u, 63u}) EXPECT_GT(expectAsReference(randomAabbs(random, count)), 0u);
}

// Oclgrind takes some ten seconds for each world in the GPU shape (nine radix passes), so it gets this one alone.
TEST_F(FindPairsTest, AllKindsAtOnceSmall) {
  std::mt19937 random(14);
  AabbWorld b = randomAabbs(random, 40, 0);
  b.aabbs[0] = {{-1e18f, -1e18f, -1e18f, 0}, {1e18f, 1e18f, 1e18f, 0}};  // more pairs than one work item sorts
  b.add({}, cube(1e18f), 0);
  b.addFree();
  const uint quarantined = b.add({}, cube(1));
  b.world.info(quarantined).flags |= BODY_QUARANTINED;
  b.aabbs[quarantined] = AabbWorld::noAabb();
  b.world.info(b.add({}, cube(1))).flags = BODY_PRESENT | BODY_RIGID | BODY_KINEMATIC;
  b.world.info(b.add({}, cube(1))).filterMask = 2;
  EXPECT_GT(expectAsReference(b), 0u);
}

TEST_F(FindPairsTest, RandomOfAllCounts) {
  std::mt19937 random(2);
  for (const uint count : {1u, 2u, 7u, 8u, 9u, 64u, 65u, 127u, 128u, 129u, 511u, 512u, 513u, 1000u, 4097u, 100u}) {
    SCOPED_TRACE(count);
    expectAsReference(randomAabbs(random, count));
  }
}

// The order of the bodies is that of an earlier step, or of another world with as many.
TEST_F(FindPairsTest, AnyOrderOfTheBodies) {
  std::mt19937 random(15);
  for (int step = 0; step < 10; ++step) {
    SCOPED_TRACE(step);
    EXPECT_GT(expectAsReference(randomAabbs(random, 700)), 700u);
  }
}

// The lower body of very many pairs, which are sorted in several windows over all bodies.
TEST_F(FindPairsTest, OneMeetsAHundredThousand) {
  constexpr uint kCount = 140000, kWide = 3;
  AabbWorld b;
  for (uint i = 0; i < kCount; ++i) {
    b.add({4.0f * float(i % 400), 4.0f * float(i * 7 / 400 % 350), 0, 0}, cube(i == kWide ? 1e18f : 0.5f));
  }
  std::vector<ulong> expected;
  for (uint i = 0; i < kCount; ++i) {
    if (i != kWide) expected.push_back(pairKeyOf(i, kWide));
  }
  for (uint i = 0; i < kCount; ++i) {
    b.aabbs[i].lower.z += i == kWide ? 0 : 4.0f * float(i / 400);  // nobody else meets anybody
    b.aabbs[i].upper.z += i == kWide ? 0 : 4.0f * float(i / 400);
  }
  const FoundPairs found = find(b, expected.size());
  EXPECT_EQ(found.counters.pairCount, expected.size());
  EXPECT_TRUE(found.keys == expected);
}

TEST_F(FindPairsTest, TwentyThousand) {
  std::mt19937 random(3);
  EXPECT_GT(expectAsReference(randomAabbs(random, 20000)), 20000u);
}

TEST_F(FindPairsTest, HugeAndTinyMixed) {
  std::mt19937 random(4);
  for (const uint count : {50u, 600u}) {
    AabbWorld b;
    for (uint i = 0; i < count; ++i) {
      const float4 centre = uniform3(random, -100, 100);
      b.add(centre, cube(std::pow(10.0f, uniform(random, -4, 2))), random() % 5 == 0 ? 0 : 1);
    }
    EXPECT_GT(expectAsReference(b), 0u);
  }
}

TEST_F(FindPairsTest, AllInOneCell) {
  std::mt19937 random(5);
  AabbWorld b;
  for (int i = 0; i < 150; ++i) b.add(uniform3(random, -1e-6f, 1e-6f), cube(uniform(random, 0, 1e-6f)));
  b.add({1e4f, 1e4f, 1e4f, 0}, cube(1));  // makes the cell of all others tiny
  b.add({-1e4f, -1e4f, -1e4f, 0}, cube(1));
  EXPECT_GT(expectAsReference(b), 0u);
}

TEST_F(FindPairsTest, AllOnOneLine) {
  for (int axis = 0; axis < 3; ++axis) {
    AabbWorld b;
    for (int i = 0; i < 200; ++i) {
      float4 centre{};
      (&centre.x)[axis] = static_cast<float>(i * 7 % 200);
      b.add(centre, cube(1.25f));
    }
    EXPECT_EQ(expectAsReference(b), 199u + 198u);  // each with its next two
  }
}

TEST_F(FindPairsTest, FewIdentical) {
  for (const uint count : {8u, 40u}) {
    AabbWorld b;
    for (uint i = 0; i < count; ++i) b.add({3, 4, 5, 0}, cube(1));
    EXPECT_EQ(expectAsReference(b), count * (count - 1) / 2);
  }
}

TEST_F(FindPairsTest, AllIdentical) {
  AabbWorld b;
  for (int i = 0; i < 300; ++i) b.add({}, {});
  EXPECT_EQ(expectAsReference(b), 300u * 299u / 2);
}

TEST_F(FindPairsTest, PlanesMeetEverythingThatMoves) {
  std::mt19937 random(6);
  AabbWorld b = randomAabbs(random, 20, 0);
  const uint plane = b.add({}, cube(1e18f), 0), other = b.add({}, cube(1e18f), 0);
  b.add({500, 0, 0, 0}, cube(1), 0);  // static: the filters keep it from the planes
  expectAsReference(b);
  // With filters that let all through, planes meet each other and all that is static.
  for (const uint i : {plane, other, other + 1}) b.world.info(i).filterMask = -1;
  expectAsReference(b);
}

TEST_F(FindPairsTest, OnlyPlanes) {
  AabbWorld b;
  for (int i = 0; i < 3; ++i) b.world.info(b.add({}, cube(1e18f), 0)).filterMask = -1;
  EXPECT_EQ(expectAsReference(b), 3u);
}

TEST_F(FindPairsTest, StaticsAgainstDynamics) {
  std::mt19937 random(7);
  for (const float share : {0.0f, 0.5f, 0.97f, 1.0f}) {
    const size_t pairs = expectAsReference(randomAabbs(random, 60, share));
    EXPECT_EQ(pairs == 0, share == 1.0f);
  }
  AabbWorld b = randomAabbs(random, 60, 1);
  for (uint i = 0; i < 60; ++i) b.world.info(i).filterMask = -1;
  EXPECT_GT(expectAsReference(b), 0u);  // two static bodies meet where their filters say so
}

TEST_F(FindPairsTest, KinematicBodies) {
  std::mt19937 random(8);
  AabbWorld b = randomAabbs(random, 50, 0);
  for (uint i = 0; i < 50; i += 3) b.world.info(i).flags = BODY_PRESENT | BODY_RIGID | BODY_KINEMATIC;
  EXPECT_GT(expectAsReference(b), 0u);
}

TEST_F(FindPairsTest, FiltersNeedBothSides) {
  struct Filter {
    int group, mask;
  };
  const Filter filters[] = {{1, 2}, {2, 1}, {1, 0}, {2, 0}, {4, 2}, {1 << 31, -1}, {-1, 1 << 31}, {0, -1}};
  AabbWorld b;
  for (const Filter f : filters) {
    BodyInfo& info = b.world.info(b.add({}, cube(1)));
    info.filterGroup = f.group;
    info.filterMask = f.mask;
  }
  EXPECT_EQ(expectAsReference(b), 2u);  // 0 with 1, 5 with 6
}

TEST_F(FindPairsTest, RandomFilters) {
  std::mt19937 random(9);
  AabbWorld b = randomAabbs(random, 700);
  for (uint i = 0; i < 700; ++i) {
    b.world.info(i).filterGroup = 1 << random() % 3;
    b.world.info(i).filterMask = static_cast<int>(random() % 8);
  }
  EXPECT_GT(expectAsReference(b), 0u);
}

// Compounds as a whole, their shapes, and bodies that are neither, each moving, kinematic or static.
TEST_F(FindPairsTest, CompoundsAmongOthers) {
  std::mt19937 random(15);
  AabbWorld b;
  for (uint i = 0; i < 700; ++i) {
    BodyInfo& info = b.world.info(b.add(uniform3(random, -4, 4), cube(0.6f)));
    const uint part = random() % 3, motion = random() % 4;
    if (part > 0) info.flags |= part == 1 ? BODY_COMPOUND : BODY_CHILD;
    if (part == 2) info.parent = random() % 40;
    if (motion > 1) info.flags |= motion == 2 ? BODY_KINEMATIC : BODY_STATIC;
  }
  EXPECT_GT(expectAsReference(b), 700u);
}

TEST_F(FindPairsTest, WhatTakesNoPartIsNeverPaired) {
  std::mt19937 random(10);
  AabbWorld b;
  for (int i = 0; i < 60; ++i) {
    if (random() % 3 == 0) b.addFree();
    const uint body = b.add(uniform3(random, -2, 2), cube(0.7f));
    const uint reason = random() % 12;
    if (reason == 0) b.world.info(body).flags |= BODY_QUARANTINED;
    if (reason == 1) b.world.info(body).flags &= ~BODY_PRESENT;
    if (reason == 2) b.world.info(body).shapeIndex = -1;
    if (reason <= 2) b.aabbs[body] = AabbWorld::noAabb();  // stage 20 does so
  }
  b.world.info(b.add({}, cube(1e18f), 0)).filterMask = -1;  // a plane, which meets all there is
  EXPECT_GT(expectAsReference(b), 0u);
  for (uint i = 0; i < b.world.bodyCount(); ++i) {
    b.world.info(i).flags = 0;
    b.aabbs[i] = AabbWorld::noAabb();
  }
  EXPECT_EQ(expectAsReference(b), 0u);
}

TEST_F(FindPairsTest, CapacityReachedAndExceeded) {
  std::mt19937 random(11);
  for (const uint count : {20u, 1500u}) {
    const AabbWorld b = randomAabbs(random, count);
    const auto expected = findPairsReference(b.world.finish().infos.values, b.aabbs);
    const FoundPairs exact = find(b, expected.size());
    EXPECT_EQ(exact.counters.overflow, 0u);
    EXPECT_TRUE(exact.keys == expected);

    for (const size_t missing : {size_t{1}, expected.size() / 2, expected.size() - 1}) {
      const FoundPairs tooMany = find(b, expected.size() - missing);
      EXPECT_EQ(tooMany.counters.overflow, OVERFLOW_PAIRS);
      EXPECT_EQ(tooMany.counters.pairCount, expected.size());
      for (const ulong key : tooMany.keys) ASSERT_TRUE(StageBench::isPoison(key));
    }
  }
}

TEST_F(FindPairsTest, CapacityExceededSmall) {
  AabbWorld b;
  for (int i = 0; i < 5; ++i) b.add({}, cube(1));
  const FoundPairs tooMany = find(b, 9);
  EXPECT_EQ(tooMany.counters.overflow, OVERFLOW_PAIRS);
  EXPECT_EQ(tooMany.counters.pairCount, 10u);
}

// Bullet's dynamic tree keeps pairs of enlarged AABBs: it must have all of ours, and we all of its pairs
// whose own AABBs overlap.
TEST_F(FindPairsTest, AgreesWithDbvtBroadphase) {
  std::mt19937 random(12);
  const uint count = 800;
  AabbWorld b = randomAabbs(random, count);
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  std::vector<uint> indices(count);
  std::vector<btBroadphaseProxy*> proxies(count);
  for (uint i = 0; i < count; ++i) {
    indices[i] = i;
    proxies[i] =
        broadphase.createProxy(toBullet(b.aabbs[i].lower), toBullet(b.aabbs[i].upper), SPHERE_SHAPE_PROXYTYPE,
                               &indices[i], b.world.info(i).filterGroup, b.world.info(i).filterMask, &dispatcher);
  }
  for (int step = 0; step < 5; ++step) {
    for (uint i = 0; i < count; ++i) {
      const float4 by = uniform3(random, -0.3f, 0.3f);
      b.aabbs[i] = {b.aabbs[i].lower + by, b.aabbs[i].upper + by};
      broadphase.setAabb(proxies[i], toBullet(b.aabbs[i].lower), toBullet(b.aabbs[i].upper), &dispatcher);
    }
    broadphase.calculateOverlappingPairs(&dispatcher);
    std::set<ulong> bullets;
    const btBroadphasePairArray& array = broadphase.getOverlappingPairCache()->getOverlappingPairArray();
    for (int k = 0; k < array.size(); ++k) {
      bullets.insert(pairKeyOf(*static_cast<uint*>(array[k].m_pProxy0->m_clientObject),
                               *static_cast<uint*>(array[k].m_pProxy1->m_clientObject)));
    }
    const FoundPairs found = find(b, 10000);
    EXPECT_GT(found.keys.size(), 500u);
    for (const ulong key : found.keys)
      EXPECT_EQ(bullets.count(key), 1u) << "Bullet lacks " << (key >> 32) << ", " << (uint)key;
    for (const ulong key : bullets) {
      const auto low = static_cast<uint>(key >> 32), high = static_cast<uint>(key);
      if (!TestAabbAgainstAabb2(toBullet(b.aabbs[low].lower), toBullet(b.aabbs[low].upper),
                                toBullet(b.aabbs[high].lower), toBullet(b.aabbs[high].upper))) {
        continue;
      }
      EXPECT_TRUE(std::binary_search(found.keys.begin(), found.keys.end(), key)) << "we lack " << low << ", " << high;
    }
  }
  for (btBroadphaseProxy* proxy : proxies) broadphase.destroyProxy(proxy, &dispatcher);
}

}  // namespace
}  // namespace btgpu
