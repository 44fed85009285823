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
    const WorldInput in = p.world.finish();
    size_t near = 0;
    for (const size_t i : convexOrder(p)) {
      const size_t k = m_position++;
      SCOPED_TRACE(testing::Message() << "pair " << i << ", position " << k);
      EXPECT_EQ(r.contacts[i].count, 0);
      const PairReference e = referenceOf(p, in, i);
      const bool listed = near < r.near.size() && r.near[near] == k;
      near += listed;
      if (std::fabs(e.closest.separation - e.limit) > 2e-6 * e.size) {
        EXPECT_EQ(listed, e.closest.separation < e.limit) << e.closest.separation << " " << e.limit;
      }
      if (!listed) continue;
      // Header of the reference: 1e-5 of the size, and what float makes of it.
      EXPECT_LE(std::fabs(r.closest[k].normal.w - e.closest.separation), 1.2e-5 * e.size);
      const reference::Vec axis = e.rotationA * reference::toVec(r.closest[k].normal);
      EXPECT_NEAR(length(axis), 1, 1e-5);
      EXPECT_NEAR(separationAlong(e.a, e.b, axis), e.closest.separation, 6e-4 * e.size);
    }
    EXPECT_EQ(near, r.near.size());
    for (size_t i = 0; i < r.contacts.size(); ++i) {
      const bool convex =
          i < p.pairs.size() && p.pairs[i].bucket >= BUCKET_FIRST_CONVEX && p.pairs[i].bucket <= BUCKET_LAST_CONVEX;
      if (!convex) { EXPECT_TRUE(StageBench::isPoison(r.contacts[i])) << i; }
    }
    m_position = 0;
    return near;
  }

  size_t m_spare = 0, m_position = 0;
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
