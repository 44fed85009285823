// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/42_collide_primitives.h"

#include <btBulletCollisionCommon.h>

#include <memory>

#include "gpu_engine/stages/42_collide_primitives_reference.h"
#include "tests/support/bullet_convert.h"
#include "tests/support/convex_pairs.h"
#include "tests/support/device_test.h"
#include "tests/support/pair_world.h"
#include "tests/support/stage_bench.h"

namespace btgpu {
namespace {

class CollidePrimitivesTest : public DeviceTest {
 protected:
  std::vector<RawContacts> device(const PairWorld& p, uint overflow = 0, uint shapeTypes = ~0u) {
    StageBench bench = benchForPairs(queue(), p, m_spare);
    bench.poison(bench.world().contacts);
    bench.setOverflow(overflow);
    bench.run<CollidePrimitives>(shapeTypes);
    auto contacts = bench.read(bench.world().contacts);
    for (size_t i = p.pairs.size(); i < contacts.size(); ++i) EXPECT_TRUE(StageBench::isPoison(contacts[i])) << i;
    contacts.resize(p.pairs.size());
    return contacts;
  }

  std::vector<RawContacts> expectAsReference(const PairWorld& p) {
    const auto actual = device(p);
    RawContacts poison;
    std::memset(static_cast<void*>(&poison), StageBench::kPoison, sizeof poison);
    Contract contract("42_collide_primitives");
    checkPrimitiveContacts(contract, arraysOf(p), std::vector<RawContacts>(p.pairs.size(), poison), actual);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return actual;
  }

