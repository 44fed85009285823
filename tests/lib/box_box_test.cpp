// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Box against box, with Bullet's btBoxBoxDetector as the oracle. Its dBoxBox2 is called as well, which tells
// the axis it chose and can give all contacts instead of four.
#include "kernels/lib/box_box.h"

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>

#include <algorithm>
#include <vector>

#include "tests/lib/bullet_values.h"

// Exported by libBulletCollision, but declared in btBoxBoxDetector.cpp only. Rotations are 3 rows of 4; codes
// are 1-3 for faces of box 1, 4-6 for faces of box 2, 7-15 for edges.
int dBoxBox2(const btVector3& p1, const btScalar* R1, const btVector3& side1, const btVector3& p2, const btScalar* R2,
             const btVector3& side2, btVector3& normal, btScalar* depth, int* returnCode, int maxContacts,
             struct dContactGeom* contact, int skip, btDiscreteCollisionDetectorInterface::Result& output);

namespace btgpu {
namespace {

struct BoxPair {
  float4 a, b;  // half extents
  BodyPose poseA, poseB;

  float4 bFromA() const { return poseB.position - poseA.position; }
  double size() const { return length(toDouble(a)) + length(toDouble(b)); }
};

struct Contact {
  Double3 normalOnB, pointOnB;  // the point relative to A's position
  double distance;
};

class Collector : public btDiscreteCollisionDetectorInterface::Result {
 public:
  explicit Collector(Double3 origin) : m_origin(origin) {}
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normalOnB, const btVector3& point, btScalar depth) override {
    contacts.push_back({toDouble(normalOnB), toDouble(point) - m_origin, depth});
  }
  std::vector<Contact> contacts;

 private:
  Double3 m_origin;
};

struct StockResult {
  int code = -1;   // as SeparatingAxis.code
  Double3 normal;  // from A to B
  double depth = 0;
  std::vector<Contact> contacts;
};

// Everything that stock finds, with up to 8 contacts.
StockResult runStock(const BoxPair& p) {
  const btTransform a = toBullet(p.poseA), b = toBullet(p.poseB);
  btScalar r1[12], r2[12];
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 4; ++k) {
      r1[4 * row + k] = a.getBasis()[row][k];
      r2[4 * row + k] = b.getBasis()[row][k];
    }
  }
  Collector collector(toDouble(p.poseA.position));
  btVector3 normal(0, 0, 0);
  btScalar depth = 0;
  int code = 0;
  const int count = dBoxBox2(a.getOrigin(), r1, toBullet(p.a) * 2, b.getOrigin(), r2, toBullet(p.b) * 2, normal, &depth,
                             &code, 8, nullptr, 0, collector);
  StockResult result;
  if (count == 0) return result;
  result.code = code - 1;
  result.normal = toDouble(normal);
  result.depth = depth;
  result.contacts = collector.contacts;
  return result;
}

SeparatingAxis findAxis(const BoxPair& p) {
  return separatingAxisBoxBox(p.a, matrixFromQuaternion(p.poseA.orientation), p.b,
                              matrixFromQuaternion(p.poseB.orientation), p.bFromA());
}

RawContacts findContacts(const BoxPair& p, const SeparatingAxis& axis) {
  RawContacts raw = noContacts();
  const Matrix3 ra = matrixFromQuaternion(p.poseA.orientation), rb = matrixFromQuaternion(p.poseB.orientation);
  if (axis.code >= 6) {
    collideEdges(p.a, ra, p.b, rb, p.bFromA(), axis, &raw);
  } else if (axis.code >= 0) {
    collideFaces(p.a, ra, p.b, rb, p.bFromA(), axis, &raw);
  }
  return raw;
}

// The 15 axes in double precision.
struct Axes {
  double separation[15];  // along the unit axis; negative: overlap
  double sine[15];        // length of the cross product, 1 for faces
  double largest = -1e30;
};

