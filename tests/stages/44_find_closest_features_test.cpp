// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/44_find_closest_features.h"

#include "gpu_engine/stages/44_find_closest_features_reference.h"
#include "tests/support/convex_pairs.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"

namespace btgpu {
namespace {

class FindClosestFeaturesTest : public DeviceTest {
 protected:
  struct Result {
    std::vector<ClosestFeatures> closest;
    std::vector<uint> near;
    std::vector<RawContacts> contacts;
  };
  Result device(const PairWorld& p, uint overflow = 0) {
    StageBench bench = benchForPairs(queue(), p, m_spare);
    bench.poison(bench.world().contacts);
    bench.setOverflow(overflow);
    bench.run<FindClosestFeatures>();
    Result r;
    r.closest = bench.read(bench.world().closest);
    if (!overflow) r.near = bench.read(bench.world().nearPairs, bench.read(bench.world().nearCount, 1)[0]);
    r.contacts = bench.read(bench.world().contacts);
    return r;
  }

  // Every pair against the reference. Returns how many were near.
  size_t expectAsReference(const PairWorld& p) {
    const Result r = device(p);
    const PairArrays in = arraysOf(p);
    ClosestPairs found{r.closest, r.near};
    found.closest.resize(in.bucketFirst[BUCKET_LAST_CONVEX + 1] - in.bucketFirst[BUCKET_FIRST_CONVEX]);
    RawContacts poison;
    std::memset(static_cast<void*>(&poison), StageBench::kPoison, sizeof poison);
    Contract contract("44_find_closest_features");
    checkClosestFeatures(contract, in, found, std::vector<RawContacts>(p.pairs.size(), poison), r.contacts);
    EXPECT_TRUE(contract.ok()) << contract.text();
    for (size_t i = p.pairs.size(); i < r.contacts.size(); ++i) {
      EXPECT_TRUE(StageBench::isPoison(r.contacts[i])) << i;
    }
    return r.near.size();
  }

  size_t m_spare = 0;
};

// Not under Oclgrind: where work-groups call different functions, as here, its instruction counter
// (InstructionCounter::workGroupComplete, 21.10) reads behind its own array. AnyStartSmall runs the same kernels.
TEST_F(FindClosestFeaturesTest, EveryKind) {
  std::mt19937 random(1);
  expectAsReference(randomConvexPairs(random, 24));
}

TEST_F(FindClosestFeaturesTest, RandomOfAllCounts) {
  std::mt19937 random(2);
  for (const size_t count : {0u, 1u, 33u, 127u, 128u, 129u, 700u}) {
    SCOPED_TRACE(count);
    m_spare = count % 2;
    const PairWorld p = randomConvexPairs(random, count);
    const size_t near = expectAsReference(p);
    if (count >= 700) {
      EXPECT_GT(near, count / 4);
      EXPECT_LT(near, count);
    }
  }
}

TEST_F(FindClosestFeaturesTest, CurvedSmall) {
  std::mt19937 random(5);
  expectAsReference(randomCurvedPairs(random, 10));
}

TEST_F(FindClosestFeaturesTest, Curved) {
  std::mt19937 random(6);
  PairWorld p = randomCurvedPairs(random, 300);
  const size_t near = expectAsReference(p);
  EXPECT_GT(near, 100u);
  EXPECT_LT(near, 300u);
}

// Curved pairs and others in one world: each kernel leaves the others' alone.
TEST_F(FindClosestFeaturesTest, CurvedAmongOthers) {
  std::mt19937 random(7);
  PairWorld p = randomCurvedPairs(random, 40);
  const PairWorld others = randomConvexPairs(random, 40);
  for (size_t i = 0; i < others.pairs.size(); ++i) {
    const int box = p.world.box({0.5f, 0.5f, 0.5f, 0}), capsule = p.world.capsule(1, 0.2f, 0.5f);
    p.add(box, others.world.pose(others.pairs[i].bodyA), capsule, others.world.pose(others.pairs[i].bodyB));
  }
  expectAsReference(p);
}

// Started from last step's normal, and from a wrong one: the same features.
TEST_F(FindClosestFeaturesTest, AnyStartSmall) {
  std::mt19937 random(3);
  PairWorld p = randomConvexPairs(random, 12);
  for (Pair& pair : p.pairs) {
    Manifold m{};
    m.breakingThreshold = 0.02f;
    m.pointCount = 1;
    const float4 n = uniform3(random, -1, 1);
    m.points[0].normalWorldOnB = n / sizeOf(n);
    pair.oldManifold = static_cast<uint>(p.oldManifolds.size());
    p.oldManifolds.push_back(m);
  }
  expectAsReference(p);
}

// Crates and prisms almost flat on each other, a millimetre in ten thousand: the search for the nearest point stands
// still here before its axis is found, in four of 20,000.
TEST_F(FindClosestFeaturesTest, AlmostFlat) {
  PairWorld p;
  std::vector<float4> corners;
  for (int i = 0; i < 8; ++i) corners.push_back({i & 1 ? 0.4f : -0.4f, i & 2 ? 0.4f : -0.4f, i & 4 ? 0.4f : -0.4f, 0});
  const int shapes[] = {p.world.hull(corners), p.world.hull(prismPoints(16, 0.5f, 0.4f))};
  std::mt19937 random(7);
  const auto almostUpright = [&random] {
    const float4 axis = uniform3(random, -1, 1);
    return turnAbout(axis, uniform(random, -2e-4f, 2e-4f));
  };
  for (int k = 0; k < 20000; ++k) {
    const int a = shapes[random() % 2], b = shapes[random() % 2];
    for (int i = 0; i < 2; ++i) randomTurn(random);
    uniform3(random, -1.2f, 1.2f);
    const float4 turnA = almostUpright(), turnB = almostUpright();
    const float x = uniform(random, -0.6f, 0.6f), z = uniform(random, -0.6f, 0.6f);
    const bool stands = k == 4827 || k == 9006 || k == 9604 || k == 19695;
    if (stands || k % 200 == 0) p.add(a, {{0, 0, 0, 0}, turnA}, b, {{x, 0.88f, z, 0}, turnB});
  }
  EXPECT_EQ(expectAsReference(p), 104u);
}

TEST_F(FindClosestFeaturesTest, NothingAfterAnOverflowSmall) {
  std::mt19937 random(4);
  for (const RawContacts& raw : device(randomConvexPairs(random, 8), OVERFLOW_PAIRS).contacts) {
    EXPECT_TRUE(StageBench::isPoison(raw));
  }
}

}  // namespace
}  // namespace btgpu
