// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/35_group_pairs.h"

#include <algorithm>

#include "gpu_engine/stages/35_group_pairs_reference.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

struct Stage35Input {
  WorldInput world;  // world.born says who is new; world.activations are those of stage 20
  std::vector<ulong> keys, oldKeys;
};

// Two bodies of each shape, all active, all known from the last step: spheres 0, 1; boxes 2, 3; planes 4, 5.
WorldBuilder twoOfEach() {
  WorldBuilder b;
  const int ball = b.sphere(1), brick = b.box({1, 1, 1, 0}), ground = b.plane({0, 1, 0, 0}, 0);
  for (const int shape : {ball, ball, brick, brick}) b.add(shape, {});
  for (int k = 0; k < 2; ++k) b.activation(b.add(ground, {}, 0)).state = STATE_ACTIVE;
  return b;
}

Stage35Input inputOf(const WorldBuilder& b) {
  Stage35Input in{b.finish(), {}, {}};
  in.world.born.clear();
  return in;
}

std::vector<ulong> allKeys(uint bodies) {
  std::vector<ulong> keys;
  for (uint a = 0; a < bodies; ++a) {
    for (uint b = a + 1; b < bodies; ++b) keys.push_back(pairKeyOf(a, b));
  }
  return keys;
}

class GroupPairsTest : public DeviceTest {
 protected:
  static GroupedPairs reference(const Stage35Input& in) {
    std::vector<uint> born(in.world.bodyCount);
    for (const uint i : in.world.born) born[i] = 1;
    return groupPairsReference(in.keys, in.oldKeys, in.world.infos.values, in.world.shapes.values,
                               in.world.activations.values, born, in.world.listedPairs, in.world.onlyListedPairs);
  }

  GroupedPairs device(const Stage35Input& in, uint overflow = 0, size_t spare = 40) {
    const size_t n = in.keys.size();
    Capacities room;
    room.pairs = n + spare;
    WorldInput before = in.world;  // what the step started from: stage 35 has to take what stage 20 made of it
    for (BodyActivation& a : before.activations.values) a.state = STATE_SLEEPING;
    StageBench bench(queue(), before, {}, room);
    DeviceWorld& w = bench.world();
    StepCounters counters{};
    counters.overflow = overflow;
    counters.pairCount = static_cast<uint>(n);
    bench.setCounters(counters);
    bench.write(w.pairCount, {counters.pairCount});
    bench.write(w.stepActivations, in.world.activations.values);
    bench.write(w.keys, in.keys);
    // Behind the old keys lie what older steps left: the same keys again.
    std::vector<ulong> oldKeys = in.oldKeys;
    oldKeys.insert(oldKeys.end(), in.keys.begin(), in.keys.end());
    bench.write(w.oldKeys, oldKeys);
    bench.write(w.oldPairCount, {static_cast<uint>(in.oldKeys.size())});
    bench.poison(w.pairs);
    bench.poison(w.items);
    bench.poison(w.bucketFirst);
    bench.run<GroupPairs>();

    GroupedPairs out{bench.read(w.pairs), bench.read(w.items, n), bench.read(w.bucketFirst)};
    for (size_t k = overflow ? 0 : n; k < out.pairs.size(); ++k) EXPECT_TRUE(StageBench::isPoison(out.pairs[k])) << k;
    out.pairs.resize(n);
    return out;
  }

  GroupedPairs expectAsReference(const Stage35Input& in, size_t spare = 40) {
    const GroupedPairs actual = device(in, 0, spare), expected = reference(in);
    for (size_t i = 0; i < in.keys.size(); ++i) {
      EXPECT_TRUE(sameBits(actual.pairs[i], expected.pairs[i])) << "pair " << i;
    }
    EXPECT_EQ(actual.items, expected.items);
    EXPECT_EQ(actual.bucketFirst, expected.bucketFirst);
    return actual;
  }
};