Axes exactAxes(const BoxPair& p) {
  const DoubleMatrix ra = rotationOf(p.poseA.orientation), rb = rotationOf(p.poseB.orientation);
  const Double3 t = toDouble(p.poseB.position) - toDouble(p.poseA.position);
  const auto reach = [](const DoubleMatrix& r, float4 half, Double3 axis) {
    return std::fabs(dot(r.column(0), axis)) * half.x + std::fabs(dot(r.column(1), axis)) * half.y +
           std::fabs(dot(r.column(2), axis)) * half.z;
  };
  Axes axes;
  for (int code = 0; code < 15; ++code) {
    Double3 axis = code < 3   ? ra.column(code)
                   : code < 6 ? rb.column(code - 3)
                              : cross(ra.column((code - 6) / 3), rb.column((code - 6) % 3));
    axes.sine[code] = length(axis);
    if (axes.sine[code] < 1e-9) {
      axes.separation[code] = -1e30;
      continue;
    }
    axis = axis * (1 / axes.sine[code]);
    axes.separation[code] = std::fabs(dot(t, axis)) - reach(ra, p.a, axis) - reach(rb, p.b, axis);
    axes.largest = std::fmax(axes.largest, axes.separation[code]);
  }
  return axes;
}

// Error of a separation along an axis in float. Both sides compute it from the elements of one relative
// rotation (errors of about 30 roundings, vec_test.cpp) times extents and distance, and both add EDGE_SLACK =
// 1e-5 to the elements of edge axes; all of it is divided by the sine of the edges' angle.
double separationTolerance(const BoxPair& p, const Axes& axes, int code) {
  const double scale = p.size() + length(toDouble(p.bFromA())) + 1;
  return 30 * kRounding * scale / std::fmax(axes.sine[code], 1e-6);
}
// How far the slack pushes an edge axis' separation down, at most.
double slackOf(const BoxPair& p, const Axes& axes, int code) {
  return code < 6 ? 0 : 2 * EDGE_SLACK * p.size() / std::fmax(axes.sine[code], 1e-6);
}

// A tie: the two boxes touch within the error of some axis, so that either answer is right.
bool overlapTies(const BoxPair& p, const Axes& axes) {
  // Some axis separates beyond doubt: no tie. Else a tie if some axis may or may not.
  bool doubtful = false;
  for (int code = 0; code < 15; ++code) {
    const double error = separationTolerance(p, axes, code), slack = slackOf(p, axes, code);
    if (axes.separation[code] > error + slack) return false;
    doubtful |= axes.separation[code] > -error;
  }
  return doubtful;
}

// A tie of the choice: faces are compared as they are, an edge wins if it is better than 1.05 times what it
// is compared with, so two axes are interchangeable if their separations, so weighted, are equal within their
// errors. The comparisons run along a chain, each link of which may be a tie, so any other axis near the
// winner counts.
bool choiceTies(const BoxPair& p, const Axes& axes, int first, int second) {
  const auto weight = [](int code) { return code < 6 ? 1.0 : double{EDGE_PENALTY}; };
  const double error = separationTolerance(p, axes, first) + separationTolerance(p, axes, second) +
                       slackOf(p, axes, first) + slackOf(p, axes, second);
  const double s1 = axes.separation[first], s2 = axes.separation[second];
  // Edge against edge is weighted on one side only, and which side depends on what came before.
  for (const double w1 : {1.0, weight(first)}) {
    for (const double w2 : {1.0, weight(second)}) {
      if (std::fabs(s1 * w1 - s2 * w2) <= 2 * error) return true;
    }
  }
  return false;
}

struct Counts {
  int pairs = 0, overlaps = 0, faces = 0, edges = 0, overlapTies = 0, choiceTies = 0, contactsCompared = 0;
};

// From a point to the nearest of a set.
double nearestDistance(Double3 point, const std::vector<Contact>& contacts) {
  double nearest = 1e30;
  for (const Contact& c : contacts) nearest = std::fmin(nearest, length(c.pointOnB - point));
  return nearest;
}

std::vector<Contact> asContacts(const RawContacts& raw) {
  std::vector<Contact> contacts;
  for (int i = 0; i < raw.count; ++i)
    contacts.push_back({toDouble(raw.normal), toDouble(raw.points[i]), raw.points[i].w});
  return contacts;
}

