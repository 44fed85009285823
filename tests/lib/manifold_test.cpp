// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kernels/lib/manifold.h"

#include <set>
#include <tuple>
#include <vector>

#include "tests/lib/bullet_values.h"

namespace btgpu {
namespace {

// ---- reduction

std::tuple<float, float, float, float> asTuple(float4 p) { return {p.x, p.y, p.z, p.w}; }

RawContacts rawOf(float4 normal, const std::vector<float4>& points) {
  RawContacts raw{};
  raw.normal = normal;
  raw.count = static_cast<int>(points.size());
  for (size_t i = 0; i < points.size(); ++i) raw.points[i] = points[i];
  return raw;
}

TEST(ReduceContacts, UpToFourAreLeftAlone) {
  Random random(1);
  for (int count = 0; count <= MANIFOLD_POINTS; ++count) {
    std::vector<float4> points;
    for (int i = 0; i < count; ++i) points.push_back(withW(random.vector(1), random.uniform(-1, 0)));
    RawContacts raw = rawOf(F4(0, 1, 0, 0), points);
    reduceContacts(&raw);
    ASSERT_EQ(raw.count, count);
    for (int i = 0; i < count; ++i) EXPECT_EQ(asTuple(raw.points[i]), asTuple(points[i]));
  }
}

// The deepest is kept, none is made up and none is kept twice.
TEST(ReduceContacts, KeepsTheDeepest) {
  Random random(2);
  for (int n = 0; n < 5000; ++n) {
    const int count = 5 + random.below(RAW_POINTS - 4);
    std::vector<float4> points;
    std::set<std::tuple<float, float, float, float>> all;
    float depth = 1;
    for (int i = 0; i < count; ++i) {
      points.push_back(F4(random.uniform(-1, 1), 0, random.uniform(-1, 1), random.uniform(-1, 0)));
      all.insert(asTuple(points.back()));
      depth = std::fmin(depth, points.back().w);
    }
    RawContacts raw = rawOf(F4(0, 1, 0, 0), points);
    reduceContacts(&raw);
    ASSERT_GE(raw.count, 2);
    ASSERT_LE(raw.count, MANIFOLD_POINTS);
    EXPECT_EQ(raw.points[0].w, depth);
    std::set<std::tuple<float, float, float, float>> kept;
    for (int i = 0; i < raw.count; ++i) {
      EXPECT_EQ(all.count(asTuple(raw.points[i])), 1u);
      kept.insert(asTuple(raw.points[i]));
    }
    EXPECT_EQ(kept.size(), static_cast<size_t>(raw.count));
  }
}

// The second is the one farthest from the deepest; the others span the largest triangle with these two, one
// on either side. All distances and areas in double precision; ties do not occur with these seeds.
TEST(ReduceContacts, SpansTheLargestArea) {
  Random random(3);
  int four = 0;
  for (int n = 0; n < 5000; ++n) {
    const float4 normal = random.direction();
    float4 u, v;
    planeSpace(normal, &u, &v);
    std::vector<float4> points;
    for (int i = 0; i < RAW_POINTS; ++i) {
      points.push_back(withW(u * random.uniform(-1, 1) + v * random.uniform(-1, 1), random.uniform(-1, 0)));
    }
    RawContacts raw = rawOf(normal, points);
    reduceContacts(&raw);
    const Double3 p0 = toDouble(raw.points[0]), p1 = toDouble(raw.points[1]);
    double left = 0, right = 0;
    for (const float4& p : points) {
      EXPECT_LE(length(toDouble(p) - p0), length(p1 - p0) * (1 + 4 * kRounding));
      const double area = dot(cross(toDouble(normal), p1 - p0), toDouble(p) - p0);
      left = std::fmax(left, area);
      right = std::fmin(right, area);
    }
    double keptLeft = 0, keptRight = 0;
    for (int i = 2; i < raw.count; ++i) {
      const double area = dot(cross(toDouble(normal), p1 - p0), toDouble(raw.points[i]) - p0);
      keptLeft = std::fmax(keptLeft, area);
      keptRight = std::fmin(keptRight, area);
    }
    const double tolerance = 20 * kRounding * 4;
    EXPECT_NEAR(keptLeft, left, tolerance);
    EXPECT_NEAR(keptRight, right, tolerance);
    four += raw.count == 4;
  }
  EXPECT_GT(four, 3000);
}

TEST(ReduceContacts, Octagon) {
  std::vector<float4> points;
  for (int i = 0; i < 8; ++i) {
    points.push_back(F4(std::cos(i * 0.78539816f), 0, std::sin(i * 0.78539816f), i == 3 ? -0.2f : -0.1f));
  }
  RawContacts raw = rawOf(F4(0, 1, 0, 0), points);
  reduceContacts(&raw);
  ASSERT_EQ(raw.count, 4);
  EXPECT_EQ(asTuple(raw.points[0]), asTuple(points[3]));
  EXPECT_EQ(asTuple(raw.points[1]), asTuple(points[7])) << "opposite";
  const std::set<std::tuple<float, float, float, float>> sides = {asTuple(raw.points[2]), asTuple(raw.points[3])};
  EXPECT_EQ(sides, (std::set<std::tuple<float, float, float, float>>{asTuple(points[1]), asTuple(points[5])}));
}

TEST(ReduceContacts, PointsOnALine) {
  std::vector<float4> points;
  for (int i = 0; i < 6; ++i) points.push_back(F4(float(i), 0, 0, i == 2 ? -1.0f : -0.5f));
  RawContacts raw = rawOf(F4(0, 1, 0, 0), points);
  reduceContacts(&raw);
  ASSERT_EQ(raw.count, 2);
  EXPECT_EQ(raw.points[0].x, 2);
  EXPECT_EQ(raw.points[1].x, 5);
}

// ---- a new point

TEST(Manifold, CombinesMaterialsAsStock) {
  Random random(4);
  const auto material = [&] {
    BodyMaterial m{};
    m.friction = random.uniform(-1, 5);
    m.rollingFriction = random.uniform(-1, 3);
    m.spinningFriction = random.uniform(-1, 3);
    m.restitution = random.uniform(0, 1);
    return m;
  };
  const auto apply = [](const BodyMaterial& m, btCollisionObject& object) {
    object.setFriction(m.friction);
    object.setRollingFriction(m.rollingFriction);
    object.setSpinningFriction(m.spinningFriction);
    object.setRestitution(m.restitution);
  };
  int clamped = 0;
  for (int n = 0; n < 2000; ++n) {
    const BodyMaterial a = material(), b = material();
    btCollisionObject objectA, objectB;
    apply(a, objectA);
    apply(b, objectB);
    const float4 combined = combineMaterials(a, b);
    EXPECT_EQ(combined.x, btManifoldResult::calculateCombinedFriction(&objectA, &objectB));
    EXPECT_EQ(combined.y, btManifoldResult::calculateCombinedRestitution(&objectA, &objectB));
    EXPECT_EQ(combined.z, btManifoldResult::calculateCombinedRollingFriction(&objectA, &objectB));
    EXPECT_EQ(combined.w, btManifoldResult::calculateCombinedSpinningFriction(&objectA, &objectB));
    clamped += combined.x == MAX_FRICTION || combined.z == MAX_FRICTION;
  }
  EXPECT_GT(clamped, 50);
}

struct Poses {
  BodyPose a, b;

