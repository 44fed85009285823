// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/48_reduce_and_match_contacts.h"

#include <btBulletCollisionCommon.h>

#include <algorithm>
#include <memory>

#include "gpu_engine/stages/42_collide_primitives.h"
#include "gpu_engine/stages/48_reduce_and_match_contacts_reference.h"
#include "tests/support/device_test.h"
#include "tests/support/pair_world.h"
#include "tests/support/stage_bench.h"

namespace btgpu {
namespace {

// A point is a sum of some 30 rounded products, none longer than the pair's size.
constexpr float kTolerance = 2e-6f;

struct Stage48Input {
  PairWorld world;
  std::vector<RawContacts> contacts;  // one a pair
};

RawContacts candidates(float4 normal, std::vector<float4> points) {
  RawContacts raw{};
  raw.normal = normal;
  raw.count = static_cast<int>(points.size());
  std::copy(points.begin(), points.end(), raw.points);
  return raw;
}

// A box on a box, both without rotation, B half a unit below A; points are given on B, from A's centre.
Stage48Input boxOnBox() {
  Stage48Input in;
  const int upper = in.world.world.box({1, 0.25f, 1, 0}), lower = in.world.world.box({1, 0.25f, 1, 0});
  in.world.add(upper, at(0, 0, 0), lower, at(0, -0.5f, 0));
  in.contacts.push_back(candidates({0, 1, 0, 0}, {}));
  return in;
}
const float4 kUp = {0, 1, 0, 0};
float4 below(float x, float z, float distance) { return {x, -0.25f - distance, z, distance}; }

class MatchContactsTest : public DeviceTest {
 protected:
  std::vector<Manifold> device(const Stage48Input& in, uint overflow = 0, size_t spare = 5) {
    const size_t n = in.world.pairs.size();
    Capacities room;
    room.pairs = n + spare;
    StageBench bench(queue(), in.world.world.finish(), {}, room);
    DeviceWorld& w = bench.world();
    bench.setPairs(in.world.pairs);
    bench.setOldManifolds(in.world.oldManifolds);
    bench.write(w.contacts, in.contacts);
    bench.poison(w.manifolds);
    StepCounters counters = bench.counters();
    counters.overflow = overflow;
    bench.setCounters(counters);
    bench.run<ReduceAndMatchContacts>();
    auto manifolds = bench.read(w.manifolds);
    for (size_t i = overflow ? 0 : n; i < manifolds.size(); ++i)
      EXPECT_TRUE(StageBench::isPoison(manifolds[i])) << i;
    // A step may be repeated, so the last one's manifolds must be untouched.
    const auto old = bench.read(w.oldManifolds, in.world.oldManifolds.size());
    EXPECT_TRUE(old.empty() ||
                std::memcmp(old.data(), in.world.oldManifolds.data(), old.size() * sizeof(Manifold)) == 0);
    manifolds.resize(n);
    return manifolds;
  }

  static std::vector<Manifold> reference(const Stage48Input& in) {
    const WorldInput w = in.world.world.finish();
    return matchContactsReference(in.world.pairs, in.contacts, in.world.oldManifolds, w.infos.values,
                                  w.shapes.values, w.poses.values, w.materials.values);
  }

  std::vector<Manifold> expectAsReference(const Stage48Input& in, size_t spare = 5) {
    const auto actual = device(in, 0, spare), expected = reference(in);
    for (size_t i = 0; i < actual.size(); ++i) {
      SCOPED_TRACE(i);
      expectSame(actual[i], expected[i], sizeOf(in.world.bFromA(in.world.pairs[i])));
    }
    return actual;
  }

  static void expectSame(const Manifold& a, const Manifold& e, float apart) {
    EXPECT_EQ(a.bodyA, e.bodyA);
    EXPECT_EQ(a.bodyB, e.bodyB);
    EXPECT_EQ(a.bucket, e.bucket);
    EXPECT_EQ(a.breakingThreshold, e.breakingThreshold);
    EXPECT_EQ(a.processingThreshold, e.processingThreshold);
    ASSERT_EQ(a.pointCount, e.pointCount);
    for (int k = 0; k < a.pointCount; ++k) {
      SCOPED_TRACE(k);
      expectSame(a.points[k], e.points[k],
                 kTolerance * (apart + sizeOf(e.points[k].localPointA) + sizeOf(e.points[k].localPointB)));
    }
  }

