// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kernels/lib/bounds.h"

#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <limits>

#include "tests/lib/bullet_values.h"

namespace btgpu {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

Shape makeShape(int type, float margin, float4 extents) {
  Shape s{};
  s.type = type;
  s.margin = margin;
  s.extents = extents;
  return s;
}

void expectAabbAsStock(const Shape& shape, const btCollisionShape& stock, const BodyPose& pose, double tolerance) {
  btVector3 lower, upper;
  stock.getAabb(toBullet(pose), lower, upper);
  const Aabb box = shapeAabb(shape, pose, nullptr);
  expectNear(box.lower, lower, tolerance);
  expectNear(box.upper, upper, tolerance);
  EXPECT_EQ(box.lower.w, 0);
  EXPECT_EQ(box.upper.w, 0);
}

TEST(Bounds, SphereAabb) {
  Random random(1);
  for (int n = 0; n < 2000; ++n) {
    const float radius = random.magnitude(-2, 2);
    const BodyPose pose = random.pose(50);
    expectAabbAsStock(makeShape(SHAPE_SPHERE, radius, F4(radius, 0, 0, 0)), btSphereShape(radius), pose, 0);
  }
}

// Bullet keeps the half extents without the margin and adds it again: two roundings of an extent. The
// rotation has errors of 20 roundings (vec_test.cpp), the dot product of 4; the centre is added with one of
// the sum.
TEST(Bounds, BoxAabb) {
  Random random(2);
  for (int n = 0; n < 2000; ++n) {
    const float4 half = F4(random.magnitude(-1, 2), random.magnitude(-1, 2), random.magnitude(-1, 2), 0);
    BodyPose pose = random.pose(50);
    if (n % 10 == 0) pose.orientation = F4(0, 0, 0, 1);
    const btBoxShape stock(toBullet(half));
    const double size = half.x + half.y + half.z;
    expectAabbAsStock(makeShape(SHAPE_BOX, stock.getMargin(), half), stock, pose, kRounding * (26 * size + 51));
  }
}

TEST(Bounds, PlaneAabb) {
  Random random(3);
  for (int n = 0; n < 100; ++n) {
    const float4 normal = random.direction();
    const btStaticPlaneShape stock(toBullet(normal), 3);
    expectAabbAsStock(makeShape(SHAPE_PLANE, 0, withW(normal, 3)), stock, random.pose(50), 0);
  }
  EXPECT_EQ(BTGPU_LARGE, BT_LARGE_FLOAT);
}

Aabb randomAabb(Random& random) {
  // Whole numbers, so that faces often touch.
  const auto whole = [&] { return float(random.below(6)); };
  const float4 lower = F4(whole(), whole(), whole(), 0);
  return {lower, lower + F4(whole(), whole(), whole(), 0)};
}

TEST(Bounds, OverlapAsStock) {
  Random random(4);
  int overlaps = 0, touching = 0;
  for (int n = 0; n < 20000; ++n) {
    const Aabb a = randomAabb(random), b = randomAabb(random);
    const bool stock = TestAabbAgainstAabb2(toBullet(a.lower), toBullet(a.upper), toBullet(b.lower), toBullet(b.upper));
    ASSERT_EQ(overlapAabb(a, b) != 0, stock);
    ASSERT_EQ(overlapAabb(b, a) != 0, stock);
    overlaps += stock;
    touching += stock && (a.upper.x == b.lower.x || a.upper.y == b.lower.y || a.upper.z == b.lower.z);
  }
  EXPECT_GT(overlaps, 2000);
  EXPECT_GT(touching, 500);
}

TEST(Bounds, Merge) {
  Random random(5);
  for (int n = 0; n < 1000; ++n) {
    const Aabb a = randomAabb(random), b = randomAabb(random), m = mergeAabb(a, b);
    btVector3 lower = toBullet(a.lower), upper = toBullet(a.upper);
    lower.setMin(toBullet(b.lower));
    upper.setMax(toBullet(b.upper));
    expectNear(m.lower, lower, 0);
    expectNear(m.upper, upper, 0);
    const Aabb same = mergeAabb(a, emptyAabb());
    expectNear(same.lower, toDouble(a.lower), 0);
    expectNear(same.upper, toDouble(a.upper), 0);
  }
}

TEST(Bounds, EmptyOverlapsNothing) {
  const Aabb all = {F4(-kInfinity, -kInfinity, -kInfinity, 0), F4(kInfinity, kInfinity, kInfinity, 0)};
  const Aabb huge = {F4(-1e18f, -1e18f, -1e18f, 0), F4(1e18f, 1e18f, 1e18f, 0)};
  EXPECT_FALSE(overlapAabb(emptyAabb(), emptyAabb()));
  EXPECT_FALSE(overlapAabb(emptyAabb(), huge));
  EXPECT_FALSE(overlapAabb(huge, emptyAabb()));
  EXPECT_TRUE(overlapAabb(all, huge));
}

// An AABB with NaN, as of a quarantined body, overlaps nothing either.
TEST(Bounds, NanOverlapsNothing) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Aabb huge = {F4(-1e18f, -1e18f, -1e18f, 0), F4(1e18f, 1e18f, 1e18f, 0)};
  const Aabb bad = {F4(nan, nan, nan, 0), F4(nan, nan, nan, 0)};
  EXPECT_FALSE(overlapAabb(bad, huge));
  EXPECT_FALSE(overlapAabb(huge, bad));
  EXPECT_FALSE(overlapAabb(bad, bad));
}

