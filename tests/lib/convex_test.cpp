// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Closest features and ways out of convex cores against every feature in double precision, and against stock Bullet
// where it reached its own accuracy; the manifold's corners; capsules in closed form; hulls on planes.
#include "gpu_engine/stages/44_find_closest_features_reference.h"
#include "kernels/lib/convex_clip.h"
#include "kernels/lib/convex_sat.h"
#include "kernels/lib/hull_plane.h"
#include "tests/lib/convex_shapes.h"
#include "tests/lib/stock_pair.h"

namespace btgpu {
namespace {

// Of the pair's size: a separation is a difference of coordinates of that size, with some 16 roundings on the way,
// twice over for the closest point of three (1e-6 each); and cores within 1e-5 of touching, edges within 1e-5 of a
// face (CORES_TOUCH, EDGE_BEATS_FACE) are taken for it.
constexpr double kSeparation = 2e-6, kChoice = 1.2e-5;
// EPA_ACCURACY and GJK's own end: stock is no measure where it is farther from the exact distance than this.
constexpr double kStockAccuracy = 1e-4;

struct Placed {
  ConvexPair pair;
  CorePair cores;
  ClosestCores exact;
  BodyPose a, b;
};

Placed place(const ConvexShape& a, const ConvexShape& b, BodyPose poseA, BodyPose poseB) {
  const ConvexPair pair(a, b);
  const float4 d = poseB.position - poseA.position;
  const CorePair cores =
      corePairOf(pair.a, pair.b, matrixFromQuaternion(poseA.orientation), matrixFromQuaternion(poseB.orientation), d);
  const ClosestCores exact = closestCoresReference(
      placed(polytopeOf(pair.a, pair.arrays), reference::rotationOf(poseA.orientation), {}),
      placed(polytopeOf(pair.b, pair.arrays), reference::rotationOf(poseB.orientation), reference::toVec(d)));
  return {pair, cores, exact, poseA, poseB};
}

// As the two kernels of stage 44 do it.
int findFeatures(const Placed& p, float4 start, float limit, ClosestFeatures* found) {
  const int what = closestFeatures(p.cores, p.pair.hulls(), start, limit, found);
  if (what == CORES_NEAR) preferFace(p.cores, p.pair.hulls(), found);
  if (what == CORES_OVERLAP) *found = shortestWayOut(p.cores, p.pair.hulls());
  return what;
}

Double3 toWorld(const Placed& p, float4 v) { return turned(p.a.orientation, toDouble(v)); }

void expectExact(const Placed& p, const ClosestFeatures& found) {
  const double size = p.cores.size, separation = found.normal.w;
  EXPECT_NEAR(length(toDouble(found.normal)), 1, 1e-5);
  EXPECT_LE(std::fabs(separation - p.exact.separation), (p.exact.separation > 0 ? kSeparation : kChoice) * size)
      << "separation " << separation << ", exact " << p.exact.separation;
  // The axis holds what it says, whichever it is.
  const double along =
      separationAlong(placed(polytopeOf(p.pair.a, p.pair.arrays), reference::rotationOf(p.a.orientation), {}),
                      placed(polytopeOf(p.pair.b, p.pair.arrays), reference::rotationOf(p.b.orientation),
                             reference::toVec(p.b.position - p.a.position)),
                      toWorld(p, found.normal));
  // A squared distance that is good to GJK_ACCURACY leaves the axis an angle of sqrt(2 * 1e-7), which lets a vertex as
  // far away as the pair is large come nearer by that much.
  EXPECT_LE(along, separation + 4 * kSeparation * size);
  EXPECT_GE(along, separation - (4 * kSeparation + std::sqrt(2e-7)) * size);
  if (separation > 1e-3 * size) {
    EXPECT_NEAR(length(toDouble(found.onB - found.onA)), separation, 4 * kSeparation * size);
  }
}

enum Kind { Sphere, Box, Capsule, Ball12, Ball32, Prism8, Needle, Sheet, Kinds };

ConvexShape make(Random& random, int kind, float scale) {
  const auto u = [&](float low, float high) { return random.uniform(low, high) * scale; };
  switch (kind) {
    case Sphere:
      return sphereOf(u(0.2f, 1));
    case Box:
      return boxOf({u(0.2f, 1), u(0.2f, 1), u(0.2f, 1), 0});
    case Capsule:
      return capsuleOf(random.below(3), u(0.1f, 0.5f), u(0.1f, 1));
    case Ball12:
      return hullOfPoints(ellipsoidPoints(random, 12, {u(0.3f, 1), u(0.3f, 1), u(0.3f, 1), 0}), 0.04f * scale);
    case Ball32:
      return hullOfPoints(ellipsoidPoints(random, 32, {u(0.3f, 1), u(0.3f, 1), u(0.3f, 1), 0}), 0.04f * scale);
    case Prism8:
      return hullOfPoints(prismPoints(8, u(0.5f, 0.8f), u(0.3f, 0.6f)), 0.04f * scale);
    case Needle:
      return hullOfPoints(ellipsoidPoints(random, 20, float4{1, 0.01f, 0.02f, 0} * scale), 0.04f * scale);
    default:
      return hullOfPoints(ellipsoidPoints(random, 20, float4{1, 0.01f, 1, 0} * scale), 0.04f * scale);
  }
}

// A random pair whose cores are about `gap` apart along a random direction.
Placed placeNear(const ConvexShape& a, const ConvexShape& b, Random& random, double gap) {
  const BodyPose poseA = random.pose(1);
  BodyPose poseB = random.pose(1);
  const float4 direction = random.direction();
  const ConvexPair pair(a, b);
  const double now = separationAlong(
      placed(polytopeOf(pair.a, pair.arrays), reference::rotationOf(poseA.orientation), {}),
      placed(polytopeOf(pair.b, pair.arrays), reference::rotationOf(poseB.orientation), {}), toDouble(direction));
  poseB.position = poseA.position + direction * float(gap - now);
  return place(a, b, poseA, poseB);
}

TEST(Convex, ClosestFeaturesOfAllKinds) {
  Random random(1);
  int apart = 0, overlapping = 0;
  for (int n = 0; n < 2500; ++n) {
    const int kindA = random.below(Kinds), kindB = random.below(Kinds);
    if (kindA <= Capsule && kindB <= Capsule && !(kindA + kindB == Box + Capsule)) continue;
    SCOPED_TRACE(testing::Message() << n << ": " << kindA << ", " << kindB);
    const ConvexShape a = make(random, kindA, 1), b = make(random, kindB, 1);
    const Placed p = placeNear(a, b, random, random.coin() ? random.uniform(-0.3f, 0.1f) : random.uniform(0, 0.1f));
    ClosestFeatures found;
    findFeatures(p, n % 3 ? p.cores.offset : random.direction(), 1e9f, &found);
    expectExact(p, found);
    (p.exact.separation > 0 ? apart : overlapping) += 1;

    StockPair stockPair(*a.bullet, *b.bullet);
    const auto stock = stockPair.collide(p.a, p.b);
    if (stock.size() != 1) continue;
    const double margins = double(p.pair.a.margin) + p.pair.b.margin;
    if (std::fabs(stock[0].distance + margins - p.exact.separation) > kStockAccuracy) continue;
    EXPECT_NEAR(double(found.normal.w) - margins, stock[0].distance, kStockAccuracy + kChoice * p.cores.size);
    if (p.exact.separation > 0.02) {
      // A vector between the cores that is longer by e than the shortest makes an angle of up to sqrt(2 e / d) with
      // it; e is known to some roundings of the pair's size.
      const double excess = std::fabs(stock[0].distance + margins - p.exact.separation) + 2e-6 * p.cores.size;
      expectNear(toWorld(p, found.normal), stock[0].normalOnB * -1, std::sqrt(2 * excess / p.exact.separation));
    }
  }
  EXPECT_GT(apart, 1000);
  EXPECT_GT(overlapping, 200);
}

TEST(Convex, SizesFrom1e2To1e3) {
  Random random(2);
  for (const float scale : {0.01f, 1.0f, 1000.0f}) {
    for (int n = 0; n < 150; ++n) {
      const ConvexShape a = make(random, Ball12 + random.below(5), scale), b = make(random, random.below(Kinds), scale);
      const Placed p = placeNear(a, b, random, scale * random.uniform(-0.2f, 0.1f));
      ClosestFeatures found;
      findFeatures(p, p.cores.offset, INFINITY, &found);
      EXPECT_LE(std::fabs(double(found.normal.w) - p.exact.separation), kChoice * p.cores.size);
    }
  }
  // Small on large: rounding is in proportion to the large one.
  for (int n = 0; n < 100; ++n) {
    const ConvexShape a = hullOfPoints(prismPoints(8, 0.1f, 0.1f)), b = hullOfPoints(prismPoints(8, 100, 50));
    const Placed p = placeNear(a, b, random, random.uniform(0.01f, 0.1f));
    ClosestFeatures found;
    findFeatures(p, p.cores.offset, INFINITY, &found);
    EXPECT_LE(std::fabs(double(found.normal.w) - p.exact.separation), kSeparation * p.cores.size);
  }
}

TEST(Convex, ManyVertices) {
  Random random(3);
  for (int n = 0; n < 8; ++n) {
    const ConvexShape a = hullOfPoints(ellipsoidPoints(random, 100, {1, 0.7f, 0.9f, 0}));
    const ConvexShape b = hullOfPoints(n % 2 ? prismPoints(50, 0.6f, 0.4f) : ellipsoidPoints(random, 4, {1, 1, 1, 0}));
    const Placed p = placeNear(a, b, random, n % 4 < 2 ? 0.05 : -0.1);
    ClosestFeatures found;
    findFeatures(p, p.cores.offset, INFINITY, &found);
    expectExact(p, found);
  }
}

// An octagonal prism's edges are obtuse: regions where the axis of no face is right. The sphere's centre stands over
// each face, edge and vertex in turn.
TEST(Convex, SphereOverEveryRegionOfAPrism) {
  Random random(4);
  const ConvexShape prism = hullOfPoints(prismPoints(8, 1, 0.5f)), sphere = sphereOf(0.3f);
  int regions[4] = {};
  for (int n = 0; n < 3000; ++n) {
    const BodyPose at = random.pose(2);
    // A point of the surface: some vertices of one face, weighted.
    const HullFace& face = prism.arrays.faces[static_cast<size_t>(n) % prism.arrays.faces.size()];
    const int first = random.below(face.cornerCount), corners = 1 + n % 3;
    Double3 foot, outward;
    for (int k = 0; k < corners; ++k) {
      const int step = k == 2 ? face.cornerCount / 2 : k;
      const int c = (first + step) % face.cornerCount;
      foot = foot + toDouble(prism.arrays.vertices[prism.arrays.corners[static_cast<size_t>(face.firstCorner + c)]]) *
                        (corners == 1   ? 1.0
                         : corners == 2 ? 0.5
                                        : (k == 2 ? 0.5 : 0.25));
    }
    // Normals of the faces there, mixed: a normal of the region.
    for (const HullFace& f : prism.arrays.faces) {
      if (std::fabs(dot(toDouble(f.plane), foot) - f.plane.w) < 1e-5) {
        outward = outward + toDouble(f.plane) * random.uniform(0.05f, 1);
      }
    }
    outward = outward / length(outward);
    const double distance = random.uniform(0.02f, 0.35f);
    const Double3 centre = toDouble(at.position) + turned(at.orientation, foot + outward * distance);
    const BodyPose spherePose = {{float(centre.x), float(centre.y), float(centre.z), 0}, {0, 0, 0, 1}};
    const Placed p = place(prism, sphere, at, spherePose);
    ClosestFeatures found;
    ASSERT_EQ(findFeatures(p, p.cores.offset, INFINITY, &found), CORES_NEAR);
    expectExact(p, found);
    EXPECT_NEAR(found.normal.w, distance, 3e-6);
    expectNear(toDouble(found.normal), outward, 1e-4);
    ++regions[corners];
    RawContacts raw = noContacts();
    collideConvex(p.cores, p.pair.hulls(), found, matrixFromQuaternion(at.orientation), 0.02f, &raw);
    const double gap = distance - 0.3 - 0.04;
    ASSERT_EQ(raw.count, gap < 0.02 ? 1 : 0);
    if (raw.count) { EXPECT_NEAR(raw.points[0].w, gap, 3e-6); }
  }
  for (int k = 1; k <= 3; ++k) EXPECT_EQ(regions[k], 1000);
}

// Points, segments and polygons as hulls, one in the other's place.
TEST(Convex, HullsWithoutVolume) {
  Random random(5);
  const ConvexShape shapes[] = {hullOfPoints({{0.1f, 0.2f, 0, 0}}),
                                hullOfPoints({{-1, 0.2f, 0, 0}, {0.7f, 0.1f, 0.3f, 0}}),
                                hullOfPoints({{-1, 0, 0, 0}, {1, 0, 0, 0}, {0, 0, 1, 0}, {0, 0.0f, -1, 0}}),
                                hullOfPoints(prismPoints(5, 0.6f, 0.3f)),
                                boxOf({0.5f, 0.4f, 0.3f, 0}),
                                capsuleOf(0, 0.2f, 0.5f)};
  for (const ConvexShape& a : shapes) {
    for (const ConvexShape& b : shapes) {
      for (int n = 0; n < 40; ++n) {
        SCOPED_TRACE(testing::Message() << &a - shapes << " " << &b - shapes << " " << n);
        const Placed p = placeNear(a, b, random, n % 4 ? random.uniform(0.02f, 0.15f) : -0.05);
        ClosestFeatures found;
        findFeatures(p, p.cores.offset, INFINITY, &found);
        expectExact(p, found);
        RawContacts raw = noContacts();
        collideConvex(p.cores, p.pair.hulls(), found, matrixFromQuaternion(p.a.orientation), 10, &raw);
        ASSERT_GE(raw.count, 1);
        ASSERT_LE(raw.count, 4);
      }
      // In one place and pose: finite, and the way out is no longer than it has to be.
      const Placed p = place(a, b, {{1, 2, 3, 0}, {0, 0, 0, 1}}, {{1, 2, 3, 0}, {0, 0, 0, 1}});
      ClosestFeatures found;
      findFeatures(p, p.cores.offset, INFINITY, &found);
      EXPECT_TRUE(isFinite4(found.normal));
      EXPECT_TRUE(isFinite3(found.onB));
      EXPECT_LE(std::fabs(double(found.normal.w) - p.exact.separation), kChoice * p.cores.size + 1e-6);
    }
  }
}

RawContacts manifoldOf(const Placed& p, float threshold = 0.02f) {
  ClosestFeatures found;
  RawContacts raw = noContacts();
  const float limit = p.pair.a.margin + p.pair.b.margin + threshold;
  if (findFeatures(p, p.cores.offset, limit, &found) == CORES_FAR) return raw;
  collideConvex(p.cores, p.pair.hulls(), found, matrixFromQuaternion(p.a.orientation), threshold, &raw);
  return raw;
}

// Faces with 100 corners on each other: four far corners of the region, all at the same depth; the deepest last.
TEST(Convex, FacesWithManyCorners) {
  const ConvexShape a = hullOfPoints(prismPoints(100, 1, 0.5f)), b = hullOfPoints(prismPoints(100, 0.8f, 0.5f));
  const float4 upright = {0, 0, 0, 1};
  const Placed p = place(a, b, {{0, 0, 0, 0}, upright}, {{0.1f, 1.07f, 0, 0}, upright});
  const RawContacts raw = manifoldOf(p);
  ASSERT_EQ(raw.count, 4);
  Double3 lower = {9, 9, 9}, upper = {-9, -9, -9};
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(raw.points[k].w, -0.01, 1e-6);
    EXPECT_NEAR(raw.points[k].y, 0.53, 1e-6);
    EXPECT_NEAR(std::hypot(raw.points[k].x - 0.1f, raw.points[k].z), 0.8, 1e-5) << "a corner of the smaller face";
    lower = {std::fmin(lower.x, double(raw.points[k].x)), 0, std::fmin(lower.z, double(raw.points[k].z))};
    upper = {std::fmax(upper.x, double(raw.points[k].x)), 0, std::fmax(upper.z, double(raw.points[k].z))};
  }
  // Corners picked on both diagonals of a circle: they span at least its inscribed square's extent.
  EXPECT_GT(upper.x - lower.x, 1.1);
  EXPECT_GT(upper.z - lower.z, 1.1);
  expectNear(raw.normal, Double3{0, -1, 0}, 1e-6);
}

// Tilted: the deepest corner is kept, whatever else is.
TEST(Convex, DeepestCornerOfManyIsKept) {
  Random random(6);
  for (int n = 0; n < 300; ++n) {
    const ConvexShape a = hullOfPoints(prismPoints(3 + random.below(60), 1, 0.5f));
    const ConvexShape b = hullOfPoints(prismPoints(3 + random.below(60), random.uniform(0.2f, 1.5f), 0.5f));
    const float tilt = random.uniform(-0.02f, 0.02f);
    const float4 turn = quaternionProduct(F4(std::sin(tilt / 2), 0, 0, std::cos(tilt / 2)),
                                          F4(0, std::sin(random.uniform(0, 3)), 0, std::cos(random.uniform(0, 3))));
    const Placed p = place(a, b, {{0, 0, 0, 0}, {0, 0, 0, 1}},
                           {{random.uniform(-0.5f, 0.5f), 1 + random.uniform(-0.02f, 0.12f), 0, 0},
                            turn / std::sqrt(dot3(turn, turn) + turn.w * turn.w)});
    const RawContacts raw = manifoldOf(p);
    if (raw.count == 0) continue;
    double deepest = 1;
    for (int k = 0; k < raw.count; ++k) deepest = std::fmin(deepest, double(raw.points[k].w));
    EXPECT_NEAR(deepest, p.exact.separation - 0.08, 2.5e-5 * p.cores.size);
    EXPECT_NEAR(raw.points[raw.count - 1].w, deepest, 2.5e-5 * p.cores.size) << "the deepest comes last";
    for (int k = 0; k < raw.count; ++k) {
      for (int m = 0; m < k; ++m) EXPECT_GT(length3(raw.points[k] - raw.points[m]), 0.02f) << "points that are one";
    }
  }
}

// A capsule on a box rests on both ends; stock finds one of them.
TEST(Convex, CapsuleLyingOnABox) {
  const ConvexShape box = boxOf({2, 0.5f, 2, 0}), capsule = capsuleOf(0, 0.25f, 0.5f);
  const Placed p = place(box, capsule, {{0, 0, 0, 0}, {0, 0, 0, 1}}, {{0.2f, 0.745f, 0.3f, 0}, {0, 0, 0, 1}});
  const RawContacts raw = manifoldOf(p);
  ASSERT_EQ(raw.count, 2);
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(raw.points[k].w, -0.005, 1e-6);
    EXPECT_NEAR(raw.points[k].y, 0.495, 1e-6);
    EXPECT_NEAR(std::fabs(raw.points[k].x - 0.2f), 0.5, 1e-6);
  }
}