  size_t m_spare = 5;
};

TEST_F(CollidePrimitivesTest, CurvedOnPlanesSmall) {
  std::mt19937 random(5);
  expectAsReference(randomCurvedPairs(random, 12, true));
}

TEST_F(CollidePrimitivesTest, CurvedOnPlanes) {
  std::mt19937 random(6);
  size_t several = 0, none = 0;
  for (const RawContacts& raw : expectAsReference(randomCurvedPairs(random, 2000, true))) {
    several += raw.count > 1;
    none += raw.count == 0;
  }
  EXPECT_GT(several, 300u);
  EXPECT_GT(none, 300u);
}

// Upright: the rim, in a square. Lying: both ends of the line. Tilted: the lowest point.
TEST_F(CollidePrimitivesTest, CylinderAndConeStandAndLieSmall) {
  PairWorld p;
  const int ground = p.world.plane({0, 1, 0, 0}, 0), drum = p.world.cylinder(1, 0.5f, 0.4f),
            hat = p.world.cone(1, 0.5f, 0.4f);
  const float quarter = 1.5707963f;
  const size_t stands = p.add(drum, at(0, 0.43f, 0), ground, at(0, 0, 0));
  const size_t lies = p.add(drum, at(0, 0.53f, 0, turnAbout({0, 0, 1, 0}, quarter)), ground, at(0, 0, 0));
  const size_t tilted = p.add(drum, at(0, 0.6f, 0, turnAbout({0, 0, 1, 0}, 0.4f)), ground, at(0, 0, 0));
  const size_t hatStands = p.add(hat, at(0, 0.43f, 0), ground, at(0, 0, 0));
  const size_t onTip = p.add(hat, at(0, 0.43f, 0, turnAbout({0, 0, 1, 0}, 2 * quarter)), ground, at(0, 0, 0));
  // Its side leans by asin(0.5 / sqrt(0.8^2 + 0.5^2)) from its axis.
  const float lean = quarter + std::asin(0.5f / std::hypot(0.8f, 0.5f));
  const size_t hatLies = p.add(hat, at(0, 0.24f, 0, turnAbout({0, 0, 1, 0}, lean)), ground, at(0, 0, 0));
  const auto raw = expectAsReference(p);
  EXPECT_EQ(raw[stands].count, 4);
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(raw[stands].points[k].w, -0.01f, 1e-6f);
    EXPECT_NEAR(std::hypot(raw[stands].points[k].x, raw[stands].points[k].z), 0.5f, 1e-6f);
  }
  EXPECT_EQ(raw[lies].count, 2);
  EXPECT_EQ(raw[tilted].count, raw[tilted].points[0].w < 0.02f ? 1 : 0);
  EXPECT_EQ(raw[hatStands].count, 4);
  EXPECT_EQ(raw[onTip].count, 1);
  EXPECT_EQ(raw[hatLies].count, 2);
}

TEST_F(CollidePrimitivesTest, TwoSpheresSmall) {
  PairWorld p;
  const int unit = p.world.sphere(1), half = p.world.sphere(0.5f);
  const size_t overlapping = p.add(unit, at(1, 0, 0), half, at(2, 0, 0));
  const size_t touching = p.add(unit, at(0, 0, 0), half, at(0, -1.5f, 0));
  const size_t apart = p.add(unit, at(0, 0, 0), half, at(0, 0, 1.5001f));
  p.addOldManifold(0.5f);  // spheres must touch whatever the manifold says
  const size_t concentric = p.add(unit, at(3, 3, 3), half, at(3, 3, 3));
  p.add(unit, at(0, 0, 0), half, at(1e-7f, 0, 0));                          // within Bullet's epsilon
  p.add(unit, at(0, 0, 0), half, at(0, 0, 1.3e-7f));                        // beyond it
  p.add(unit, at(1e4f, -2e4f, 3e4f), half, at(1e4f + 1.25f, -2e4f, 3e4f));  // no digits are lost far out
  const auto raw = expectAsReference(p);
  EXPECT_TRUE(equal(raw[overlapping].normal, float4{-1, 0, 0, 0}));
  EXPECT_TRUE(equal(raw[overlapping].points[0], float4{0.5f, 0, 0, -0.5f}));
  EXPECT_EQ(raw[touching].count, 1);
  EXPECT_EQ(raw[touching].points[0].w, 0);
  EXPECT_EQ(raw[apart].count, 0);
  EXPECT_TRUE(equal(raw[concentric].normal, float4{1, 0, 0, 0}));
  EXPECT_EQ(raw[concentric].points[0].w, -1.5f);
}

TEST_F(CollidePrimitivesTest, SphereOnPlaneSmall) {
  PairWorld p;
  const int ball = p.world.sphere(0.5f), floor = p.world.plane({0, 1, 0, 0}, 2);
  const size_t inside = p.add(ball, at(7, 2.25f, 0), floor, at(0, 0, 0));
  const size_t above = p.add(ball, at(0, 2.515f, 0), floor, at(0, 0, 0));
  p.add(ball, at(0, 2.525f, 0), floor, at(0, 0, 0));  // beyond the threshold of 0.02
  const size_t farther = p.add(ball, at(0, 2.525f, 0), floor, at(0, 0, 0));
  p.addOldManifold(0.03f);
  p.add(ball, at(0, 2.515f, 0), floor, at(0, 0, 0));
  p.addOldManifold(0.01f);
  p.add(ball, at(0, -50, 0), floor, at(1, 2, 3));                               // far below
  p.add(ball, at(1, 2, 3), floor, at(1, 0.5f, 0, turnAbout({0, 0, 1, 0}, 1)));  // a tilted, moved plane
  p.add(ball, at(5, -2, 3), floor, at(4, -3.5f, 2, turnAbout({1, 2, 3, 0}, 2)));
  const auto raw = expectAsReference(p);
  EXPECT_TRUE(equal(raw[inside].points[0], float4{0, -0.25f, 0, -0.25f}));
  EXPECT_EQ(raw[above].count, 1);
  EXPECT_EQ(raw[above + 1].count, 0);
  EXPECT_EQ(raw[farther].count, 1);
  EXPECT_EQ(raw[farther + 1].count, 0);
}

TEST_F(CollidePrimitivesTest, BoxOnPlaneSmall) {
  PairWorld p;
  const int brick = p.world.box({0.5f, 1, 2, 0}), sheet = p.world.box({1, 1e-3f, 1, 0}, 1e-4f);
  const int floor = p.world.plane({0, 1, 0, 0}, 0);
  const float4 onEdge = turnAbout({0, 0, 1, 0}, 0.78539816f), onCorner = turnAbout({1, 0.3f, -0.8f, 0}, 0.7f);
  const size_t flat = p.add(brick, at(0, 0.99f, 0), floor, at(0, 0, 0));
  const size_t edge = p.add(brick, at(0, 1.06f, 0, onEdge), floor, at(0, 0, 0));
  p.add(brick, at(0, 1.7f, 0, onCorner), floor, at(0, 0, 0));
  const size_t thin = p.add(sheet, at(0, 1e-3f, 0), floor, at(0, 0, 0));
  const size_t sunk = p.add(brick, at(3, -5, 2, onCorner), floor, at(1, 1, 1));
  const size_t above = p.add(brick, at(0, 1.03f, 0), floor, at(0, 0, 0));
  const size_t within = p.add(brick, at(0, 1.03f, 0), floor, at(0, 0, 0));
  p.addOldManifold(0.04f);
  const auto raw = expectAsReference(p);
  EXPECT_EQ(raw[flat].count, 4);
  EXPECT_EQ(raw[edge].count, 2);
  EXPECT_EQ(raw[thin].count, 8);  // both faces lie within the threshold
  EXPECT_EQ(raw[sunk].count, 8);
  EXPECT_EQ(raw[above].count, 0);
  EXPECT_EQ(raw[within].count, 4);
}

TEST_F(CollidePrimitivesTest, SphereAndBoxSmall) {
  PairWorld p;
  const int ball = p.world.sphere(0.5f), brick = p.world.box({1, 2, 3, 0}, 0.125f);
  const int sheet = p.world.box({1, 1e-3f, 1, 0}, 1e-4f), sharp = p.world.box({1, 1, 1, 0}, 0);
  const float4 turn = turnAbout({1, -2, 0.5f, 0}, 0.9f);
  struct Place {
    float x, y, z;
  };
  // Outside a face, an edge, a corner; between the core and the surface; in the core near each face; the
  // centre.
  const Place places[] = {{1.4f, 0, 0},        {0, -2.4f, 0},     {0, 0, 3.4f},  {1.3f, 2.3f, 0},
                          {1.2f, -2.2f, 3.2f}, {-1.1f, 0, -3.3f}, {0.95f, 0, 0}, {0.5f, 0, 0},
                          {-0.5f, 0, 0},       {0, 1.8f, 0},      {0, -1.8f, 0}, {0, 0, 2.8f},
                          {0, 0, -2.8f},       {1.51f, 0, 0},     {1.53f, 0, 0}, {0, 0, 0}};
  for (const Place& s : places) {
    p.add(ball, at(s.x, s.y, s.z), brick, at(0, 0, 0));
    p.add(brick, at(0, 0, 0), ball, at(s.x, s.y, s.z));
    p.add(ball, at(s.x, s.y, s.z, turn), brick, at(0.25f, -0.5f, 0.125f, turn));
    p.add(brick, at(0.25f, -0.5f, 0.125f, turn), ball, at(s.x, s.y, s.z));
  }
  p.add(sheet, at(0, 0, 0, turn), ball, at(0, 0.3f, 0));
  p.add(ball, at(0, 0, 0), sharp, at(1.25f, 0, 0));
  p.add(ball, at(0, 0, 0), sharp, at(1.25f, 1.25f, 1.25f));
  const auto raw = expectAsReference(p);
  // On the box's face, half way out of the core, from either side.
  EXPECT_TRUE(equal(raw[0].normal, float4{1, 0, 0, 0}));
  EXPECT_NEAR(raw[0].points[0].w, -0.1f, 1e-6f);
  EXPECT_NEAR(raw[0].points[0].x, -0.4f, 1e-6f);  // the box's surface, from the ball
  EXPECT_TRUE(equal(raw[1].normal, float4{-1, 0, 0, 0}));
  EXPECT_NEAR(raw[1].points[0].x, 0.9f, 1e-6f);  // the ball's surface, from the box
  EXPECT_EQ(raw[4 * 13].count, 1);               // 0.01 apart
  EXPECT_EQ(raw[4 * 14].count, 0);               // 0.03 apart
}

TEST_F(CollidePrimitivesTest, CapsulesSmall) {
  PairWorld p;
  std::mt19937 random(6);
  const int ball = p.world.sphere(0.5f), shot = p.world.capsule(0, 0.25f, 0.001f);
  const int x = p.world.capsule(0, 0.5f, 1), y = p.world.capsule(1, 0.25f, 0.5f), z = p.world.capsule(2, 0.3f, 2);
  const int floor = p.world.plane({0, 1, 0, 0}, 0);
  for (int n = 0; n < 6; ++n) {
    for (const int capsule : {x, y, z}) {
      p.add(ball, {uniform3(random, -0.4f, 0.4f), kNoTurn}, capsule,
            {uniform3(random, -0.4f, 0.4f), randomTurn(random)});
      p.add(x, {uniform3(random, -0.4f, 0.4f), randomTurn(random)}, capsule,
            {uniform3(random, -0.4f, 0.4f), randomTurn(random)});
      p.add(capsule, at(0, uniform(random, 0, 0.7f), 0, randomTurn(random)), floor, at(0, 0, 0));
    }
  }
  const size_t lying = p.add(x, at(0, 0.49f, 0, turnAbout({0, 0, 1, 0}, 0.01f)), floor, at(0, 0, 0));
  const size_t standing = p.add(y, at(0, 0.74f, 0), floor, at(0, 0, 0));
  const size_t tiny = p.add(shot, at(0, 0.24f, 0, turnAbout({0, 0, 1, 0}, 0.3f)), floor, at(0, 0, 0));
  const size_t apart = p.add(x, at(0, 0, 0), z, at(0, 0.81f, 0));
  p.add(x, at(0, 0, 0), z, at(0, 0.83f, 0));  // beyond the threshold of 0.02
  const auto raw = expectAsReference(p);
  EXPECT_EQ(raw[lying].count, 2);
  EXPECT_EQ(raw[standing].count, 1);
  EXPECT_EQ(raw[tiny].count, 1) << "its ends are one point for the manifold";
  EXPECT_EQ(raw[apart].count, 1);
  EXPECT_EQ(raw[apart + 1].count, 0);
}

// The four that matter of any number of vertices.
TEST_F(CollidePrimitivesTest, HullsOnPlanesSmall) {
  PairWorld p;
  const int drum = p.world.hull(prismPoints(100, 1, 0.5f)), floor = p.world.plane({0, 1, 0, 0}, 1);
  const size_t flat = p.add(drum, at(7, 1.53f, 0), floor, at(0, 0, 0));
  const size_t tilted = p.add(drum, at(7, 1.6f, 0, turnAbout({1, 0, 0, 0}, 0.05f)), floor, at(0, 0, 0));
  const size_t above = p.add(drum, at(7, 1.57f, 0), floor, at(0, 0, 0));
  const size_t beam = p.add(p.world.hull({{-1, 0, 0, 0}, {1, 0, 0, 0}}), at(0, 1.035f, 0), floor, at(0, 0, 0));
  const size_t grain = p.add(p.world.hull({{0.25f, 0, 0, 0}}), at(0, 1.035f, 0), floor, at(0, 0, 0));
  const auto raw = expectAsReference(p);
  ASSERT_EQ(raw[flat].count, 4);
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(raw[flat].points[k].w, -0.01f, 1e-6f);
    EXPECT_NEAR(raw[flat].points[k].y, -0.53f, 1e-6f);
    for (int m = 0; m < k; ++m) EXPECT_GT(sizeOf(xyzOf(raw[flat].points[k] - raw[flat].points[m])), 1);
  }
  ASSERT_GE(raw[tilted].count, 3);
  const float deepest = 0.6f - 0.5f * std::cos(0.05f) - std::sin(0.05f) - 0.04f;
  EXPECT_NEAR(raw[tilted].points[raw[tilted].count - 1].w, deepest, 1e-6f) << "the deepest last";
  EXPECT_EQ(raw[above].count, 0);
  EXPECT_EQ(raw[beam].count, 2);
  ASSERT_EQ(raw[grain].count, 1);
  EXPECT_NEAR(raw[grain].points[0].x, 0.25f, 1e-6f);
}