TEST_F(GroupPairsTest, NoPairsSmall) {
  const auto out = expectAsReference(inputOf(twoOfEach()));
  EXPECT_EQ(out.bucketFirst, std::vector<uint>(BUCKET_COUNT + 1, 0));
}

TEST_F(GroupPairsTest, EveryKindOfPairHasItsBucketSmall) {
  Stage35Input in = inputOf(twoOfEach());
  in.keys = allKeys(6);
  const auto out = expectAsReference(in);
  const auto bucketOf = [&](uint a, uint b) {
    const auto at = std::find(in.keys.begin(), in.keys.end(), pairKeyOf(a, b)) - in.keys.begin();
    return out.pairs[static_cast<size_t>(at)].bucket;
  };
  EXPECT_EQ(bucketOf(0, 1), BUCKET_SPHERE_SPHERE);
  EXPECT_EQ(bucketOf(0, 2), BUCKET_SPHERE_BOX);
  EXPECT_EQ(bucketOf(0, 4), BUCKET_SPHERE_PLANE);
  EXPECT_EQ(bucketOf(2, 3), BUCKET_BOX_BOX);
  EXPECT_EQ(bucketOf(2, 4), BUCKET_BOX_PLANE);
  EXPECT_EQ(bucketOf(4, 5), BUCKET_NONE);
  EXPECT_EQ(out.bucketFirst.front(), 0u);
  EXPECT_EQ(out.bucketFirst.back(), in.keys.size());
}

TEST_F(GroupPairsTest, CapsulesAndHullsSmall) {
  WorldBuilder b = twoOfEach();
  const int capsule = b.capsule(1, 0.5f, 1), hull = b.hull({{0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}});
  for (const int shape : {capsule, capsule, hull, hull}) b.add(shape, {});
  for (const int shape : {b.cylinder(1, 1, 1), b.cone(1, 1, 1), b.spheres({{0, 0, 0, 1}}, 1)}) b.add(shape, {});
  Stage35Input in = inputOf(b);
  in.keys = allKeys(13);
  const auto out = expectAsReference(in);
  const auto bucketOf = [&](uint a, uint c) {
    const auto at = std::find(in.keys.begin(), in.keys.end(), pairKeyOf(a, c)) - in.keys.begin();
    return out.pairs[static_cast<size_t>(at)].bucket;
  };
  const struct {
    uint a, b, bucket;
  } expected[] = {{0, 6, BUCKET_CAPSULES},      {2, 6, BUCKET_CAPSULE_BOX},  {4, 6, BUCKET_CAPSULE_PLANE},
                  {6, 7, BUCKET_CAPSULES},      {6, 8, BUCKET_CAPSULE_HULL}, {0, 8, BUCKET_SPHERE_HULL},
                  {2, 8, BUCKET_BOX_HULL},      {4, 8, BUCKET_HULL_PLANE},   {8, 9, BUCKET_HULL_HULL},
                  {0, 10, BUCKET_CURVED},       {2, 11, BUCKET_CURVED},      {6, 12, BUCKET_CURVED},
                  {8, 10, BUCKET_CURVED},       {10, 11, BUCKET_CURVED},     {4, 10, BUCKET_CURVED_PLANE},
                  {4, 11, BUCKET_CURVED_PLANE}, {4, 12, BUCKET_CURVED_PLANE}};
  for (const auto& e : expected) EXPECT_EQ(bucketOf(e.a, e.b), e.bucket) << e.a << ", " << e.b;
}

TEST_F(GroupPairsTest, LowerProxyIdIsAButAPlaneIsBSmall) {
  // Each two bodies with ids in either order.
  for (const bool ascending : {true, false}) {
    WorldBuilder b = twoOfEach();
    for (uint i = 0; i < b.bodyCount(); ++i) b.info(i).uniqueId = static_cast<int>(ascending ? 5 + i : 50 - i);
    Stage35Input in = inputOf(b);
    in.keys = allKeys(6);
    for (const Pair& p : expectAsReference(in).pairs) {
      const bool planeA = p.bodyA >= 4, planeB = p.bodyB >= 4;
      EXPECT_TRUE(!planeA || planeB);
      EXPECT_TRUE(planeA != planeB || (p.bodyA < p.bodyB) == ascending) << p.bodyA << ", " << p.bodyB;
    }
  }
}

