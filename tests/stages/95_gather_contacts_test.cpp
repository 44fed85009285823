// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/95_gather_contacts.h"

#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

// The reference is the definition itself: the manifolds with points, in pair order.
class GatherContactsTest : public DeviceTest {
 protected:
  struct Case {
    std::vector<Manifold> manifolds;
    std::vector<ulong> keys;
  };

  static Case make(const std::vector<int>& pointCounts, const std::vector<uint>& buckets) {
    Case c;
    for (uint i = 0; i < pointCounts.size(); ++i) {
      Manifold m{};
      m.bodyA = i + 1;
      m.bodyB = i;
      m.pointCount = pointCounts[i];
      m.bucket = buckets[i % buckets.size()];
      for (int k = 0; k < m.pointCount; ++k)
        m.points[k].localPointB.w = static_cast<float>(10 * i + static_cast<uint>(k));
      c.manifolds.push_back(m);
      c.keys.push_back(pairKeyOf(m.bodyA, m.bodyB));
    }
    return c;
  }

  void expectGathered(const Case& c, bool all, size_t spare) {
    const size_t n = c.manifolds.size();
    Capacities room;
    room.pairs = n + spare;
    StageBench bench(queue(), WorldBuilder().finish(), {}, room);
    DeviceWorld& w = bench.world();
    StepCounters counters{};
    counters.pairCount = static_cast<uint>(n);
    bench.setCounters(counters);
    bench.write(w.pairCount, {counters.pairCount});
    bench.poison(w.manifolds);
    bench.poison(w.keys);
    bench.write(w.manifolds, c.manifolds);
    bench.write(w.keys, c.keys);
    GatherContacts stage(queue().device());
    bench.runStage(stage, all);

    StepResults results;
    results.counters = bench.counters();
    std::vector<ulong> keys;
    std::vector<Manifold> contacts;
    for (size_t i = 0; i < n; ++i) {
      if (c.manifolds[i].pointCount == 0) continue;
      const bool carried = !all && c.manifolds[i].bucket == BUCKET_CARRY && !c.manifolds[i].unseen;
      keys.push_back(c.keys[i] | (carried ? CONTACT_CARRIED : 0));
      if (!carried) contacts.push_back(c.manifolds[i]);
    }
    // First nothing is expected and all has to be fetched afterwards, then all is there at once.
    for (const int waits : {keys.empty() ? 0 : 1, 0}) {
      stage.enqueueReads(queue(), w, all);
      queue().finish();
      const int before = queue().waits();
      stage.finishReads(queue(), w, all, results);
      EXPECT_EQ(queue().waits() - before, waits);
      EXPECT_EQ(results.contactKeys, keys);
      ASSERT_EQ(results.contacts.size(), contacts.size());
      for (size_t i = 0; i < contacts.size(); ++i) EXPECT_TRUE(sameBits(results.contacts[i], contacts[i])) << i;
      stage.endReads(queue());
    }
  }
};

TEST_F(GatherContactsTest, NoPairsSmall) { expectGathered({}, false, 40); }

TEST_F(GatherContactsTest, NoneTouchSmall) { expectGathered(make({0, 0, 0}, {BUCKET_BOX_BOX}), false, 40); }

TEST_F(GatherContactsTest, CarriedOnesAreNamedOnlySmall) {
  const Case c = make({1, 0, 4, 2, 3}, {BUCKET_BOX_BOX, BUCKET_BOX_BOX, BUCKET_CARRY});
  expectGathered(c, false, 0);
  expectGathered(c, true, 40);
}

TEST_F(GatherContactsTest, CarriedOnesThatTheHostDidNotSeeSmall) {
  Case c = make({1, 0, 4, 2, 3}, {BUCKET_BOX_BOX, BUCKET_CARRY, BUCKET_CARRY});
  c.manifolds[0].unseen = c.manifolds[1].unseen = c.manifolds[4].unseen = 1;
  expectGathered(c, false, 0);
  expectGathered(c, true, 0);
}

TEST_F(GatherContactsTest, AllCarriedSmall) { expectGathered(make({1, 0, 4}, {BUCKET_CARRY}), false, 1); }

TEST_F(GatherContactsTest, NothingAfterAnOverflowSmall) {
  StageBench bench(queue(), WorldBuilder().finish());
  StepCounters counters{};
  counters.overflow = OVERFLOW_PAIRS;
  counters.pairCount = 1u << 20;
  bench.setCounters(counters);
  GatherContacts stage(queue().device());
  bench.runStage(stage, false);
  EXPECT_EQ(bench.counters().touchingCount, 0u);
  EXPECT_EQ(bench.counters().freshCount, 0u);
}

TEST_F(GatherContactsTest, AllCounts) {
  std::mt19937 random(3);
  for (const size_t count : {1u, 31u, 32u, 127u, 128u, 129u, 5000u, 40000u}) {
    std::vector<int> points;
    for (size_t i = 0; i < count; ++i) points.push_back(static_cast<int>(random() % (MANIFOLD_POINTS + 1)));
    SCOPED_TRACE(count);
    expectGathered(make(points, {BUCKET_CARRY, BUCKET_SPHERE_PLANE, BUCKET_BOX_BOX}), false, count % 2 ? 0 : 40);
  }
}

}  // namespace
}  // namespace btgpu