TEST(Bounds, Collidable) {
  BodyInfo info{};
  info.flags = BODY_PRESENT;
  EXPECT_TRUE(isCollidable(info));
  info.shapeIndex = -1;
  EXPECT_FALSE(isCollidable(info));
  info.shapeIndex = 3;
  info.flags = BODY_RIGID;
  EXPECT_FALSE(isCollidable(info));
  info.flags = BODY_PRESENT | BODY_QUARANTINED;
  EXPECT_FALSE(isCollidable(info));
}

TEST(Bounds, FiltersAsStock) {
  btHashedOverlappingPairCache cache;
  Random random(6);
  int matches = 0;
  for (int n = 0; n < 2000; ++n) {
    const auto bits = [&] { return random.below(8) == 0 ? -1 : random.below(16); };
    BodyInfo a{}, b{};
    a.filterGroup = bits();
    a.filterMask = bits();
    b.filterGroup = bits();
    b.filterMask = bits();
    btBroadphaseProxy proxyA, proxyB;
    proxyA.m_collisionFilterGroup = a.filterGroup;
    proxyA.m_collisionFilterMask = a.filterMask;
    proxyB.m_collisionFilterGroup = b.filterGroup;
    proxyB.m_collisionFilterMask = b.filterMask;
    const bool stock = cache.needsBroadphaseCollision(&proxyA, &proxyB);
    EXPECT_EQ(filtersMatch(a, b) != 0, stock);
    matches += stock;
  }
  EXPECT_GT(matches, 200);
  EXPECT_LT(matches, 1800);
}

ulong slowSpread(uint v) {
  ulong spread = 0;
  for (int bit = 0; bit < 16; ++bit) spread |= ulong{v >> bit & 1} << (3 * bit);
  return spread;
}

TEST(Morton, SpreadBits) {
  for (uint v = 0; v < 0x10000; ++v) ASSERT_EQ(spreadBits3(v), slowSpread(v)) << v;
  EXPECT_EQ(spreadBits3(0xabcd1234u), slowSpread(0x1234)) << "only 16 bits count";
}

// The scene is divided into 65536 cells an axis; what is outside belongs to the outermost ones.
TEST(Morton, AxisClamps) {
  EXPECT_EQ(mortonAxis(-5, -5, 0.1f), 0u);
  EXPECT_EQ(mortonAxis(-6, -5, 0.1f), 0u);
  EXPECT_EQ(mortonAxis(-1e30f, -5, 0.1f), 0u);
  EXPECT_EQ(mortonAxis(-kInfinity, -5, 0.1f), 0u);
  EXPECT_EQ(mortonAxis(5, -5, 0.1f), 65535u);
  EXPECT_EQ(mortonAxis(4.9999f, -5, 0.1f), 65535u);
  EXPECT_EQ(mortonAxis(1e30f, -5, 0.1f), 65535u);
  EXPECT_EQ(mortonAxis(kInfinity, -5, 0.1f), 65535u);
  EXPECT_EQ(mortonAxis(0, -5, 0.1f), 32768u);
}

TEST(Morton, AxisKeepsTheOrder) {
  Random random(7);
  for (int n = 0; n < 5000; ++n) {
    const float a = random.uniform(-6, 6), b = random.uniform(-6, 6);
    EXPECT_LE(mortonAxis(std::fmin(a, b), -5, 0.1f), mortonAxis(std::fmax(a, b), -5, 0.1f));
  }
}

// The cell of a point, computed in double precision, unless the point is within rounding of a border between
// cells: the quotient has three roundings of a value up to 65536.
TEST(Morton, CodeInterleavesTheCells) {
  Random random(8);
  const Aabb scene = {F4(-10, 0, 100, 0), F4(30, 1, 108, 0)};
  const Double3 lower = toDouble(scene.lower), extent = toDouble(scene.upper - scene.lower);
  int checked = 0;
  for (int n = 0; n < 5000; ++n) {
    const float4 p = F4(random.uniform(-10, 30), random.uniform(0, 1), random.uniform(100, 108), 0);
    ulong expected = 0;
    bool border = false;
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = (toDouble(p)[axis] - lower[axis]) / extent[axis] * 65536;
      border |= std::fabs(cell - std::round(cell)) < 65536 * 4 * kRounding;
      expected |= slowSpread(static_cast<uint>(cell)) << axis;
    }
    if (border) continue;
    ++checked;
    ASSERT_EQ(mortonCode(p, scene), expected);
  }
  EXPECT_GT(checked, 4000);
  EXPECT_EQ(mortonCode(scene.upper, scene), (ulong{1} << PAIR_SORT_BIT) - 1);
  EXPECT_EQ(mortonCode(scene.lower, scene), 0u);
}

// A scene without extent, as of a single body or of bodies in a plane.
TEST(Morton, FlatScene) {
  const Aabb flat = {F4(-10, 2, 3, 0), F4(30, 2, 3, 0)};
  EXPECT_EQ(mortonCode(F4(30, 2, 3, 0), flat), slowSpread(65535));
  EXPECT_EQ(mortonCode(F4(-10, 2, 3, 0), flat), 0u);
  EXPECT_EQ(mortonCode(F4(-10, 2, 4, 0), flat), 0u) << "off the plane";
  const Aabb point = {F4(1, 2, 3, 0), F4(1, 2, 3, 0)};
  EXPECT_EQ(mortonCode(F4(1, 2, 3, 0), point), 0u);
}

}  // namespace
}  // namespace btgpu