  Matrix3 ra() const { return matrixFromQuaternion(a.orientation); }
  Matrix3 rb() const { return matrixFromQuaternion(b.orientation); }
  float4 bFromA() const { return b.position - a.position; }
};

// btManifoldResult::addContactPoint goes through world coordinates: 20 roundings of the rotation and a few of
// the positions, all within 5.
TEST(Manifold, MakePointAsStock) {
  Random random(5);
  for (int n = 0; n < 2000; ++n) {
    const Poses poses = {random.pose(2), random.pose(2)};
    const float4 normal = random.direction();
    const float4 point = withW(random.vector(2), random.uniform(-0.5f, 0.02f));
    const ContactPoint p = makePoint(normal, point, poses.ra(), poses.rb(), poses.bFromA());
    const btVector3 onB = toBullet(poses.a.position) + toBullet(point);
    const btVector3 onA = onB + toBullet(normal) * point.w;
    const double tolerance = 40 * kRounding * 5;
    expectNear(p.localPointA, toBullet(poses.a).invXform(onA), tolerance);
    expectNear(p.localPointB, toBullet(poses.b).invXform(onB), tolerance);
    EXPECT_EQ(p.localPointA.w, point.w);
    EXPECT_EQ(p.localPointB.w, 0) << "no impulse yet";
    expectNear(p.normalWorldOnB, toDouble(normal), 0);
    EXPECT_EQ(p.normalWorldOnB.w, 0);
    btVector3 t1, t2;
    btPlaneSpace1(toBullet(normal), t1, t2);
    expectNear(p.lateralFrictionDir1, t1, 10 * kRounding);
    expectNear(p.lateralFrictionDir2, t2, 20 * kRounding);
    EXPECT_EQ(p.lateralFrictionDir1.w, 0);
    EXPECT_EQ(p.lifeTime, 0);
    EXPECT_EQ(p.flags, 0);
  }
}

// ---- the manifold over many steps

constexpr float kThreshold = 0.02f;

// Feeds one and the same sequence of points and poses to a btPersistentManifold and to ours.
class ManifoldPair {
 public:
  ManifoldPair() {
    m_own.breakingThreshold = kThreshold;
    m_stock.setContactBreakingThreshold(kThreshold);
  }