  static void expectSame(const ContactPoint& a, const ContactPoint& e, float error) {
    EXPECT_LE(sizeOf(a.localPointA - e.localPointA), error);
    EXPECT_LE(sizeOf(a.localPointB - e.localPointB), error);
    EXPECT_NEAR(a.localPointA.w, e.localPointA.w, error);
    EXPECT_LE(sizeOf(a.normalWorldOnB - e.normalWorldOnB), 0);
    EXPECT_LE(sizeOf(a.lateralFrictionDir1 - e.lateralFrictionDir1), 1e-6f);
    EXPECT_LE(sizeOf(a.lateralFrictionDir2 - e.lateralFrictionDir2), 1e-6f);
    EXPECT_EQ(a.localPointB.w, e.localPointB.w);
    EXPECT_EQ(a.normalWorldOnB.w, e.normalWorldOnB.w);
    EXPECT_EQ(a.lateralFrictionDir1.w, e.lateralFrictionDir1.w);
    EXPECT_EQ(a.lateralFrictionDir2.w, 0);
    for (const auto& [actual, expected] : {std::pair{a.combined.x, e.combined.x},
                                           {a.combined.y, e.combined.y},
                                           {a.combined.z, e.combined.z},
                                           {a.combined.w, e.combined.w},
                                           {a.combinedStiffness, e.combinedStiffness},
                                           {a.combinedDamping, e.combinedDamping}}) {
      EXPECT_NEAR(actual, expected, 4e-7f * std::fabs(expected));  // three roundings
    }
    EXPECT_EQ(a.lifeTime, e.lifeTime);
    EXPECT_EQ(a.flags, e.flags);
  }

