// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/stages/48_reduce_and_match_contacts_fixture.h"

namespace btgpu {
namespace {

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

  in.contacts[0] = candidates(kUp, {below(0.5f, 0.25f, -0.01f), below(-0.5f, 0, 0.029f), below(0, 0, 0.031f)});
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
    expected.unseen = 0;
    for (int k = 0; k < expected.pointCount; ++k) expected.points[k].flags = (k + 1) << POINT_ORIGIN_SHIFT;
    EXPECT_TRUE(sameBits(expectAsReference(in)[0], expected));
    // And without one of the last step it stays empty.
    in.world.pairs[0].oldManifold = NO_INDEX;
    EXPECT_EQ(expectAsReference(in)[0].pointCount, 0);
    in.world.pairs[0].oldManifold = 0;
  }
}

// A pair that the application does not let collide is carried from its second step on, and still has no manifold.
TEST_F(MatchContactsTest, APairThatNeverCollidedIsKnownInAllItsStepsSmall) {
  Stage48Input in = boxOnBox();
  in.contacts[0] = candidates(kUp, {below(0, 0, -0.01f)});
  in.world.pairs[0].bucket = BUCKET_CARRY;  // of inactive bodies
  nextStep(in, expectAsReference(in));
  EXPECT_EQ(in.world.oldManifolds[0].bucket, BUCKET_NONE);
  for (const uint bucket : {BUCKET_NONE, BUCKET_CARRY, BUCKET_CARRY}) {
    in.world.pairs[0].bucket = bucket;
    nextStep(in, expectAsReference(in));
    EXPECT_EQ(in.world.oldManifolds[0].bucket, BUCKET_NONE);
  }
  in.world.pairs[0].bucket = BUCKET_BOX_BOX;
  nextStep(in, expectAsReference(in));
  in.world.pairs[0].bucket = BUCKET_CARRY;
  nextStep(in, expectAsReference(in));
  EXPECT_EQ(in.world.oldManifolds[0].bucket, BUCKET_CARRY);
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
  EXPECT_EQ(m.points[0].flags, 1 << POINT_ORIGIN_SHIFT) << "the first one of the last step, its flags made anew";
  EXPECT_EQ(m.points[1].lifeTime, 2);
  EXPECT_EQ(m.points[1].localPointB.w, 2);
  EXPECT_EQ(m.points[1].flags, 2 << POINT_ORIGIN_SHIFT) << "the second one";
  EXPECT_EQ(m.points[2].flags, 0) << "a new one";
  EXPECT_EQ(m.points[2].lifeTime, 1);
  EXPECT_EQ(m.points[2].localPointB.w, 0);
}

// Over steps that the host does not see, a point keeps the index under which the host knows it, and a manifold that
// changed stays marked, also while it is carried over.
TEST_F(MatchContactsTest, WhatTheHostDidNotSeeSmall) {
  const auto origins = [](const Manifold& m) {
    std::vector<int> list;
    for (int k = 0; k < m.pointCount; ++k) list.push_back(m.points[k].flags >> POINT_ORIGIN_SHIFT);
    return list;
  };
  Stage48Input in = boxOnBox();
  in.contacts[0] = candidates(kUp, {below(0.5f, 0, -0.01f), below(-0.5f, 0, -0.01f), below(0, 0.5f, -0.01f)});
  nextStep(in, expectAsReference(in));
  in.contacts[0] = candidates(kUp, {});
  nextStep(in, expectAsReference(in));
  EXPECT_EQ(origins(in.world.oldManifolds[0]), (std::vector<int>{1, 2, 3}));
  // The first one comes apart, so that the last one takes its place; a new one comes.
  in.world.oldManifolds[0].points[0].localPointA.y += 1;
  in.contacts[0] = candidates(kUp, {below(0, -0.5f, -0.01f)});
  in.unseen = true;
  nextStep(in, expectAsReference(in));
  EXPECT_EQ(origins(in.world.oldManifolds[0]), (std::vector<int>{0, 2, 3}));
  in.contacts[0] = candidates(kUp, {});
  nextStep(in, expectAsReference(in));
  EXPECT_EQ(origins(in.world.oldManifolds[0]), (std::vector<int>{0, 2, 3}));
  in.world.pairs[0].bucket = BUCKET_CARRY;
  nextStep(in, expectAsReference(in));
  EXPECT_EQ(in.world.oldManifolds[0].unseen, 1u);
  EXPECT_EQ(origins(in.world.oldManifolds[0]), (std::vector<int>{0, 2, 3}));
  in.unseen = false;
  nextStep(in, expectAsReference(in));
  EXPECT_EQ(in.world.oldManifolds[0].unseen, 0u);
  EXPECT_EQ(origins(in.world.oldManifolds[0]), (std::vector<int>{1, 2, 3}));
  in.unseen = true;
  EXPECT_EQ(expectAsReference(in)[0].unseen, 0u) << "it was carried ever since the host saw it";
}