  int count() const { return m_own.pointCount; }
  const ContactPoint& point(int i) const { return m_own.points[i]; }

  // As btManifoldResult::addContactPoint does.
  void add(const ContactPoint& p) {
    addPoint(&m_own, p);
    if (p.localPointA.w > kThreshold) return;
    btManifoldPoint stock(toBullet(p.localPointA), toBullet(p.localPointB), toBullet(p.normalWorldOnB),
                          p.localPointA.w);
    const int match = m_stock.getCacheEntry(stock);
    if (match >= 0) {
      m_stock.replaceContactPoint(stock, match);
    } else {
      m_stock.addManifoldPoint(stock);
    }
  }

  // False if some point is so near a limit that either decision is right: distance and drift come from points
  // up to 4 from the origin, through rotations, in float.
  bool refresh(const Poses& poses) {
    for (int i = 0; i < count(); ++i) {
      const ContactPoint& p = point(i);
      const Double3 between = turned(poses.a.orientation, toDouble(p.localPointA)) + toDouble(poses.a.position) -
                              turned(poses.b.orientation, toDouble(p.localPointB)) - toDouble(poses.b.position);
      const double distance = dot(between, toDouble(p.normalWorldOnB));
      const double drift = length(between - toDouble(p.normalWorldOnB) * distance);
      if (std::fabs(distance - kThreshold) < kTolerance || std::fabs(drift - kThreshold) < 2 * kTolerance) return false;
    }
    m_stock.refreshContactPoints(toBullet(poses.a), toBullet(poses.b));
    refreshPoints(&m_own, poses.ra(), poses.rb(), poses.bFromA());
    return true;
  }

  // What the solver leaves in the points: a number of its own for every impulse.
  void setImpulses() {
    for (int i = 0; i < count(); ++i) {
      btManifoldPoint& stock = m_stock.getContactPoint(i);
      ContactPoint& own = m_own.points[i];
      own.localPointB.w = stock.m_appliedImpulse = ++m_impulse;
      own.normalWorldOnB.w = stock.m_appliedImpulseLateral1 = ++m_impulse;
      own.lateralFrictionDir1.w = stock.m_appliedImpulseLateral2 = ++m_impulse;
    }
  }

  void clear() {
    m_own.pointCount = 0;
    m_stock.clearManifold();
  }

  void expectEqual() const {
    ASSERT_EQ(m_own.pointCount, m_stock.getNumContacts());
    for (int i = 0; i < count(); ++i) {
      const btManifoldPoint& stock = m_stock.getContactPoint(i);
      const ContactPoint& own = point(i);
      expectNear(own.localPointA, stock.m_localPointA, 0);
      expectNear(own.localPointB, stock.m_localPointB, 0);
      expectNear(own.normalWorldOnB, stock.m_normalWorldOnB, 0);
      EXPECT_NEAR(own.localPointA.w, stock.getDistance(), kTolerance);
      EXPECT_EQ(own.localPointB.w, stock.m_appliedImpulse);
      EXPECT_EQ(own.normalWorldOnB.w, stock.m_appliedImpulseLateral1);
      EXPECT_EQ(own.lateralFrictionDir1.w, stock.m_appliedImpulseLateral2);
      EXPECT_EQ(own.lifeTime, stock.getLifeTime());
    }
  }

  static constexpr double kTolerance = 60 * kRounding * 4;