  // Makes the result of a step the old manifolds of the next one, with impulses as if a solver had run.
  static void nextStep(Stage48Input& in, std::vector<Manifold> manifolds) {
    float impulse = 1;
    for (uint i = 0; i < manifolds.size(); ++i) {
      in.world.pairs[i].oldManifold = i;
      for (int k = 0; k < manifolds[i].pointCount; ++k) {
        ContactPoint& p = manifolds[i].points[k];
        p.localPointB.w = impulse;
        p.normalWorldOnB.w = 0.25f * impulse;
        p.lateralFrictionDir1.w = -0.125f * impulse;
        impulse += 1;
      }
    }
    in.world.oldManifolds = std::move(manifolds);
  }
};

TEST_F(MatchContactsTest, NoOldManifoldSmall) {
  Stage48Input in = boxOnBox();
  std::vector<Manifold> m;
  for (const uint smaller : {1u, 0u}) {
    in.world.world.shape(static_cast<int>(smaller)).breakingThreshold = 0.03f;
    in.world.world.shape(static_cast<int>(1 - smaller)).breakingThreshold = 0.05f;
    in.world.world.material(smaller).contactProcessingThreshold = 0.5f;
    in.world.world.material(1 - smaller).contactProcessingThreshold = 0.7f;
    m = expectAsReference(in);
    EXPECT_EQ(m[0].pointCount, 0);
    EXPECT_EQ(m[0].breakingThreshold, 0.03f);
    EXPECT_EQ(m[0].processingThreshold, 0.5f);
  }

  in.contacts[0] =
      candidates(kUp, {below(0.5f, 0.25f, -0.01f), below(-0.5f, 0, 0.029f), below(0, 0, 0.031f)});
  m = expectAsReference(in);
  ASSERT_EQ(m[0].pointCount, 2);  // the third is beyond the breaking threshold
  const ContactPoint& p = m[0].points[0];
  EXPECT_NEAR(p.localPointA.y, -0.25f, 1e-6f);
  EXPECT_NEAR(p.localPointB.y, 0.26f, 1e-6f);
  EXPECT_NEAR(p.localPointA.w, -0.01f, 1e-6f);
  EXPECT_EQ(p.lifeTime, 1);
  EXPECT_EQ(p.localPointB.w, 0);
  EXPECT_EQ(p.flags, 0);
}

TEST_F(MatchContactsTest, NoPairsSmall) {
  Stage48Input in;
  in.world.world.add(in.world.world.sphere(1), {});
  expectAsReference(in);
}

TEST_F(MatchContactsTest, InactiveAndContactlessPairsAreCarriedBitForBitSmall) {
  std::mt19937 random(1);
  Stage48Input in = boxOnBox();
  in.contacts[0] = candidates(kUp, {below(0.5f, 0.25f, -0.01f), below(-0.5f, 0, 0.005f)});
  nextStep(in, device(in));
  // Poses and candidates that would change everything.
  in.world.world.pose(0) = {{3, 4, 5, 0}, randomTurn(random)};
  in.contacts[0] = candidates(kUp, {below(0.1f, 0.1f, -0.02f)});
  for (const uint bucket : {BUCKET_CARRY, BUCKET_NONE}) {
    in.world.pairs[0].bucket = bucket;
    Manifold expected = in.world.oldManifolds[0];
    expected.bucket = bucket;
    EXPECT_TRUE(sameBits(expectAsReference(in)[0], expected));
    // And without one of the last step it stays empty.
    in.world.pairs[0].oldManifold = NO_INDEX;
    EXPECT_EQ(expectAsReference(in)[0].pointCount, 0);
    in.world.pairs[0].oldManifold = 0;
  }
}

TEST_F(MatchContactsTest, MatchedPointsKeepAgeAndImpulsesSmall) {
  Stage48Input in = boxOnBox();
  in.contacts[0] = candidates(kUp, {below(0.5f, 0, -0.01f), below(-0.5f, 0, -0.01f)});
  nextStep(in, device(in));
  in.world.oldManifolds[0].points[0].flags = POINT_LATERAL_FRICTION_INITIALIZED;
  // One within the threshold of 0.02 of the first point's anchor; one just outside that of the second; the
  // second itself is not found again, but is near enough to live on.
  in.contacts[0] = candidates(kUp, {below(-0.5f, 0.021f, -0.01f), below(0.519f, 0, -0.015f)});
  const Manifold m = expectAsReference(in)[0];
  ASSERT_EQ(m.pointCount, 3);
  EXPECT_NEAR(m.points[0].localPointA.x, 0.519f, 1e-6f);
  EXPECT_EQ(m.points[0].lifeTime, 2);
  EXPECT_EQ(m.points[0].localPointB.w, 1);
  EXPECT_EQ(m.points[0].normalWorldOnB.w, 0.25f);
  EXPECT_EQ(m.points[0].lateralFrictionDir1.w, -0.125f);
  EXPECT_EQ(m.points[0].flags, 0);
  EXPECT_EQ(m.points[1].lifeTime, 2);
  EXPECT_EQ(m.points[1].localPointB.w, 2);
  EXPECT_EQ(m.points[2].lifeTime, 1);
  EXPECT_EQ(m.points[2].localPointB.w, 0);
}

TEST_F(MatchContactsTest, TheNearestOldPointIsMatchedSmall) {
  Stage48Input in = boxOnBox();
  in.contacts[0] =
      candidates(kUp, {below(0, 0, -0.01f), below(0.03f, 0, -0.01f), below(0.015f, 0.02f, -0.01f)});
  auto m = device(in);
  ASSERT_EQ(m[0].pointCount, 3);
  nextStep(in, std::move(m));
  in.contacts[0] = candidates(kUp, {below(0.018f, 0, -0.01f)});  // 0.018, 0.012 and 0.0202 away
  const Manifold next = expectAsReference(in)[0];
  ASSERT_EQ(next.pointCount, 3);
  EXPECT_NEAR(next.points[1].localPointA.x, 0.018f, 1e-6f);
  EXPECT_EQ(next.points[1].localPointB.w, 2);
}

TEST_F(MatchContactsTest, PointsThatComeApartAreDroppedSmall) {
  struct Move {
    float x, y;
    int left;
  };
  // Apart along the normal, and sideways, just below and above the threshold of 0.02.
  for (const Move move : {Move{0, 0.029f, 4},
                          {0, 0.031f, 0},
                          {0.0199f, 0, 4},
                          {0.0201f, 0, 0},
                          {-0.0201f, -1, 0},
                          {0, -1, 4}}) {
    Stage48Input in = boxOnBox();
    in.contacts[0] = candidates(
        kUp, {below(1, 1, -0.01f), below(1, -1, -0.01f), below(-1, -1, -0.01f), below(-1, 1, -0.01f)});
    nextStep(in, device(in));
    in.contacts[0] = candidates(kUp, {});
    in.world.world.pose(0).position = {move.x, move.y, 0, 0};
    const Manifold m = expectAsReference(in)[0];
    EXPECT_EQ(m.pointCount, move.left) << move.x << ", " << move.y;
    for (int k = 0; k < m.pointCount; ++k) EXPECT_NEAR(m.points[k].localPointA.w, move.y - 0.01f, 1e-6f);
  }
  // Tilted: two of four leave, and the last ones fill their places.
  Stage48Input in = boxOnBox();
  in.contacts[0] = candidates(kUp, {below(1, 1, 0), below(-1, -1, 0), below(-1, 1, 0), below(1, -1, 0)});
  nextStep(in, device(in));
  in.contacts[0] = candidates(kUp, {});
  in.world.world.pose(0).orientation = turnAbout({0, 0, 1, 0}, 0.03f);
  const Manifold m = expectAsReference(in)[0];
  ASSERT_EQ(m.pointCount, 2);
  EXPECT_LT(m.points[0].localPointA.x, 0);
  EXPECT_LT(m.points[1].localPointA.x, 0);
}

TEST_F(MatchContactsTest, AFifthPointReplacesTheOneThatBulletReplacesSmall) {
  const float4 corners[] = {below(1, 1.1f, -0.01f), below(1.2f, -1, -0.01f), below(-1, -1.3f, -0.01f),
                            below(-1.4f, 1, -0.01f)};
  const float4 fifths[] = {below(1.5f, -1.4f, -0.01f), below(-1.7f, 1.5f, -0.01f),
                           below(1.6f, 1.5f, -0.01f),  below(-1.5f, -1.8f, -0.01f),
                           below(0.1f, -0.2f, -0.01f), below(0.1f, 1.2f, -0.03f)};
  Stage48Input in;
  const int brick = in.world.world.box({1, 0.25f, 1, 0});
  std::vector<int> expected;
  btCollisionObject objectA, objectB;
  for (const float4 fifth : fifths) {
    for (int deepest = -1; deepest < 4; ++deepest) {
      in.world.add(brick, at(0, 0, 0), brick, at(0, -0.5f, 0));
      std::vector<float4> four(corners, corners + 4);
      if (deepest >= 0)
        four[static_cast<size_t>(deepest)] = four[static_cast<size_t>(deepest)] + float4{0, 0.01f, 0, -0.01f};
      in.contacts.push_back(candidates(kUp, four));
      btPersistentManifold bullet(&objectA, &objectB, 0, 0.02f, 1e18f);
      const auto pointOf = [](float4 p) {
        return btManifoldPoint({p.x, p.y + p.w, p.z}, {p.x, p.y + 0.5f, p.z}, {0, 1, 0}, p.w);
      };
      for (const float4 p : four) bullet.addManifoldPoint(pointOf(p));
      expected.push_back(bullet.addManifoldPoint(pointOf(fifth)));
      // The deepest point is never given up, unless the new one is deeper.
      EXPECT_TRUE(deepest < 0 || fifth.w < -0.02f || expected.back() != deepest);
    }
  }
  nextStep(in, device(in));
  for (size_t i = 0; i < in.contacts.size(); ++i) in.contacts[i] = candidates(kUp, {fifths[i / 5]});
  const auto manifolds = expectAsReference(in);
  for (size_t i = 0; i < manifolds.size(); ++i) {
    ASSERT_EQ(manifolds[i].pointCount, 4);
    for (int k = 0; k < 4; ++k)
      EXPECT_EQ(manifolds[i].points[k].lifeTime, k == expected[i] ? 1 : 2) << i << ", " << k;
  }
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(std::unique(expected.begin(), expected.end()) - expected.begin(),
            4);  // each of the four was replaced
}

TEST_F(MatchContactsTest, SpheresKeepNothingSmall) {
  Stage48Input in;
  const int ball = in.world.world.sphere(0.5f);
  in.world.add(ball, at(0, 0, 0), ball, at(0, -0.99f, 0));
  in.contacts = {candidates(kUp, {{0, -0.49f, 0, -0.01f}})};
  nextStep(in, expectAsReference(in));
  Manifold m = expectAsReference(in)[0];
  ASSERT_EQ(m.pointCount, 1);
  EXPECT_EQ(m.points[0].lifeTime, 0);
  EXPECT_EQ(m.points[0].localPointB.w, 0);
  in.contacts[0] = candidates(kUp, {});
  EXPECT_EQ(expectAsReference(in)[0].pointCount, 0);
}

TEST_F(MatchContactsTest, MaterialsAreCombinedAsInBulletSmall) {
  std::mt19937 random(2);
  Stage48Input in;
  const int brick = in.world.world.box({1, 0.25f, 1, 0});
  for (int k = 0; k < 12; ++k) {
    in.world.add(brick, at(0, 0, 0), brick, at(0, -0.5f, 0));
    in.contacts.push_back(candidates(kUp, {below(0, 0, -0.01f)}));
    for (const uint body : {in.world.pairs.back().bodyA, in.world.pairs.back().bodyB}) {
      BodyMaterial& m = in.world.world.material(body);
      m.friction = uniform(random, -5, 5);  // products beyond the limit of 10 too
      m.rollingFriction = uniform(random, -3, 3);
      m.spinningFriction = uniform(random, -3, 3);
      m.restitution = uniform(random, 0, 1);
      m.contactStiffness = uniform(random, 1, 1000);
      m.contactDamping = uniform(random, 0, 1);
      if (random() % 2) in.world.world.info(body).flags |= BODY_STIFFNESS;
    }
  }
  expectAsReference(in);
}

TEST_F(MatchContactsTest, FrictionDirectionsForAllNormals) {
  std::mt19937 random(3);
  Stage48Input in;
  const int brick = in.world.world.box({1, 1, 1, 0});
  std::vector<float4> normals = {
      {1, 0, 0, 0},        {-1, 0, 0, 0},     kUp, -kUp, {0, 0, 1, 0}, {0, 0, -1, 0}, {0.8f, 0, 0.6f, 0},
      {0.6f, 0, -0.8f, 0}, {0, 0.6f, 0.8f, 0}};
  while (normals.size() < 200) {
    const float4 v = uniform3(random, -1, 1), n = v / sizeOf(v);
    if (std::fabs(std::fabs(n.z) - 0.70710678f) > 1e-5f) normals.push_back(n);
  }
  for (const float4 n : normals) {
    in.world.add(brick, at(0, 0, 0), brick, at(0, 0, 0));
    in.contacts.push_back(candidates(n, {{0.1f, 0.2f, 0.3f, -0.01f}}));
  }
  expectAsReference(in);
}

// Candidates around a circle of random depths: no two choices are equally good.
RawContacts randomCandidates(std::mt19937& random, int count, float radius) {
  const float4 v = uniform3(random, -1, 1), n = v / sizeOf(v);
  const float4 other = std::fabs(n.x) < 0.5f ? float4{1, 0, 0, 0} : kUp;
  float4 u = {n.y * other.z - n.z * other.y, n.z * other.x - n.x * other.z, n.x * other.y - n.y * other.x, 0};
  u = u / sizeOf(u);
  const float4 w = {n.y * u.z - n.z * u.y, n.z * u.x - n.x * u.z, n.x * u.y - n.y * u.x, 0};
  std::vector<float4> points;
  for (int k = 0; k < count; ++k) {
    const float a =
        6.2831853f * (static_cast<float>(k) + uniform(random, 0, 0.8f)) / static_cast<float>(count);
    const float r = radius * uniform(random, 0.5f, 1), d = uniform(random, -0.1f, 0.018f);
    float4 p = u * (r * std::cos(a)) + w * (r * std::sin(a)) - n * d;
    p.w = d;
    points.push_back(p);
  }
  return candidates(n, points);
}

TEST_F(MatchContactsTest, ManyCandidatesAreReducedToFour) {
  std::mt19937 random(4);
  Stage48Input in;
  const int brick = in.world.world.box({1, 1, 1, 0});
  for (int k = 0; k < 600; ++k) {
    in.world.add(brick, {{0, 0, 0, 0}, randomTurn(random)}, brick,
                 {uniform3(random, -1, 1), randomTurn(random)});
    in.contacts.push_back(randomCandidates(random, 5 + k % 4, 1));
  }
  const auto manifolds = expectAsReference(in);
  for (size_t i = 0; i < manifolds.size(); ++i) {
    const RawContacts& raw = in.contacts[i];
    const float deepest =
        std::min_element(raw.points, raw.points + raw.count, [](float4 a, float4 b) { return a.w < b.w; })->w;
    float kept = 1;
    for (int k = 0; k < manifolds[i].pointCount; ++k)
      kept = std::min(kept, manifolds[i].points[k].localPointA.w);
    EXPECT_NEAR(kept, deepest, 1e-5f) << i;
    EXPECT_GE(manifolds[i].pointCount, 3) << i;
  }
}

TEST_F(MatchContactsTest, ASheetsEightCornersAreReducedSmall) {
  // The two faces of a thin sheet on the ground: pairs of corners one above the other. The lower four stay.
  Stage48Input in = boxOnBox();
  std::vector<float4> corners;
  for (int k = 0; k < 8; ++k)
    corners.push_back(below(k & 1 ? 1.0f : -1.0f, k & 4 ? 1.5f : -1.5f,
                            k & 2 ? 0.002f : -0.001f * static_cast<float>(k + 1)));
  in.contacts[0] = candidates(kUp, corners);
  const Manifold m = expectAsReference(in)[0];
  ASSERT_EQ(m.pointCount, 4);
  // Points on a line: only its ends stay.
  in.contacts[0] = candidates(
      kUp, {below(0, 0, -0.01f), below(1, 0, -0.01f), below(-2, 0, -0.015f), below(3, 0, 0), below(4, 0, 0)});
  EXPECT_EQ(expectAsReference(in)[0].pointCount, 2);
}

TEST_F(MatchContactsTest, NothingAfterAnOverflowSmall) {
  Stage48Input in = boxOnBox();
  in.contacts[0] = candidates(kUp, {below(0, 0, -0.01f)});
  device(in, OVERFLOW_PAIRS);
}

// Pairs of all buckets with random manifolds of the last step, or none, and random candidates near its
// points.
Stage48Input randomInput(std::mt19937& random, size_t count) {
  Stage48Input in;
  WorldBuilder& b = in.world.world;
  for (size_t i = 0; i < count; ++i) {
    in.world.add(b.box({1, 1, 1, 0}), {uniform3(random, -1, 1), randomTurn(random)}, b.box({1, 1, 1, 0}),
                 {uniform3(random, -1, 1), randomTurn(random)});
    in.contacts.push_back(randomCandidates(random, static_cast<int>(random() % 9), 1));
    in.world.pairs.back().bucket = BUCKET_BOX_BOX;
  }
  return in;
}

void moveABit(std::mt19937& random, Stage48Input& in) {
  static const uint kBuckets[] = {BUCKET_BOX_BOX,      BUCKET_BOX_BOX, BUCKET_BOX_PLANE, BUCKET_SPHERE_BOX,
                                  BUCKET_SPHERE_PLANE, BUCKET_CARRY,   BUCKET_NONE};
  for (size_t i = 0; i < in.world.pairs.size(); ++i) {
    Pair& pair = in.world.pairs[i];
    pair.bucket = kBuckets[random() % 7];
    if (random() % 8 == 0) pair.oldManifold = NO_INDEX;
    BodyPose& a = in.world.world.pose(pair.bodyA);
    const float4 step = uniform3(random, -0.012f, 0.012f);
    a.position += step;
    a.orientation =
        turnProduct(turnAbout(uniform3(random, -1, 1), uniform(random, -0.01f, 0.01f)), a.orientation);
    // Some candidates as before, some elsewhere.
    RawContacts& raw = in.contacts[i];
    if (random() % 3 == 0) raw = randomCandidates(random, static_cast<int>(random() % 9), 1);
    for (int k = 0; k < raw.count; ++k) {
      const float w = raw.points[k].w + uniform(random, -0.005f, 0.005f);
      raw.points[k] += uniform3(random, -0.01f, 0.01f);
      raw.points[k].w = w;
    }
  }
}

TEST_F(MatchContactsTest, RandomSmall) {
  std::mt19937 random(5);
  Stage48Input in = randomInput(random, 32);
  for (int step = 0; step < 3; ++step) {
    nextStep(in, expectAsReference(in));
    moveABit(random, in);
  }
}

TEST_F(MatchContactsTest, RandomOfAllCounts) {
  std::mt19937 random(6);
  for (const size_t count : {1u, 31u, 33u, 127u, 128u, 129u, 1000u}) {
    SCOPED_TRACE(count);
    Stage48Input in = randomInput(random, count);
    for (int step = 0; step < 6; ++step) {
      nextStep(in, expectAsReference(in, count % 2));
      moveABit(random, in);
    }
  }
}

btVector3 vectorOf(float4 v) { return {v.x, v.y, v.z}; }
btTransform transformOf(const BodyPose& p) {
  const float4 q = p.orientation;
  return btTransform({q.x, q.y, q.z, q.w}, vectorOf(p.position));
}

void expectAsBullet(const Manifold& m, const btPersistentManifold& bullet) {
  ASSERT_EQ(m.pointCount, bullet.getNumContacts());
  for (int k = 0; k < m.pointCount; ++k) {
    const ContactPoint& p = m.points[k];
    const btManifoldPoint& b = bullet.getContactPoint(k);
    EXPECT_LE((vectorOf(p.localPointA) - b.m_localPointA).length(), 1e-5f) << k;
    EXPECT_LE((vectorOf(p.localPointB) - b.m_localPointB).length(), 1e-5f) << k;
    EXPECT_NEAR(p.localPointA.w, b.getDistance(), 1e-5f) << k;
    EXPECT_LE((vectorOf(p.lateralFrictionDir1) - b.m_lateralFrictionDir1).length(), 1e-6f) << k;
    EXPECT_LE((vectorOf(p.lateralFrictionDir2) - b.m_lateralFrictionDir2).length(), 1e-6f) << k;
    EXPECT_EQ(p.localPointB.w, b.m_appliedImpulse) << k;
    EXPECT_EQ(p.normalWorldOnB.w, b.m_appliedImpulseLateral1) << k;
    EXPECT_EQ(p.lateralFrictionDir1.w, b.m_appliedImpulseLateral2) << k;
    EXPECT_EQ(p.lifeTime, b.getLifeTime()) << k;
    EXPECT_FLOAT_EQ(p.combined.x, b.m_combinedFriction) << k;
    EXPECT_FLOAT_EQ(p.combined.y, b.m_combinedRestitution) << k;
  }
}

// Gives Bullet's points the impulses that nextStep gave ours.
void copyImpulses(const Manifold& m, btPersistentManifold& bullet) {
  for (int k = 0; k < m.pointCount && k < bullet.getNumContacts(); ++k) {
    bullet.getContactPoint(k).m_appliedImpulse = m.points[k].localPointB.w;
    bullet.getContactPoint(k).m_appliedImpulseLateral1 = m.points[k].normalWorldOnB.w;
    bullet.getContactPoint(k).m_appliedImpulseLateral2 = m.points[k].lateralFrictionDir1.w;
  }
}

// 48 moving pairs over 60 steps: the same candidates, at most four, go into a real btPersistentManifold
// through btManifoldResult.
TEST_F(MatchContactsTest, FollowsBulletsManifoldForSixtySteps) {
  std::mt19937 random(7);
  constexpr size_t kPairs = 48;
  Stage48Input in = randomInput(random, kPairs);
  btBoxShape shape({1, 1, 1});
  std::vector<std::unique_ptr<btCollisionObject>> objects;
  std::vector<std::unique_ptr<btPersistentManifold>> manifolds;
  for (uint body = 0; body < 2 * kPairs; ++body) {
    objects.push_back(std::make_unique<btCollisionObject>());
    objects[body]->setCollisionShape(&shape);
    objects[body]->setFriction(in.world.world.material(body).friction = uniform(random, 0, 2));
    objects[body]->setRestitution(in.world.world.material(body).restitution = uniform(random, 0, 1));
  }
  for (size_t i = 0; i < kPairs; ++i) {
    manifolds.push_back(std::make_unique<btPersistentManifold>(objects[2 * i].get(), objects[2 * i + 1].get(),
                                                               0, 0.02f, 1e18f));
  }
  size_t replaced = 0, dropped = 0, matched = 0;
  for (int step = 0; step < 60; ++step) {
    for (size_t i = 0; i < kPairs; ++i) {
      BodyPose& a = in.world.world.pose(in.world.pairs[i].bodyA);
      a.position += uniform3(random, -0.006f, 0.006f);
      a.orientation =
          turnProduct(turnAbout(uniform3(random, -1, 1), uniform(random, -0.004f, 0.004f)), a.orientation);
      RawContacts& raw = in.contacts[i];
      if (random() % 4 == 0) raw = randomCandidates(random, static_cast<int>(random() % 5), 0.2f);
      raw.count = std::min(raw.count, MANIFOLD_POINTS);
      for (int k = 0; k < raw.count; ++k) {
        const float w = raw.points[k].w;
        raw.points[k] += uniform3(random, -0.004f, 0.004f);
        raw.points[k].w = w;
      }
    }
    auto ours = device(in);
    for (size_t i = 0; i < kPairs; ++i) {
      SCOPED_TRACE(testing::Message() << "step " << step << ", pair " << i);
      const Pair& pair = in.world.pairs[i];
      btCollisionObject &a = *objects[pair.bodyA], &b = *objects[pair.bodyB];
      a.setWorldTransform(transformOf(in.world.world.pose(pair.bodyA)));
      b.setWorldTransform(transformOf(in.world.world.pose(pair.bodyB)));
      const btCollisionObjectWrapper wrapA(nullptr, &shape, &a, a.getWorldTransform(), -1, -1);
      const btCollisionObjectWrapper wrapB(nullptr, &shape, &b, b.getWorldTransform(), -1, -1);
      btManifoldResult result(&wrapA, &wrapB);
      result.setPersistentManifold(manifolds[i].get());
      const RawContacts& raw = in.contacts[i];
      const int before = manifolds[i]->getNumContacts();
      for (int k = 0; k < raw.count; ++k) {
        result.addContactPoint(vectorOf(raw.normal),
                               vectorOf(raw.points[k]) + a.getWorldTransform().getOrigin(), raw.points[k].w);
      }
      replaced += before == 4 && raw.count > 0;
      const int added = manifolds[i]->getNumContacts();
      result.refreshContactPoints();
      dropped += manifolds[i]->getNumContacts() < added;
      for (int k = 0; k < manifolds[i]->getNumContacts(); ++k)
        matched += manifolds[i]->getContactPoint(k).getLifeTime() > 5;
      expectAsBullet(ours[i], *manifolds[i]);
    }
    if (HasFailure()) return;
    nextStep(in, std::move(ours));
    for (size_t i = 0; i < kPairs; ++i) copyImpulses(in.world.oldManifolds[i], *manifolds[i]);
  }
  EXPECT_GT(replaced, 50u);
  EXPECT_GT(dropped, 50u);
  EXPECT_GT(matched, 50u);
}

// Pairs with a sphere that roll, slide and bounce along a path for 60 steps, through stages 42 and 48 on one
// side and Bullet's collision world on the other.
TEST_F(MatchContactsTest, FollowsBulletsDispatcherForSixtySteps) {
  PairWorld p;
  WorldBuilder& b = p.world;
  const int ball = b.sphere(0.5f), small = b.sphere(0.25f), floor = b.plane(kUp, 0),
            brick = b.box({1, 0.5f, 1, 0});
  p.add(ball, at(0, 0, 0), small, at(0, -0.75f, 0));
  p.add(ball, at(0, 0, 0), floor, at(0, -0.5f, 0));
  p.add(ball, at(0, 0, 0), brick, at(0, -1, 0));
  btSphereShape bulletBall(0.5f), bulletSmall(0.25f);
  btStaticPlaneShape bulletFloor({0, 1, 0}, 0);
  btBoxShape bulletBrick({1, 0.5f, 1});
  b.shape(brick).margin = static_cast<float>(bulletBrick.getMargin());
  btCollisionShape* shapes[] = {&bulletBall,  &bulletSmall, &bulletBall,
                                &bulletFloor, &bulletBall,  &bulletBrick};

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  dispatcher.setDispatcherFlags(dispatcher.getDispatcherFlags() &
                                ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
  btDbvtBroadphase broadphase;
  btCollisionWorld world(&dispatcher, &broadphase, &configuration);
  btCollisionObject objects[6];
  for (uint i = 0; i < 6; ++i) {
    objects[i].setCollisionShape(shapes[i]);
    objects[i].setFriction(0.5f);
    objects[i].setUserIndex(static_cast<int>(i));
    objects[i].setWorldTransform(transformOf(b.pose(i)));
    world.addCollisionObject(&objects[i], 1 << i / 2, 1 << i / 2);  // pairs meet only each other
  }

  int touching[3] = {};
  for (int step = 0; step < 60; ++step) {
    // Down into contact, along it, and up again; rolling all the while.
    const float t = static_cast<float>(step) / 60, height = 0.05f * std::cos(6.2831853f * 2 * t) + 0.03f;
    for (uint i = 0; i < 6; i += 2)
      b.pose(i) = {{0.1f * t, height, 0.05f * t * t, 0}, turnAbout({0.2f, 0.1f, 1, 0}, 0.3f * t)};

    StageBench bench(queue(), b.finish());
    bench.setPairs(p.pairs);
    bench.setOldManifolds(p.oldManifolds);
    bench.run<CollidePrimitives>(~0u);
    bench.run<ReduceAndMatchContacts>();
    Stage48Input next{p, {}};
    nextStep(next, bench.read(bench.world().manifolds, 3));

    for (uint i = 0; i < 6; ++i) objects[i].setWorldTransform(transformOf(b.pose(i)));
    world.performDiscreteCollisionDetection();
    ASSERT_EQ(dispatcher.getNumManifolds(), 3);
    for (int k = 0; k < 3; ++k) {
      btPersistentManifold& bullet = *dispatcher.getManifoldByIndexInternal(k);
      const auto pair = static_cast<size_t>(bullet.getBody0()->getUserIndex() / 2);
      SCOPED_TRACE(testing::Message() << "step " << step << ", pair " << pair);
      const Manifold ours = bench.read(bench.world().manifolds, 3)[pair];
      ASSERT_EQ(static_cast<int>(ours.bodyA), bullet.getBody0()->getUserIndex());
      expectAsBullet(ours, bullet);
      touching[pair] += ours.pointCount > 0;
      copyImpulses(next.world.oldManifolds[pair], bullet);
    }
    if (HasFailure()) break;
    p = next.world;
  }
  for (const int steps : touching) {
    EXPECT_GT(steps, 10);
    EXPECT_LT(steps, 50);
  }
  for (auto& object : objects) world.removeCollisionObject(&object);
}

}  // namespace
}  // namespace btgpu