// Every kind of pair in turn, random poses near contact. Pairs in which a decision is closer than 1e-4 are
// left out.
PairWorld randomPairs(std::mt19937& random, size_t count) {
  PairWorld p;
  const auto shape = [&](uint kind) {
    if (kind == 0) return p.world.sphere(uniform(random, 0.2f, 1));
    const float4 half = uniform3(random, 0.1f, 1);
    return p.world.box(half, 0.1f * std::fmin(half.x, std::fmin(half.y, half.z)));
  };
  const auto pose = [&](float extent) { return BodyPose{uniform3(random, -extent, extent), randomTurn(random)}; };
  const float4 far = {1000, -2000, 500, 0};
  while (p.pairs.size() < count) {
    const uint kind = static_cast<uint>(p.pairs.size()) % 6;
    BodyPose a = pose(1), b = pose(1);
    a.position += far;
    b.position += far;
    if (kind >= 4) {
      const float4 n = uniform3(random, -1, 1);
      p.add(shape(kind - 4), a, p.world.plane(n / sizeOf(n), uniform(random, -1, 1)), b);
    } else {
      p.add(shape(kind & 1), a, shape(kind >> 1), b);
    }
    for (const uint body : {p.pairs.back().bodyA, p.pairs.back().bodyB}) {
      p.world.shape(p.world.info(body).shapeIndex).breakingThreshold = uniform(random, 0.005f, 0.2f);
    }
    if (random() % 3 == 0) p.addOldManifold(uniform(random, 0.005f, 0.2f));
    Pair& pair = p.pairs.back();
    const auto contacts = [&](float by) {
      Shape s = p.shapeOf(pair.bodyA);
      const Shape t = p.shapeOf(pair.bodyB);
      const float threshold = pair.oldManifold != NO_INDEX ? p.oldManifolds.back().breakingThreshold
                                                           : std::fmin(s.breakingThreshold, t.breakingThreshold);
      if (pair.bucket == BUCKET_SPHERE_SPHERE) s.extents.x += by;
      return collidePrimitivesReference(pair.bucket, s, p.world.pose(pair.bodyA), t, p.world.pose(pair.bodyB),
                                        threshold + by)
          .count;
    };
    if (contacts(1e-4f) != contacts(-1e-4f)) pair.bucket = BUCKET_NONE;
  }
  return p;
}

