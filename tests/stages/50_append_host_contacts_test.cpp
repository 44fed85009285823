// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/50_append_host_contacts.h"

#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

Manifold numbered(uint n) {
  Manifold m{};
  m.bodyA = n;
  m.bodyB = n + 1;
  m.pointCount = static_cast<int>(n % 5);
  m.points[0].localPointA.x = static_cast<float>(n);
  return m;
}

// The reference is the definition: manifolds of the pairs, then those of the host.
class AppendHostContactsTest : public DeviceTest {
 protected:
  // Returns the counters; checks the manifolds unless an overflow is expected.
  StepCounters run(uint pairs, uint hosts, size_t capacity, uint overflowBefore = 0) {
    WorldInput input = WorldBuilder().finish();
    for (uint i = 0; i < hosts; ++i) input.hostManifolds.push_back(numbered(1000 + i));
    Capacities room;
    room.pairs = capacity;
    StageBench bench(queue(), input, {}, room);
    DeviceWorld& w = bench.world();
    StepParams params = bench.params();
    params.hostManifoldCount = hosts;
    bench.setParams(params);
    StepCounters counters{};
    counters.pairCount = pairs;
    counters.overflow = overflowBefore;
    bench.setCounters(counters);
    bench.poison(w.manifolds);
    std::vector<Manifold> expected;
    for (uint i = 0; i < pairs && i < capacity; ++i) expected.push_back(numbered(i));
    bench.write(w.manifolds, expected);
    bench.run<AppendHostContacts>();
    counters = bench.counters();
    const auto actual = bench.read(w.manifolds);
    if (!counters.overflow) {
      for (uint i = 0; i < hosts; ++i) expected.push_back(numbered(1000 + i));
      EXPECT_EQ(bench.read(w.manifoldCount, 1).front(), pairs + hosts);
    }
    for (size_t i = 0; i < actual.size(); ++i) {
      const bool good = i < expected.size() ? sameBits(actual[i], expected[i]) : StageBench::isPoison(actual[i]);
      EXPECT_TRUE(good) << i;
    }
    return counters;
  }
};

TEST_F(AppendHostContactsTest, BehindThePairsSmall) { EXPECT_EQ(run(3, 2, 64).overflow, 0u); }
TEST_F(AppendHostContactsTest, NoPairsSmall) { EXPECT_EQ(run(0, 5, 64).overflow, 0u); }
TEST_F(AppendHostContactsTest, CapacityExactlyReachedSmall) { EXPECT_EQ(run(60, 4, 64).overflow, 0u); }
TEST_F(AppendHostContactsTest, OneOverSmall) { EXPECT_EQ(run(60, 5, 64).overflow, OVERFLOW_PAIRS); }
TEST_F(AppendHostContactsTest, NothingAfterAnOverflowSmall) {
  EXPECT_EQ(run(900, 5, 64, OVERFLOW_PAIRS).overflow, OVERFLOW_PAIRS);
}
TEST_F(AppendHostContactsTest, Many) {
  for (const uint hosts : {1u, 31u, 32u, 127u, 128u, 129u, 20000u}) EXPECT_EQ(run(100, hosts, 20100).overflow, 0u);
}

}  // namespace
}  // namespace btgpu