// All corners of the clipped face are found by both. A corner is the meeting point of an edge of the incident
// face and a side of the reference face: its error is that of the lines over the sine of their angle.
void expectSameCorners(const BoxPair& p, const StockResult& stock, const RawContacts& raw, Counts* counts) {
  const DoubleMatrix ra = rotationOf(p.poseA.orientation), rb = rotationOf(p.poseB.orientation);
  const Double3 n = stock.normal;
  double sine = 1;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      // Edges as seen along the normal; those along it do not show.
      const Double3 u = ra.column(i) - n * dot(ra.column(i), n), v = rb.column(j) - n * dot(rb.column(j), n);
      if (length(u) < 0.1 || length(v) < 0.1) continue;
      const double s = length(cross(u, v)) / (length(u) * length(v));
      if (s > 1e-6) sine = std::fmin(sine, s);  // parallel lines do not meet at all
    }
  }
  if (sine < 0.01) return;  // nearly parallel lines cross anywhere
  ++counts->contactsCompared;
  const double tolerance = 100 * kRounding * (p.size() + 1 + length(toDouble(p.poseA.position))) / sine;
  const auto own = asContacts(raw);
  // Corners just on the face's plane may be kept by one side only.
  for (const Contact& c : stock.contacts) {
    if (c.distance < -tolerance) { EXPECT_LT(nearestDistance(c.pointOnB, own), tolerance) << "a corner is missing"; }
  }
  for (const Contact& c : own) {
    EXPECT_LE(c.distance, 0) << "above the face";
    if (c.distance < -tolerance) {
      EXPECT_LT(nearestDistance(c.pointOnB, stock.contacts), tolerance) << "a corner too many";
    }
  }
}

void expectSameContacts(const BoxPair& p, const Axes& axes, const StockResult& stock, const SeparatingAxis& axis,
                        Counts* counts) {
  const RawContacts raw = findContacts(p, axis);
  ASSERT_LE(raw.count, RAW_POINTS);
  const double tolerance = separationTolerance(p, axes, axis.code);
  expectNear(raw.normal, -stock.normal, 60 * kRounding / axes.sine[axis.code]);
  if (axis.code < 6) {
    expectSameCorners(p, stock, raw, counts);
    return;
  }
  ASSERT_EQ(raw.count, 1);
  ASSERT_EQ(stock.contacts.size(), 1u);
  EXPECT_NEAR(raw.points[0].w, stock.contacts[0].distance, tolerance);
  // Below a squared sine of 1e-4 both give up to find the nearest point (dLineClosestApproach), each in its
  // own way.
  const double sineSqr = axes.sine[axis.code] * axes.sine[axis.code];
  if (sineSqr < 1.1e-4) return;
  ++counts->contactsCompared;
  expectNear(raw.points[0], stock.contacts[0].pointOnB,
             60 * kRounding * (p.size() + length(toDouble(p.poseA.position)) + 1) / sineSqr);
}

void compare(const BoxPair& p, Counts* counts) {
  const StockResult stock = runStock(p);
  const SeparatingAxis axis = findAxis(p);
  const Axes axes = exactAxes(p);
  ++counts->pairs;
  if ((axis.code < 0) != (stock.code < 0)) {
    EXPECT_TRUE(overlapTies(p, axes)) << "overlap decided differently: " << axis.code << " against " << stock.code
                                      << ", largest separation " << axes.largest;
    ++counts->overlapTies;
    return;
  }
  if (axis.code < 0) return;
  ++counts->overlaps;
  if (axis.code != stock.code) {
    EXPECT_TRUE(choiceTies(p, axes, axis.code, stock.code))
        << "axis " << axis.code << " (" << axes.separation[axis.code] << ") against " << stock.code << " ("
        << axes.separation[stock.code] << ")";
    ++counts->choiceTies;
    return;
  }
  (axis.code < 6 ? counts->faces : counts->edges) += 1;
  EXPECT_NEAR(axis.normal.w, stock.depth, separationTolerance(p, axes, axis.code));
  const double exact = -axes.separation[axis.code];
  EXPECT_NEAR(axis.normal.w, exact, separationTolerance(p, axes, axis.code) + slackOf(p, axes, axis.code));
  expectNear(axis.normal, stock.normal, 60 * kRounding / axes.sine[axis.code]);
  expectSameContacts(p, axes, stock, axis, counts);
}

float4 randomHalf(Random& random) {
  return F4(random.uniform(0.1f, 2), random.uniform(0.1f, 2), random.uniform(0.1f, 2), 0);
}

// B lies so that the boxes overlap more or less, in any direction from A.
BodyPose near(const BodyPose& a, float4 halfA, float4 halfB, float4 orientation, Random& random) {
  const float reach = 0.6f * (length3(halfA) + length3(halfB));
  return {a.position + random.direction() * (reach * random.uniform(0, 1)), orientation};
}