TEST_F(CollidePrimitivesTest, RandomSmall) {
  std::mt19937 random(1);
  expectAsReference(randomPairs(random, 32));
}

TEST_F(CollidePrimitivesTest, RandomOfAllCounts) {
  std::mt19937 random(2);
  for (const size_t count : {0u, 1u, 31u, 33u, 127u, 128u, 129u, 2500u}) {
    const PairWorld p = randomPairs(random, count);
    m_spare = count % 2;
    SCOPED_TRACE(count);
    const auto raw = expectAsReference(p);
    if (count < 1000) continue;
    // Both outcomes are there for each kind, and few pairs were left out.
    size_t some[BUCKET_COUNT] = {}, none[BUCKET_COUNT] = {};
    for (size_t i = 0; i < count; ++i) ++(raw[i].count > 0 ? some : none)[p.pairs[i].bucket];
    for (const uint bucket : {BUCKET_SPHERE_SPHERE, BUCKET_SPHERE_BOX, BUCKET_SPHERE_PLANE, BUCKET_BOX_PLANE}) {
      EXPECT_GT(some[bucket], 50u) << bucket;
      EXPECT_GT(none[bucket], 10u) << bucket;
    }
    EXPECT_LT(some[BUCKET_NONE] + none[BUCKET_NONE], count / 100);
  }
}