TEST_F(MatchContactsTest, TheNearestOldPointIsMatchedSmall) {
  Stage48Input in = boxOnBox();
  in.contacts[0] = candidates(kUp, {below(0, 0, -0.01f), below(0.03f, 0, -0.01f), below(0.015f, 0.02f, -0.01f)});
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
  for (const Move move :
       {Move{0, 0.029f, 4}, {0, 0.031f, 0}, {0.0199f, 0, 4}, {0.0201f, 0, 0}, {-0.0201f, -1, 0}, {0, -1, 4}}) {
    Stage48Input in = boxOnBox();
    in.contacts[0] =
        candidates(kUp, {below(1, 1, -0.01f), below(1, -1, -0.01f), below(-1, -1, -0.01f), below(-1, 1, -0.01f)});
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

TEST_F(MatchContactsTest, ManyCandidatesAreReducedToFour) {
  std::mt19937 random(4);
  Stage48Input in;
  const int brick = in.world.world.box({1, 1, 1, 0});
  for (int k = 0; k < 600; ++k) {
    in.world.add(brick, {{0, 0, 0, 0}, randomTurn(random)}, brick, {uniform3(random, -1, 1), randomTurn(random)});
    in.contacts.push_back(randomCandidates(random, 5 + k % 4, 1));
  }
  const auto manifolds = expectAsReference(in);
  for (size_t i = 0; i < manifolds.size(); ++i) {
    const RawContacts& raw = in.contacts[i];
    const float deepest =
        std::min_element(raw.points, raw.points + raw.count, [](float4 a, float4 b) { return a.w < b.w; })->w;
    float kept = 1;
    for (int k = 0; k < manifolds[i].pointCount; ++k) kept = std::min(kept, manifolds[i].points[k].localPointA.w);
    EXPECT_NEAR(kept, deepest, 1e-5f) << i;
    EXPECT_GE(manifolds[i].pointCount, 3) << i;
  }
}

TEST_F(MatchContactsTest, ASheetsEightCornersAreReducedSmall) {
  // The two faces of a thin sheet on the ground: pairs of corners one above the other. The lower four stay.
  Stage48Input in = boxOnBox();
  std::vector<float4> corners;
  for (int k = 0; k < 8; ++k)
    corners.push_back(
        below(k & 1 ? 1.0f : -1.0f, k & 4 ? 1.5f : -1.5f, k & 2 ? 0.002f : -0.001f * static_cast<float>(k + 1)));
  in.contacts[0] = candidates(kUp, corners);
  const Manifold m = expectAsReference(in)[0];
  ASSERT_EQ(m.pointCount, 4);
  // Points on a line: only its ends stay.
  in.contacts[0] = candidates(
      kUp, {below(0, 0, -0.01f), below(1, 0, -0.01f), below(-2, 0, -0.015f), below(3, 0, 0), below(4, 0, 0)});
  EXPECT_EQ(expectAsReference(in)[0].pointCount, 2);
}

// A box that turns under a plane: its old points are all deeper than the new ones, and lose their places to them one by
// one; none of those may push out the deepest. Of a plane's candidates it is added last, wherever it stands.
TEST_F(MatchContactsTest, DeepestCornerOnAPlaneStaysSmall) {
  for (const uint bucket : {BUCKET_BOX_PLANE, BUCKET_HULL_PLANE}) {
    for (int count : {2, 3, 4, 8}) {
      for (int deepest = 0; deepest < count; ++deepest) {
        Stage48Input in = boxOnBox();
        in.world.pairs[0].bucket = bucket;
        in.contacts[0] =
            candidates(kUp, {below(1, 1, -0.3f), below(1, -1, -0.3f), below(-1, 1, -0.3f), below(-1, -1, -0.3f)});
        nextStep(in, device(in));
        // It has turned: none of the old points is where it was.
        in.world.world.pose(0).orientation = {0, std::sin(0.2f), 0, std::cos(0.2f)};
        std::vector<float4> points;
        for (int k = 0; k < count; ++k) {
          const float turn = 6.2831853f * static_cast<float>(k) / static_cast<float>(count);
          points.push_back(below(std::cos(turn), std::sin(turn), k == deepest ? -0.2f : -0.1f));
        }
        in.contacts[0] = candidates(kUp, points);
        const Manifold m = expectAsReference(in)[0];
        bool found = false;
        for (int k = 0; k < m.pointCount; ++k) found |= std::fabs(m.points[k].localPointA.w + 0.2f) < 1e-6f;
        EXPECT_TRUE(found) << "bucket " << bucket << ", " << deepest << " of " << count;
      }
    }
  }
}

TEST_F(MatchContactsTest, NothingAfterAnOverflowSmall) {
  Stage48Input in = boxOnBox();
  in.contacts[0] = candidates(kUp, {below(0, 0, -0.01f)});
  device(in, OVERFLOW_PAIRS);
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
    a.orientation = turnProduct(turnAbout(uniform3(random, -1, 1), uniform(random, -0.01f, 0.01f)), a.orientation);
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

}  // namespace
}  // namespace btgpu
