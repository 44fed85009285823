// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Each pair of primitives against the algorithm that stock Bullet runs for it.
#include "kernels/lib/collide.h"

#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <array>

#include "tests/lib/stock_pair.h"

namespace btgpu {
namespace {

constexpr float kRange = 4;  // positions are within this of the origin, sizes up to 2

// Bullet works in world coordinates and keeps local anchors: a world point goes through an inverse transform
// and a transform, each a matrix with errors of 20 roundings (vec_test.cpp) times a vector of up to 2 kRange
// + 4, and sums of positions: below 50 roundings of 3 * kRange.
constexpr double kTolerance = 50 * kRounding * 3 * kRange;

void expectContact(const RawContacts& raw, int index, const StockContact& stock, double tolerance,
                   double normalTolerance) {
  expectNear(raw.normal, stock.normalOnB, normalTolerance);
  expectNear(raw.points[index], stock.pointOnB, tolerance);
  EXPECT_NEAR(raw.points[index].w, stock.distance, tolerance);
}

TEST(Collide, NoContacts) {
  const RawContacts raw = noContacts();
  EXPECT_EQ(raw.count, 0);
  EXPECT_NEAR(length3(raw.normal), 1, 1e-6);
}

TEST(Collide, SphereSphere) {
  Random random(1);
  int touching = 0, apart = 0;
  for (int n = 0; n < 4000; ++n) {
    const float radiusA = random.uniform(0.1f, 2), radiusB = random.uniform(0.1f, 2);
    const BodyPose a = random.pose(kRange);
    BodyPose b = random.pose(kRange);
    if (n % 2) b.position = a.position + random.direction() * ((radiusA + radiusB) * random.uniform(0.9f, 1.1f));
    btSphereShape shapeA(radiusA), shapeB(radiusB);
    const auto stock = StockPair(shapeA, shapeB).collide(a, b);

    const float4 bFromA = b.position - a.position;
    const double gap = length(toDouble(bFromA)) - radiusA - radiusB;
    if (std::fabs(gap) < kTolerance) continue;  // a tie
    RawContacts raw = noContacts();
    collideSphereSphere(radiusA, radiusB, bFromA, &raw);
    ASSERT_EQ(raw.count, static_cast<int>(stock.size()));
    if (raw.count == 0) {
      ++apart;
      continue;
    }
    ++touching;
    // The normal is a difference of positions over its length.
    expectContact(raw, 0, stock[0], kTolerance, kTolerance / length(toDouble(bFromA)));
  }
  EXPECT_GT(touching, 1000);
  EXPECT_GT(apart, 1000);
}

TEST(Collide, SphereSphereExactly) {
  RawContacts raw = noContacts();
  collideSphereSphere(1, 2, F4(0, 3, 0, 0), &raw);  // touching
  ASSERT_EQ(raw.count, 1);
  EXPECT_EQ(raw.points[0].w, 0);
  expectNear(raw.normal, Double3{0, -1, 0}, 0);
  expectNear(raw.points[0], Double3{0, 1, 0}, 0);

  raw = noContacts();
  collideSphereSphere(1, 2, F4(0, 0, 0, 0), &raw);  // one centre: some normal, and the full depth
  ASSERT_EQ(raw.count, 1);
  EXPECT_EQ(raw.points[0].w, -3);
  expectNear(raw.normal, Double3{1, 0, 0}, 0);

  raw = noContacts();
  collideSphereSphere(1, 2, F4(0, 3.0001f, 0, 0), &raw);
  EXPECT_EQ(raw.count, 0);
}

// A plane with a pose of its own, and its constant in world axes from the body's position.
struct Plane {
  BodyPose pose;
  float4 local;