// No algorithm for them; contacts of the last step stay, as Bullet's near callback leaves them.
TEST_F(GroupPairsTest, IgnoredPairsSmall) {
  Stage35Input in = inputOf(twoOfEach());
  in.keys = allKeys(6);
  in.oldKeys = {pairKeyOf(0, 1), pairKeyOf(0, 2), pairKeyOf(1, 2)};
  in.world.listedPairs = {pairKeyOf(0, 1), pairKeyOf(1, 2), pairKeyOf(1, 4), pairKeyOf(2, 3)};
  in.world.born = {2};
  const auto out = expectAsReference(in);
  for (size_t i = 0; i < in.keys.size(); ++i) {
    const auto& ignored = in.world.listedPairs;
    if (std::find(ignored.begin(), ignored.end(), in.keys[i]) == ignored.end()) continue;
    EXPECT_EQ(out.pairs[i].bucket, in.keys[i] == pairKeyOf(0, 1) ? BUCKET_CARRY : BUCKET_NONE) << i;
  }
}

// The other way round, where the application filters pairs: also if it lets none through.
TEST_F(GroupPairsTest, OnlyListedPairsSmall) {
  Stage35Input in = inputOf(twoOfEach());
  in.keys = allKeys(6);
  in.oldKeys = {pairKeyOf(0, 1), pairKeyOf(0, 2), pairKeyOf(1, 2)};
  in.world.onlyListedPairs = true;
  for (const std::vector<ulong>& listed :
       {std::vector<ulong>{pairKeyOf(0, 1), pairKeyOf(1, 4), pairKeyOf(2, 3), pairKeyOf(0, 2) | PAIR_KEEPS_CONTACTS,
                           pairKeyOf(0, 4) | PAIR_KEEPS_CONTACTS},
        std::vector<ulong>{}}) {
    in.world.listedPairs = listed;
    const auto out = expectAsReference(in);
    for (size_t i = 0; i < in.keys.size(); ++i) {
      if (std::binary_search(listed.begin(), listed.end(), in.keys[i])) continue;
      // Of those that Bullet has no pair of the contacts go.
      const bool keeps = !listed.empty() && in.keys[i] == pairKeyOf(0, 2);
      EXPECT_EQ(out.pairs[i].bucket, keeps ? BUCKET_CARRY : BUCKET_NONE) << i;
      EXPECT_EQ(out.pairs[i].oldManifold, keeps ? 1 : NO_INDEX) << i;
    }
  }
}

TEST_F(GroupPairsTest, OldManifoldsAreFoundByKeySmall) {
  Stage35Input in = inputOf(twoOfEach());
  in.keys = {pairKeyOf(0, 1), pairKeyOf(0, 3), pairKeyOf(1, 2), pairKeyOf(2, 4), pairKeyOf(3, 5)};
  in.oldKeys = {pairKeyOf(0, 1), pairKeyOf(0, 2), pairKeyOf(1, 2), pairKeyOf(3, 5)};
  const auto out = expectAsReference(in);
  const uint expected[] = {0, NO_INDEX, 2, NO_INDEX, 3};
  for (size_t i = 0; i < 5; ++i) EXPECT_EQ(out.pairs[i].oldManifold, expected[i]) << i;
}

TEST_F(GroupPairsTest, BornBodiesLoseTheirManifoldsSmall) {
  Stage35Input in = inputOf(twoOfEach());
  in.keys = in.oldKeys = allKeys(6);
  in.world.born = {1, 4};
  for (const Pair& p : expectAsReference(in).pairs) {
    const bool born = p.bodyA == 1 || p.bodyB == 1 || p.bodyA == 4 || p.bodyB == 4;
    EXPECT_EQ(p.oldManifold == NO_INDEX, born) << p.bodyA << ", " << p.bodyB;
  }
}