// Closed form, as in stock: both are float, within 20 roundings of the pair's extent (4), over the sine of the angle
// between the segments for the place of the point.
TEST(Convex, CapsulesAndSpheresAsStock) {
  Random random(7);
  int compared = 0;
  for (int n = 0; n < 3000; ++n) {
    const int axisA = random.below(3), axisB = random.below(3);
    const bool sphereA = n % 3 == 1, sphereB = n % 3 == 2;
    const ConvexShape a = sphereA ? sphereOf(random.uniform(0.1f, 0.5f))
                                  : capsuleOf(axisA, random.uniform(0.1f, 0.5f), random.uniform(0.1f, 1));
    const ConvexShape b = sphereB ? sphereOf(random.uniform(0.1f, 0.5f))
                                  : capsuleOf(axisB, random.uniform(0.1f, 0.5f), random.uniform(0.1f, 1));
    const BodyPose poseA = random.pose(0.6f), poseB = random.pose(0.6f);
    StockPair pair(*a.bullet, *b.bullet);
    const auto stock = pair.collide(poseA, poseB);
    const auto axisOf = [](const BodyPose& pose, bool sphere, int axis) {
      return matrixColumn(matrixFromQuaternion(pose.orientation), sphere ? 1 : axis);
    };
    const float4 u = axisOf(poseA, sphereA, axisA), v = axisOf(poseB, sphereB, axisB);
    const auto lengthOf = [](const ConvexShape& s, bool sphere) {
      return sphere ? 0.0f : s.shape.extents.x + s.shape.extents.y + s.shape.extents.z;
    };
    RawContacts raw = noContacts();
    collideCapsules(u, lengthOf(a, sphereA), a.shape.margin, v, lengthOf(b, sphereB), b.shape.margin,
                    poseB.position - poseA.position, pair.breakingThreshold(), &raw);
    if (stock.empty() != (raw.count == 0)) {
      ADD_FAILURE() << "stock " << stock.size() << ", ours " << raw.count;
      continue;
    }
    if (stock.empty()) continue;
    ++compared;
    const double sine = std::sqrt(1 - double(dot3(u, v)) * dot3(u, v));
    const double tolerance = 20 * kRounding * 4 / (sphereA || sphereB ? 1 : sine * sine);
    EXPECT_NEAR(raw.points[0].w, stock[0].distance, 20 * kRounding * 4 + tolerance * tolerance);
    const double apart = stock[0].distance + double(a.shape.margin) + b.shape.margin;
    if (apart < 1e-3) continue;
    expectNear(raw.normal, stock[0].normalOnB, tolerance / apart);
    expectNear(raw.points[0], stock[0].pointOnB, tolerance * (1 + 0.5 / apart));
  }
  EXPECT_GT(compared, 1000);
}