TEST(BoxBox, RandomPairs) {
  Random random(1);
  Counts counts;
  for (int n = 0; n < 30000; ++n) {
    BoxPair p;
    p.a = randomHalf(random);
    p.b = randomHalf(random);
    p.poseA = random.pose(3);
    p.poseB = near(p.poseA, p.a, p.b, random.rotation(), random);
    compare(p, &counts);
  }
  EXPECT_GT(counts.overlaps, 15000);
  EXPECT_LT(counts.overlaps, 29000);
  EXPECT_GT(counts.faces, 10000);
  EXPECT_GT(counts.edges, 1500);
  EXPECT_LE(counts.overlapTies, 2);
  EXPECT_LE(counts.choiceTies, 2);
  EXPECT_GT(counts.contactsCompared, 10000);
}

// Shallow contacts, as in a stack that rests: separated or overlapping by up to 1 % along the best face axis.
TEST(BoxBox, ShallowContacts) {
  Random random(2);
  Counts counts;
  for (int n = 0; n < 10000; ++n) {
    BoxPair p;
    p.a = randomHalf(random);
    p.b = randomHalf(random);
    p.poseA = random.pose(3);
    p.poseB = {p.poseA.position + random.direction() * 8.0f, random.rotation()};
    const Axes axes = exactAxes(p);
    // Moving B along the line of centres by the largest separation over the cosine would need the axis; a few
    // secant steps of plain bisection do.
    float lower = 0, upper = 1;
    for (int k = 0; k < 24; ++k) {
      const float mid = 0.5f * (lower + upper);
      BoxPair q = p;
      q.poseB.position = p.poseA.position + p.bFromA() * mid;
      (exactAxes(q).largest > 0 ? upper : lower) = mid;
    }
    p.poseB.position = p.poseA.position + p.bFromA() * (lower * random.uniform(0.98f, 1.005f));
    compare(p, &counts);
    EXPECT_GT(axes.largest, 0);
  }
  EXPECT_GT(counts.overlaps, 6000);
  EXPECT_LT(counts.overlaps, 9500);
  EXPECT_GT(counts.edges, 1000);
  EXPECT_LE(counts.overlapTies, 2);
  EXPECT_LE(counts.choiceTies, 2);
  EXPECT_GT(counts.contactsCompared, 7000);
}

// Rotations that make axes coincide: none, multiples of 90 degrees, and turns about one axis (parallel
// edges). Many axes are then the same, so that the choice ties often; depth and overlap must agree all the
// same.
void compareTurned(Random& random, const std::vector<float4>& turns, bool parallel, Counts* counts) {
  for (int n = 0; n < 4000; ++n) {
    BoxPair p;
    p.a = randomHalf(random);
    p.b = randomHalf(random);
    p.poseA = random.pose(3);
    if (turns.size() == 1) p.poseA.orientation = F4(0, 0, 0, 1);
    const float4 turn = turns[random.below(static_cast<int>(turns.size()))];
    p.poseB = near(p.poseA, p.a, p.b, quaternionProduct(p.poseA.orientation, turn), random);
    compare(p, counts);
    const SeparatingAxis axis = findAxis(p);
    const StockResult stock = runStock(p);
    if (axis.code < 0 || stock.code < 0) continue;
    const Axes axes = exactAxes(p);
    const double error = separationTolerance(p, axes, axis.code) + slackOf(p, axes, axis.code) +
                         separationTolerance(p, axes, stock.code) + slackOf(p, axes, stock.code);
    EXPECT_NEAR(axis.normal.w, stock.depth, error);
    if (parallel) expectNear(axis.normal, stock.normal, 60 * kRounding);
  }
}

constexpr float kHalfSqrt2 = 0.70710678f;

TEST(BoxBox, Aligned) {
  Random random(3);
  Counts counts;
  compareTurned(random, {F4(0, 0, 0, 1)}, true, &counts);
  EXPECT_GT(counts.overlaps, 2000);
  EXPECT_EQ(counts.overlapTies, 0);
  EXPECT_EQ(counts.edges, 0) << "parallel edges span no axis";
  EXPECT_EQ(counts.choiceTies, 0) << "both compute the same numbers";
  EXPECT_EQ(counts.contactsCompared, counts.overlaps);
}

TEST(BoxBox, RightAngles) {
  Random random(4);
  Counts counts;
  const std::vector<float4> turns = {F4(0, 0, 0, 1),
                                     F4(1, 0, 0, 0),
                                     F4(kHalfSqrt2, 0, 0, kHalfSqrt2),
                                     F4(0, kHalfSqrt2, 0, kHalfSqrt2),
                                     F4(0, 0, kHalfSqrt2, -kHalfSqrt2),
                                     F4(0.5f, 0.5f, 0.5f, 0.5f)};
  compareTurned(random, turns, true, &counts);
  EXPECT_GT(counts.overlaps, 2000);
  EXPECT_LE(counts.overlapTies, 2);
  EXPECT_LT(counts.choiceTies, counts.overlaps / 3) << "a face of A or the one of B parallel to it";
  EXPECT_GT(counts.contactsCompared, 2000);
}