TEST_F(CollidePrimitivesTest, NothingAfterAnOverflowSmall) {
  std::mt19937 random(3);
  for (const RawContacts& raw : device(randomPairs(random, 12), OVERFLOW_PAIRS)) EXPECT_TRUE(StageBench::isPoison(raw));
}

TEST_F(CollidePrimitivesTest, OnlyShapesOfTheWorldAreLookedAt) {
  std::mt19937 random(4);
  const PairWorld p = randomPairs(random, 60);
  const auto raw = device(p, 0, 1u << SHAPE_SPHERE | 1u << SHAPE_BOX);
  for (size_t i = 0; i < raw.size(); ++i) {
    const uint bucket = p.pairs[i].bucket;
    EXPECT_EQ(StageBench::isPoison(raw[i]), bucket != BUCKET_SPHERE_SPHERE && bucket != BUCKET_SPHERE_BOX) << i;
  }
}

// The reference itself against Bullet's algorithms for the same pair, as its default dispatcher chooses them.
struct BulletContacts : btCollisionWorld::ContactResultCallback {
  std::vector<btManifoldPoint> points;
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    points.push_back(point);
    return 0;
  }
};

TEST(CollidePrimitivesReference, AgreesWithBullet) {
  std::mt19937 random(5);
  const PairWorld p = randomPairs(random, 1200);
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btCollisionWorld world(&dispatcher, &broadphase, &configuration);
  const float4 origin = {1000, -2000, 500, 0};  // near it, Bullet's world coordinates have digits to spare
  size_t compared[BUCKET_COUNT] = {};
  for (const Pair& pair : p.pairs) {
    if (pair.bucket < BUCKET_SPHERE_SPHERE || pair.bucket > BUCKET_SPHERE_BOX) continue;
    BodyPose poses[2];
    Shape shapes[2];
    std::unique_ptr<btCollisionShape> bulletShapes[2];
    btCollisionObject objects[2];
    for (int k = 0; k < 2; ++k) {
      const uint body = k == 0 ? pair.bodyA : pair.bodyB;
      poses[k] = p.world.pose(body);
      poses[k].position -= origin;
      shapes[k] = p.shapeOf(body);
      bulletShapes[k] = bulletShapeOf(shapes[k]);
      shapes[k].margin = static_cast<float>(bulletShapes[k]->getMargin());
      objects[k].setCollisionShape(bulletShapes[k].get());
      objects[k].setWorldTransform(toBullet(poses[k]));
    }
    const RawContacts raw = collidePrimitivesReference(pair.bucket, shapes[0], poses[0], shapes[1], poses[1], 0);
    BulletContacts bullet;
    world.contactPairTest(&objects[0], &objects[1], bullet);
    for (const btManifoldPoint& point : bullet.points) {
      if (point.getDistance() > 0) continue;
      ++compared[pair.bucket];
      float nearest = 1e9f, distanceError = 0;
      for (int k = 0; k < raw.count; ++k) {
        const btVector3 onB = toBullet(raw.points[k]) + toBullet(poses[0].position);
        const float apart = static_cast<float>((onB - point.getPositionWorldOnB()).length());
        if (apart >= nearest) continue;
        nearest = apart;
        distanceError = std::fabs(raw.points[k].w - static_cast<float>(point.getDistance()));
      }
      // A sphere with its centre in the box goes through EPA, which stops within 1e-4 of the depth; around
      // the least depth that leaves the normal an angle of sqrt(2 * 1e-4 / depth). All else is closed form or
      // GJK.
      const Shape& sphere = shapes[0].type == SHAPE_SPHERE ? shapes[0] : shapes[1];
      const bool epa = pair.bucket == BUCKET_SPHERE_BOX && point.getDistance() < -sphere.extents.x;
      const float angle = epa ? std::sqrt(2e-4f / -static_cast<float>(point.getDistance())) : 1e-5f;
      EXPECT_LE(distanceError, epa ? 1e-4f : 1e-5f) << "bucket " << pair.bucket;
      EXPECT_LE(nearest, angle) << "bucket " << pair.bucket;
      EXPECT_LE((toBullet(raw.normal) - point.m_normalWorldOnB).length(), angle) << "bucket " << pair.bucket;
    }
  }
  for (const uint bucket : {BUCKET_SPHERE_SPHERE, BUCKET_SPHERE_BOX, BUCKET_SPHERE_PLANE, BUCKET_BOX_PLANE}) {
    EXPECT_GT(compared[bucket], 50u) << bucket;
  }
}

}  // namespace
}  // namespace btgpu