 private:
  Manifold m_own{};
  btPersistentManifold m_stock;
  float m_impulse = 0;
};

// A candidate on the top of A: at a place of its own, or near a point that is there already.
ContactPoint randomCandidate(const ManifoldPair& pair, const Poses& poses, Random& random) {
  float4 local = F4(random.uniform(-1, 1), 0.5f, random.uniform(-1, 1), 0);
  if (pair.count() && random.below(3) != 0) {
    local = pair.point(random.below(pair.count())).localPointA + random.vector(kThreshold);
  }
  const float4 normal = normalize3(rotate(poses.a.orientation, F4(0, -1, 0, 0)) + random.vector(0.1f));
  const float distance = random.uniform(-0.05f, 1.1f * kThreshold);
  const float4 onB = rotate(poses.a.orientation, local) - normal * distance;
  return makePoint(normal, withW(onB, distance), poses.ra(), poses.rb(), poses.bFromA());
}

BodyPose moved(const BodyPose& pose, float by, Random& random) {
  const float4 turn = withW(random.vector(0.5f * by), 1);
  const float4 q = quaternionProduct(turn, pose.orientation);
  const float size = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  return {pose.position + random.vector(by), q / size};
}

TEST(Manifold, FollowsStockStepByStep) {
  Random random(6);
  int steps = 0, restarts = 0, full = 0, dropped = 0, old = 0;
  for (int run = 0; run < 100; ++run) {
    ManifoldPair pair;
    Poses poses = {random.pose(0.5f), random.pose(0.5f)};
    for (int step = 0; step < 100; ++step) {
      const int candidates = random.below(7);
      for (int c = 0; c < candidates; ++c) {
        pair.add(randomCandidate(pair, poses, random));
        pair.expectEqual();
        if (::testing::Test::HasFailure()) return;
      }
      const float motion = kThreshold * (random.below(4) == 0 ? 0.5f : 0.1f);
      poses = {moved(poses.a, motion, random), moved(poses.b, motion, random)};
      const int before = pair.count();
      full += before == MANIFOLD_POINTS;
      if (!pair.refresh(poses)) {
        ++restarts;
        pair.clear();
        continue;
      }
      pair.expectEqual();
      if (::testing::Test::HasFailure()) return;
      dropped += before - pair.count();
      for (int i = 0; i < pair.count(); ++i) old += pair.point(i).lifeTime > 3;
      pair.setImpulses();
      ++steps;
    }
  }
  // The cases that matter did occur, and hardly any step was given up as a tie.
  EXPECT_GT(steps, 9500);
  EXPECT_LT(restarts, 100);
  EXPECT_GT(full, 1000);
  EXPECT_GT(dropped, 1000);
  EXPECT_GT(old, 1000);
}

ContactPoint pointAt(float x, float z, float distance) {
  ContactPoint p{};
  p.localPointA = F4(x, 0, z, distance);
  p.localPointB = F4(x, -distance, z, 0);
  p.normalWorldOnB = F4(0, 1, 0, 0);
  return p;
}

TEST(Manifold, BeyondTheThresholdNothingIsAdded) {
  ManifoldPair pair;
  pair.add(pointAt(0, 0, 1.001f * kThreshold));
  EXPECT_EQ(pair.count(), 0);
  pair.add(pointAt(0, 0, kThreshold));
  EXPECT_EQ(pair.count(), 1);
  pair.expectEqual();
}

// Of several points near enough the nearest is matched; at the threshold itself none is.
TEST(Manifold, MatchesTheNearest) {
  ManifoldPair pair;
  pair.add(pointAt(0, 0, -0.01f));
  pair.add(pointAt(0.03f, 0, -0.01f));
  EXPECT_EQ(pair.count(), 2);
  pair.setImpulses();
  pair.add(pointAt(0.016f, 0, -0.02f));
  EXPECT_EQ(pair.count(), 2);
  EXPECT_EQ(pair.point(1).localPointA.x, 0.016f);
  EXPECT_EQ(pair.point(1).localPointB.w, 4) << "the impulse of the point that was replaced";
  pair.expectEqual();
  ManifoldPair other;
  other.add(pointAt(0, 0, -0.01f));
  other.add(pointAt(kThreshold, 0, -0.01f));
  EXPECT_EQ(other.count(), 2);
  other.expectEqual();
}

// A fifth point takes the place of the one that leaves most area, but never of the deepest.
TEST(Manifold, FifthPointSparesTheDeepest) {
  for (int deepest = 0; deepest < 4; ++deepest) {
    ManifoldPair pair;
    const float corners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (int i = 0; i < 4; ++i) pair.add(pointAt(corners[i][0], corners[i][1], i == deepest ? -0.05f : -0.01f));
    pair.setImpulses();
    // Beside the deepest corner: its loss would leave most area.
    pair.add(pointAt(corners[deepest][0] * 1.1f, corners[deepest][1] * 1.2f, -0.02f));
    pair.expectEqual();
    int kept = 0;
    for (int i = 0; i < 4; ++i) kept += pair.point(i).localPointA.w == -0.05f;
    EXPECT_EQ(kept, 1) << deepest;
  }
}

}  // namespace
}  // namespace btgpu