TEST(BoxBox, ParallelEdges) {
  Random random(5);
  Counts counts;
  std::vector<float4> turns;
  for (int n = 0; n < 60; ++n) {
    const float half = random.uniform(-1.5f, 1.5f);
    const float4 axis = unitVector(n % 3) * std::sin(half);
    turns.push_back(withW(axis, std::cos(half)));
  }
  compareTurned(random, turns, true, &counts);
  EXPECT_GT(counts.overlaps, 2000);
  EXPECT_LE(counts.overlapTies, 2);
  EXPECT_LT(counts.choiceTies, counts.overlaps / 6);
  EXPECT_GT(counts.contactsCompared, 2500);
}

// Turned by hardly anything: where the slack of edge axes matters.
TEST(BoxBox, NearlyAligned) {
  Random random(6);
  Counts counts;
  std::vector<float4> turns;
  for (int n = 0; n < 200; ++n) turns.push_back(withW(random.direction() * random.magnitude(-8, -2), 1));
  compareTurned(random, turns, false, &counts);
  EXPECT_GT(counts.overlaps, 2000);
  EXPECT_LE(counts.overlapTies, 2);
  EXPECT_LT(counts.choiceTies, counts.overlaps / 10);
  EXPECT_GT(counts.contactsCompared, 800);
}

TEST(BoxBox, TinyAgainstHuge) {
  Random random(7);
  Counts counts;
  for (int n = 0; n < 5000; ++n) {
    BoxPair p;
    p.a = randomHalf(random) * 0.02f;
    p.b = randomHalf(random) * 50.0f;
    p.poseA = random.pose(3);
    p.poseB.orientation = random.rotation();
    // The tiny box lies somewhere near the surface of the huge one.
    float4 local = scale3(random.vector(1), p.b);
    const int face = random.below(3);
    const float4 outward = unitVector(face) * (random.coin() ? 1.0f : -1.0f);
    local = local - unitVector(face) * component(local, face) +
            outward * (component(p.b, face) + random.uniform(-0.05f, 0.05f));
    p.poseB.position = p.poseA.position - rotate(p.poseB.orientation, local);
    if (n % 2) {
      std::swap(p.a, p.b);
      std::swap(p.poseA, p.poseB);
    }
    compare(p, &counts);
  }
  EXPECT_GT(counts.overlaps, 2000);
  EXPECT_GT(counts.faces, 1500);
  EXPECT_LE(counts.overlapTies, 2);
  EXPECT_LE(counts.choiceTies, 2);
  EXPECT_GT(counts.contactsCompared, 3000);
}

// ---- cases made by hand

BoxPair unitBoxes(float4 bPosition, float4 bOrientation) {
  BoxPair p;
  p.a = p.b = F4(1, 1, 1, 0);
  p.poseA = {F4(0, 0, 0, 0), F4(0, 0, 0, 1)};
  p.poseB = {bPosition, bOrientation};
  return p;
}

TEST(BoxBox, StackedOnAFace) {
  const BoxPair p = unitBoxes(F4(0, 1.99f, 0, 0), F4(0, 0, 0, 1));
  const SeparatingAxis axis = findAxis(p);
  EXPECT_EQ(axis.code, 1);
  EXPECT_NEAR(axis.normal.w, 0.01, 4 * kRounding);
  expectNear(axis.normal, Double3{0, 1, 0}, 0);
  const RawContacts raw = findContacts(p, axis);
  ASSERT_EQ(raw.count, 4);
  expectNear(raw.normal, Double3{0, -1, 0}, 0);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(raw.points[i].w, -0.01, 4 * kRounding);
    EXPECT_NEAR(std::fabs(raw.points[i].x), 1, 4 * kRounding);
    EXPECT_NEAR(raw.points[i].y, 0.99, 4 * kRounding);
    EXPECT_NEAR(std::fabs(raw.points[i].z), 1, 4 * kRounding);
  }
}