TEST(Convex, CapsulesInOnePlace) {
  RawContacts raw = noContacts();
  collideCapsules(F4(0, 1, 0, 0), 1, 0.5f, F4(0, 1, 0, 0), 1, 0.25f, F4(0, 0, 0, 0), 0.02f, &raw);
  ASSERT_EQ(raw.count, 1);
  EXPECT_FLOAT_EQ(raw.points[0].w, -0.75f);
  EXPECT_NEAR(raw.normal.y, 0, 1e-6) << "across the capsules, as in btPlaneSpace1";
}

// Stock finds the lowest point a step; ours is among those found at once.
TEST(Convex, CapsulesAndHullsOnPlanesAsStock) {
  Random random(8);
  int compared = 0;
  for (int n = 0; n < 2000; ++n) {
    const bool isCapsule = n % 2;
    const int axis = random.below(3);
    const ConvexShape shape = isCapsule
                                  ? capsuleOf(axis, random.uniform(0.1f, 0.5f), random.uniform(0.005f, 1))
                                  : hullOfPoints(ellipsoidPoints(random, 4 + random.below(60), {1, 0.6f, 0.8f, 0}));
    const float4 local = withW(random.direction(), random.uniform(-1, 1));
    const BodyPose planePose = random.pose(1);
    BodyPose pose = random.pose(2);
    btStaticPlaneShape plane(toBullet(local), local.w);
    StockPair pair(*shape.bullet, plane);
    const auto stock = pair.collide(pose, planePose);
    const float threshold = pair.breakingThreshold();
    const Matrix3 r = matrixFromQuaternion(pose.orientation);
    const float4 inWorld = withW(rotate(planePose.orientation, local), local.w);
    const float4 bFromA = planePose.position - pose.position;
    RawContacts raw = noContacts();
    if (isCapsule) {
      const float4 e = shape.shape.extents;
      collideCapsulePlane(matrixColumn(r, axis), e.x + e.y + e.z, shape.shape.margin, inWorld, bFromA, threshold, &raw);
    } else {
      collideHullPlane(shape.shape, shape.arrays.vertices.data(), r, inWorld, bFromA, threshold, &raw);
    }
    ASSERT_EQ(raw.count > 0, !stock.empty());
    ASSERT_LE(raw.count, 4);
    if (raw.count == 0) continue;
    ++compared;
    double deepest = 1e9;
    for (const StockContact& c : stock) deepest = std::fmin(deepest, c.distance);
    // 50 roundings of coordinates up to 6 (collide_test.cpp); the hull's deepest within its slack of 1e-5.
    const double tolerance = 50 * kRounding * 6 + (isCapsule ? 0 : 3e-5);
    EXPECT_NEAR(raw.points[raw.count - 1].w, deepest, tolerance);
    for (int k = 0; k < raw.count; ++k) {
      EXPECT_GE(raw.points[k].w, deepest - tolerance);
      EXPECT_LT(raw.points[k].w, threshold);
      EXPECT_NEAR(dot3(raw.points[k] - bFromA, inWorld), inWorld.w, 1e-5) << "not on the plane";
    }
  }
  EXPECT_GT(compared, 500);
}

}  // namespace
}  // namespace btgpu