TEST_F(GroupPairsTest, PairsOfInactiveBodiesAreCarriedSmall) {
  WorldBuilder b = twoOfEach();
  const int inactive[] = {STATE_SLEEPING, STATE_DISABLE_SIMULATION, STATE_FIXED_BASE};
  for (uint k = 0; k < 3; ++k) b.activation(2 * k).state = inactive[k];
  b.activation(1).state = STATE_WANTS_DEACTIVATION;
  b.activation(3).state = STATE_DISABLE_DEACTIVATION;
  Stage35Input in = inputOf(b);
  in.keys = allKeys(6);
  in.oldKeys = {pairKeyOf(0, 2)};
  for (const Pair& p : expectAsReference(in).pairs) {
    EXPECT_EQ(p.bucket == BUCKET_CARRY, p.bodyA % 2 == 0 && p.bodyB % 2 == 0) << p.bodyA << ", " << p.bodyB;
    EXPECT_EQ(p.oldManifold, pairKeyOf(p.bodyA, p.bodyB) == pairKeyOf(0, 2) ? 0 : NO_INDEX);
  }
}

// By its shape or by a flag a body makes all its pairs the host's, asleep or not; what the device knew of them is gone.
TEST_F(GroupPairsTest, PairsOfTheHostSmall) {
  WorldBuilder b = twoOfEach();
  b.shape(b.info(2).shapeIndex).type = SHAPE_HOST;  // both boxes
  b.info(0).flags |= BODY_HOST_CONTACTS;
  b.activation(2).state = b.activation(3).state = STATE_SLEEPING;
  Stage35Input in = inputOf(b);
  in.keys = in.oldKeys = allKeys(6);
  for (const Pair& p : expectAsReference(in).pairs) {
    const auto onHost = [](uint body) { return body == 0 || body == 2 || body == 3; };
    EXPECT_EQ(p.bucket == BUCKET_HOST, onHost(p.bodyA) || onHost(p.bodyB)) << p.bodyA << ", " << p.bodyB;
    EXPECT_EQ(p.oldManifold == NO_INDEX, p.bucket == BUCKET_HOST);
  }
}

TEST_F(GroupPairsTest, NothingAfterAnOverflowSmall) {
  Stage35Input in = inputOf(twoOfEach());
  in.keys = allKeys(6);
  device(in, OVERFLOW_PAIRS);  // checks that no pair was written
}

TEST_F(GroupPairsTest, RandomOfAllCounts) {
  std::mt19937 random(1);
  for (const size_t count : {1u, 31u, 32u, 127u, 128u, 129u, 1000u, 4097u, 40000u}) {
    WorldBuilder b;
    RandomWorld what;
    what.bodies = count > 5000 ? 300 : 120;  // more pairs than the GPU shape has lanes
    what.planes = 4;
    what.freeShare = 0;
    b.addRandom(random, what);
    std::vector<int> ids;
    for (uint i = 0; i < b.bodyCount(); ++i) {
      ids.push_back(static_cast<int>(3 * i));
      b.activation(i).state = static_cast<int>(random() % 7);
    }
    std::shuffle(ids.begin(), ids.end(), random);
    for (uint i = 0; i < b.bodyCount(); ++i) b.info(i).uniqueId = ids[i];
    Stage35Input in = inputOf(b);
    const auto some = [&](size_t wanted) {
      std::vector<ulong> keys = allKeys(b.bodyCount());
      std::shuffle(keys.begin(), keys.end(), random);
      keys.resize(wanted);
      std::sort(keys.begin(), keys.end());
      return keys;
    };
    in.keys = some(count);
    in.oldKeys = some(4000);
    for (uint i = 0; i < b.bodyCount(); ++i) {
      if (random() % 10 == 0) in.world.born.push_back(i);
    }
    SCOPED_TRACE(count);
    expectAsReference(in, count % 2 ? 0 : 40);  // with the room just filled, and with more
  }
}

}  // namespace
}  // namespace btgpu