// A face turned by 45 degrees on another: an octagon, as many corners as there is room for.
TEST(BoxBox, Octagon) {
  const float half = 0.39269908f;  // pi / 8
  const BoxPair p = unitBoxes(F4(0, 1.99f, 0, 0), F4(0, std::sin(half), 0, std::cos(half)));
  const RawContacts raw = findContacts(p, findAxis(p));
  EXPECT_EQ(raw.count, 8);
  for (int i = 0; i < raw.count; ++i) {
    const double x = std::fabs(raw.points[i].x), z = std::fabs(raw.points[i].z);
    EXPECT_NEAR(std::fmax(x, z), 1, 1e-6);
    EXPECT_NEAR(std::fmin(x, z), std::sqrt(2.0) - 1, 1e-6);
  }
}

TEST(BoxBox, TouchingExactly) {
  const BoxPair p = unitBoxes(F4(2, 0, 0, 0), F4(0, 0, 0, 1));
  const SeparatingAxis axis = findAxis(p);
  EXPECT_EQ(axis.code, 0);
  EXPECT_EQ(axis.normal.w, 0);
  EXPECT_EQ(runStock(p).code, 0);
  EXPECT_EQ(findAxis(unitBoxes(F4(2.000001f, 0, 0, 0), F4(0, 0, 0, 1))).code, -1);
}

// One box exactly inside its twin: no direction is better than another, but there must be one.
TEST(BoxBox, SamePose) {
  const BoxPair p = unitBoxes(F4(0, 0, 0, 0), F4(0, 0, 0, 1));
  const SeparatingAxis axis = findAxis(p);
  const StockResult stock = runStock(p);
  EXPECT_EQ(axis.code, stock.code);
  EXPECT_NEAR(axis.normal.w, 2, 1e-6);
  expectNear(axis.normal, stock.normal, 0);
  EXPECT_EQ(findContacts(p, axis).count, static_cast<int>(stock.contacts.size()));
}

// Two edges crossed at right angles, one on top of the other.
TEST(BoxBox, CrossedEdges) {
  BoxPair p = unitBoxes(F4(0, 2 * 1.41421356f - 0.01f, 0, 0), F4(0, 0, 0, 1));
  p.poseA.orientation = F4(0, 0, std::sin(0.39269908f), std::cos(0.39269908f));  // edge along z on top
  p.poseB.orientation = F4(std::sin(0.39269908f), 0, 0, std::cos(0.39269908f));  // edge along x below
  const SeparatingAxis axis = findAxis(p);
  EXPECT_EQ(axis.code, 6 + 3 * 2 + 0);
  EXPECT_EQ(runStock(p).code, axis.code);
  expectNear(axis.normal, Double3{0, 1, 0}, 1e-6);
  const RawContacts raw = findContacts(p, axis);
  ASSERT_EQ(raw.count, 1);
  expectNear(raw.points[0], Double3{0, std::sqrt(2.0) - 0.01, 0}, 1e-6);
  EXPECT_NEAR(raw.points[0].w, -0.01, 6e-5);  // the slack of 1e-5 an axis and box deepens it
}

// btBoxBoxDetector itself, as the narrowphase calls it: at most four contacts, among ours.
TEST(BoxBox, DetectorGivesASubset) {
  Random random(8);
  int compared = 0;
  for (int n = 0; n < 3000; ++n) {
    BoxPair p;
    p.a = randomHalf(random);
    p.b = randomHalf(random);
    p.poseA = random.pose(3);
    p.poseB = near(p.poseA, p.a, p.b, random.rotation(), random);
    const SeparatingAxis axis = findAxis(p);
    const StockResult all = runStock(p);
    if (axis.code < 0 || axis.code > 5 || axis.code != all.code) continue;
    btBoxShape boxA(toBullet(p.a)), boxB(toBullet(p.b));
    btBoxBoxDetector detector(&boxA, &boxB);
    Collector collector(toDouble(p.poseA.position));
    btDiscreteCollisionDetectorInterface::ClosestPointInput input;
    input.m_transformA = toBullet(p.poseA);
    input.m_transformB = toBullet(p.poseB);
    detector.getClosestPoints(input, collector, nullptr);
    const auto own = asContacts(findContacts(p, axis));
    ASSERT_FALSE(collector.contacts.empty());
    double deepest = 0, ownDeepest = 0;
    for (const Contact& c : collector.contacts) deepest = std::fmin(deepest, c.distance);
    for (const Contact& c : own) ownDeepest = std::fmin(ownDeepest, c.distance);
    ++compared;
    EXPECT_NEAR(ownDeepest, deepest, 1e-5 * p.size());
  }
  EXPECT_GT(compared, 1500);
}

}  // namespace
}  // namespace btgpu