  explicit Plane(Random& random) : pose(random.pose(kRange)), local(withW(random.direction(), random.uniform(-2, 2))) {}
  float4 inWorld() const { return withW(rotate(pose.orientation, local), local.w); }
  Double3 normal() const { return turned(pose.orientation, toDouble(local)); }
  double distanceOf(Double3 point) const { return dot(point - toDouble(pose.position), normal()) - local.w; }
  btStaticPlaneShape stock() const { return btStaticPlaneShape(toBullet(local), local.w); }
};

TEST(Collide, SpherePlane) {
  Random random(2);
  int touching = 0, near = 0, apart = 0;
  for (int n = 0; n < 4000; ++n) {
    const float radius = random.uniform(0.1f, 2);
    const Plane plane(random);
    BodyPose a = random.pose(kRange);
    if (n % 2) {  // within a few breaking thresholds
      const double wanted = radius + random.uniform(-0.1f, 0.1f);
      const Double3 shift = plane.normal() * (wanted - plane.distanceOf(toDouble(a.position)));
      a.position = a.position + vec3(float(shift.x), float(shift.y), float(shift.z));
    }
    btSphereShape sphere(radius);
    btStaticPlaneShape stockPlane = plane.stock();
    StockPair pair(sphere, stockPlane);
    const auto stock = pair.collide(a, plane.pose);
    const float threshold = pair.breakingThreshold() != 0 ? pair.breakingThreshold() : 0.02f;

    const double gap = plane.distanceOf(toDouble(a.position)) - radius;
    const double tolerance = kTolerance * 3;  // after the shift positions are up to 3 kRange from the origin
    if (std::fabs(gap - threshold) < tolerance) continue;
    RawContacts raw = noContacts();
    collideSpherePlane(radius, plane.inWorld(), plane.pose.position - a.position, threshold, &raw);
    ASSERT_EQ(raw.count, static_cast<int>(stock.size())) << gap;
    if (raw.count == 0) {
      ++apart;
      continue;
    }
    (gap > 0 ? near : touching) += 1;
    EXPECT_NEAR(raw.points[0].w, gap, tolerance);
    expectContact(raw, 0, stock[0], tolerance, 45 * kRounding);
  }
  EXPECT_GT(touching, 1000);
  EXPECT_GT(near, 50);
  EXPECT_GT(apart, 500);
}

// Stock finds one corner a step, the deepest; here all corners below the threshold are found at once.
TEST(Collide, BoxPlane) {
  Random random(3);
  int compared = 0, ties = 0;
  for (int n = 0; n < 4000; ++n) {
    const float4 half = F4(random.uniform(0.1f, 2), random.uniform(0.1f, 2), random.uniform(0.1f, 2), 0);
    const Plane plane(random);
    const BodyPose a = random.pose(kRange);
    btBoxShape box(toBullet(half));
    btStaticPlaneShape stockPlane = plane.stock();
    StockPair pair(box, stockPlane);
    const auto stock = pair.collide(a, plane.pose);
    const float threshold = pair.breakingThreshold() != 0 ? pair.breakingThreshold() : 0.02f;

    RawContacts raw = noContacts();
    collideBoxPlane(half, matrixFromQuaternion(a.orientation), plane.inWorld(), plane.pose.position - a.position,
                    threshold, &raw);
    // All corners in double precision.
    int expected = 0;
    bool border = false;
    double deepest = 1e9, second = 1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const Double3 local = {corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y,
                             corner & 4 ? half.z : -half.z};
      const double gap = plane.distanceOf(toDouble(a.position) + turned(a.orientation, local));
      border |= std::fabs(gap - threshold) < kTolerance;
      expected += gap < threshold;
      second = std::fmin(second, std::fmax(gap, deepest));
      deepest = std::fmin(deepest, gap);
    }
    if (border) continue;
    ASSERT_EQ(raw.count, expected);
    ASSERT_EQ(stock.size(), expected ? 1u : 0u);
    if (!expected) continue;
    int lowest = 0;
    for (int i = 0; i < raw.count; ++i) {
      if (raw.points[i].w < raw.points[lowest].w) lowest = i;
      // The point lies on the plane, below or above a corner.
      EXPECT_NEAR(plane.distanceOf(toDouble(raw.points[i]) + toDouble(a.position)), 0, kTolerance);
    }
    EXPECT_NEAR(raw.points[lowest].w, stock[0].distance, kTolerance);
    if (second - deepest < 2 * kTolerance) {
      ++ties;  // two corners are equally deep: either may be Bullet's
      continue;
    }
    ++compared;
    expectContact(raw, lowest, stock[0], kTolerance, 45 * kRounding);
  }
  EXPECT_GT(compared, 1500);
  EXPECT_LT(ties, 40);
}

// A thin box deep in the plane: all eight corners, no more than there is room for.
TEST(Collide, ThinBoxPlane) {
  RawContacts raw = noContacts();
  const Matrix3 identity = matrixFromQuaternion(F4(0, 0, 0, 1));
  collideBoxPlane(F4(1, 0.001f, 1, 0), identity, F4(0, 1, 0, 0), F4(0, 0.5f, 0, 0), 0.02f, &raw);
  EXPECT_EQ(raw.count, 8);
  EXPECT_LE(raw.count, RAW_POINTS);
}

Shape sphereShape(float radius) {
  Shape s{};
  s.type = SHAPE_SPHERE;
  s.margin = radius;
  s.extents = F4(radius, 0, 0, 0);
  return s;
}
Shape boxShape(float4 half, float margin) {
  Shape s{};
  s.type = SHAPE_BOX;
  s.margin = margin;
  s.extents = half;
  return s;
}

struct SphereBoxCase {
  BodyPose box;
  float4 half, centreLocal;  // of the sphere, box axes
  float radius;
};

// Stock runs GJK on the box's core (the box shrunk by its margin) and the sphere's centre. GJK stops when the
// squared distance is within REL_ERROR2 = 1e-6 of its bound (btGjkPairDetector): the distance d of centre and
// core is good to 1e-6 d, the vector from one to the other to 1e-3 d, hence the normal to 1e-3 and the point,
// which is moved out along the normal by B's margin, to 1e-3 (d + margin). Where the centre is within
// gGjkEpaPenetrationTolerance = 0.001 of the core or inside, EPA takes over. It stops when the depth is good
// to 1e-4 (EPA_ACCURACY): the normal may then be tilted by 1e-4 over the distance from the foot of the centre
// to the border of the face, and the sphere's points that support the face may lie below its lowest one by
// 1e-4, hence sideways by sqrt(2 * 1e-4 * radius).
enum class Zone { Outside, Border, Inside };

Zone zoneOf(const SphereBoxCase& c, float margin, double* coreDistance) {
  const float4 core = c.half - vec3(margin, margin, margin);
  const float4 excess = fmax(abs3(c.centreLocal) - core, vec3(0, 0, 0));
  *coreDistance = length(toDouble(excess));
  if (*coreDistance > 0.002) return Zone::Outside;
  const float4 gap = core - abs3(c.centreLocal);
  const float inside = std::fmin(gap.x, std::fmin(gap.y, gap.z));
  return inside > 0.002f ? Zone::Inside : Zone::Border;
}

// Distances from the centre to the faces on its side, ascending.
std::array<float, 3> faceGaps(const SphereBoxCase& c) {
  const float4 gap = c.half - abs3(c.centreLocal);
  std::array<float, 3> gaps = {gap.x, gap.y, gap.z};
  std::sort(gaps.begin(), gaps.end());
  return gaps;
}

// Two faces are as near as one another, on two axes or on either side of one: either may be the way out.
bool facesTie(const SphereBoxCase& c) {
  const float4 gap = c.half - abs3(c.centreLocal), opposite = c.half + abs3(c.centreLocal);
  std::array<float, 6> gaps = {gap.x, gap.y, gap.z, opposite.x, opposite.y, opposite.z};
  std::sort(gaps.begin(), gaps.end());
  return gaps[1] - gaps[0] < 1e-3f;
}

class SphereBox : public ::testing::TestWithParam<bool> {
 protected:
  // Runs one case with the sphere as A or as B; returns whether there was a contact.
  static bool expectAsStock(const SphereBoxCase& c, bool sphereIsA, Zone* zone) {
    btBoxShape box(toBullet(c.half));
    btSphereShape sphere(c.radius);
    const Double3 offset = turned(c.box.orientation, toDouble(c.centreLocal));
    const BodyPose spherePose = {c.box.position + vec3(float(offset.x), float(offset.y), float(offset.z)),
                                 F4(0, 0, 0, 1)};
    StockPair pair(sphereIsA ? static_cast<btCollisionShape&>(sphere) : box,
                   sphereIsA ? static_cast<btCollisionShape&>(box) : sphere);
    const BodyPose a = sphereIsA ? spherePose : c.box, b = sphereIsA ? c.box : spherePose;
    const auto stock = pair.collide(a, b);
    const float threshold = pair.breakingThreshold() != 0 ? pair.breakingThreshold() : 0.02f;

    double coreDistance;
    *zone = zoneOf(c, box.getMargin(), &coreDistance);
    if (*zone == Zone::Border || (*zone == Zone::Inside && facesTie(c))) {
      *zone = Zone::Border;
      return false;
    }
    RawContacts raw = noContacts();
    collideSphereBox(sphereIsA, sphereShape(c.radius), boxShape(c.half, box.getMargin()),
                     matrixFromQuaternion(c.box.orientation), b.position - a.position, threshold, &raw);
    const bool outside = *zone == Zone::Outside;
    const double distanceTolerance = kTolerance + (outside ? 1e-6 * coreDistance : 2e-4);
    const double gap = coreDistance - box.getMargin() - c.radius;
    if (outside && std::fabs(gap - threshold) < distanceTolerance) {
      *zone = Zone::Border;
      return false;
    }
    EXPECT_EQ(raw.count, static_cast<int>(stock.size())) << gap;
    if (raw.count != 1 || stock.size() != 1) return false;
    double normalTolerance = 1e-3;
    double pointTolerance = kTolerance + 1e-3 * (coreDistance + (sphereIsA ? box.getMargin() : c.radius));
    if (!outside) {
      // Ours is exact. Now and then EPA stops short of its accuracy: then stock's contact is not the measure.
      const double exact = -double(faceGaps(c)[0]) - double(c.radius);
      EXPECT_NEAR(raw.points[0].w, exact, kTolerance);
      if (std::fabs(double(stock[0].distance) - exact) > 1e-4) {
        *zone = Zone::Border;
        return false;
      }
      normalTolerance = 2 * 1e-4 / faceGaps(c)[1];  // both sides of the face may be low
      pointTolerance = kTolerance + std::sqrt(2 * 1e-4 * c.radius) + normalTolerance * (c.radius + 1);
    }
    expectContact(raw, 0, stock[0], pointTolerance, normalTolerance);
    EXPECT_NEAR(raw.points[0].w, stock[0].distance, distanceTolerance);
    return true;
  }

