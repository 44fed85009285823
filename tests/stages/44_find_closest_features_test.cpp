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

TEST_F(FindClosestFeaturesTest, NothingAfterAnOverflowSmall) {
  std::mt19937 random(4);
  for (const RawContacts& raw : device(randomConvexPairs(random, 8), OVERFLOW_PAIRS).contacts) {
    EXPECT_TRUE(StageBench::isPoison(raw));
  }
}

}  // namespace
}  // namespace btgpu