  static SphereBoxCase randomCase(Random& random) {
    SphereBoxCase c;
    c.box = random.pose(kRange);
    c.half = F4(random.uniform(0.2f, 2), random.uniform(0.2f, 2), random.uniform(0.2f, 2), 0);
    c.radius = random.uniform(0.1f, 1.5f);
    return c;
  }
};

// Centres all around the surface, up to a few thresholds beyond contact.
TEST_P(SphereBox, Outside) {
  Random random(4);
  int contacts = 0, ties = 0;
  for (int n = 0; n < 4000; ++n) {
    SphereBoxCase c = randomCase(random);
    const float4 surface = fmin(fmax(random.vector(3), -c.half), c.half);
    c.centreLocal = surface + random.direction() * (c.radius * random.uniform(0, 1.1f));
    Zone zone;
    contacts += expectAsStock(c, GetParam(), &zone);
    ties += zone == Zone::Border;
  }
  EXPECT_GT(contacts, 2000);
  EXPECT_LT(ties, 100);
}

TEST_P(SphereBox, CentreInside) {
  Random random(5);
  int contacts = 0, ties = 0;
  for (int n = 0; n < 2000; ++n) {
    SphereBoxCase c = randomCase(random);
    c.centreLocal = scale3(random.vector(0.95f), c.half - vec3(0.04f, 0.04f, 0.04f));
    Zone zone;
    contacts += expectAsStock(c, GetParam(), &zone);
    ties += zone == Zone::Border;
  }
  EXPECT_GT(contacts, 1800);
  EXPECT_LT(ties, 200);
}

INSTANTIATE_TEST_SUITE_P(Order, SphereBox, ::testing::Values(true, false),
                         [](const auto& order) { return order.param ? "SphereIsA" : "BoxIsA"; });

TEST(Collide, NearestFace) {
  float4 normal;
  EXPECT_FLOAT_EQ(nearestFace(F4(0.5f, 0, 0, 0), F4(1, 2, 3, 0), &normal), 0.5f);
  expectNear(normal, Double3{1, 0, 0}, 0);
  EXPECT_FLOAT_EQ(nearestFace(F4(0, -1.75f, 0, 0), F4(1, 2, 3, 0), &normal), 0.25f);
  expectNear(normal, Double3{0, -1, 0}, 0);
  EXPECT_FLOAT_EQ(nearestFace(F4(0, 0, 2.875f, 0), F4(1, 2, 3, 0), &normal), 0.125f);
  expectNear(normal, Double3{0, 0, 1}, 0);
}

// A sphere with its centre in the very middle of a box leaves by some nearest face, with a finite normal.
TEST(Collide, SphereInTheMiddleOfABox) {
  RawContacts raw = noContacts();
  collideSphereBox(1, sphereShape(0.5f), boxShape(F4(2, 1, 3, 0), 0.04f), matrixFromQuaternion(F4(0, 0, 0, 1)),
                   F4(0, 0, 0, 0), 0.02f, &raw);
  ASSERT_EQ(raw.count, 1);
  EXPECT_FLOAT_EQ(raw.points[0].w, -1.5f);
  EXPECT_EQ(std::fabs(raw.normal.y), 1);
}

}  // namespace
}  // namespace btgpu
