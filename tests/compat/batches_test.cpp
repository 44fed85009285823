// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batches of closest points, held against Bullet's own GJK.
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>

#include <cstdlib>
#include <limits>

#include "tests/support/shape_yard.h"

namespace btgpu::test {
namespace {

struct Heap {
  explicit Heap(const btGpuSettings& settings = onDevice()) : w(settings) {
    w.world.setGravity(btVector3(0, 0, 0));
    for (int i = 0; i < 60; ++i) w.objects.add(1, shape(i % 4), random.pose(random.vector(3.5)));
  }
  btCollisionShape* shape(int kind) {
    if (kind == 0) return w.objects.sphere(random.uniform(0.3, 1));
    if (kind == 1) return w.objects.box({random.uniform(0.2, 1), random.uniform(0.2, 1), random.uniform(0.2, 1)});
    if (kind == 2) return w.objects.capsule(random.uniform(0.2, 0.6), random.uniform(0.3, 1));
    std::vector<btVector3> points;
    for (int i = 0; i < 20; ++i) points.push_back(random.vector(1));
    return w.objects.hull(points);
  }
  const std::vector<btRigidBody*>& bodies() const { return w.objects.bodies(); }

  GpuWorld w;
  Random random;
};

// Bullet's own closest points of two convex shapes.
btPointCollector bulletClosest(const btCollisionObject& a, const btCollisionObject& b) {
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver depth;
  btGjkPairDetector detector(static_cast<const btConvexShape*>(a.getCollisionShape()),
                             static_cast<const btConvexShape*>(b.getCollisionShape()), &simplex, &depth);
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA = a.getWorldTransform();
  input.m_transformB = b.getWorldTransform();
  btPointCollector out;
  detector.getClosestPoints(input, out, nullptr);
  return out;
}

double sizeOf(const btCollisionObject& object) {
  btVector3 centre;
  btScalar radius;
  object.getCollisionShape()->getBoundingSphere(centre, radius);
  return double(radius);
}

struct Differences {
  int pairs = 0, apart = 0, inside = 0, far = 0, deeper = 0, loose = 0;
};

// Apart: Bullet's GJK ends at a relative accuracy of 1e-6 of the squared distance, so 1e-3 of the distance at most, or
// float's rounding of the poses. Inside: the 1 % of the smaller size; EPA finds a way out, not always the
// shortest, so only being deeper than that counts.
void compare(const btGpuClosestQuery& q, const btGpuClosestPoints& ours, Differences& d) {
  const btPointCollector stock = bulletClosest(*q.m_objectA, *q.m_objectB);
  if (!stock.m_hasResult) return;
  ++d.pairs;
  const double size = std::min(sizeOf(*q.m_objectA), sizeOf(*q.m_objectB));
  const double distance = double(stock.m_distance), off = double(ours.m_distance) - distance;
  ASSERT_TRUE(ours.m_found);
  if (distance > 0) {
    ++d.apart;
    if (std::fabs(off) > 1e-3 * distance + 1e-4) ++d.far;
  } else {
    ++d.inside;
    if (off < -0.01 * size) ++d.deeper;
  }
  // The answer agrees with itself: the points are that far apart along the normal.
  const btVector3 between = ours.m_pointOnA - ours.m_pointOnB;
  const double along = double(between.dot(ours.m_normalOnB));
  if (std::fabs(along - double(ours.m_distance)) > 1e-4 * (1 + std::fabs(distance))) ++d.loose;
}

void expectBulletsClosest(const btGpuSettings& settings, bool device) {
  Heap heap(settings);
  std::vector<btGpuClosestQuery> queries;
  for (size_t a = 0; a < heap.bodies().size(); ++a) {
    for (size_t b = 0; b < heap.bodies().size(); ++b) {
      btGpuClosestQuery q;
      q.m_objectA = heap.bodies()[a];
      q.m_objectB = heap.bodies()[b];
      if (a != b) queries.push_back(q);
    }
  }
  std::vector<btGpuClosestPoints> answers;
  heap.w.world.closestPointsBatch(queries, answers);
  Differences d;
  for (size_t i = 0; i < queries.size(); ++i) compare(queries[i], answers[i], d);
  EXPECT_GT(d.apart, 2000);
  EXPECT_GT(d.inside, 50);
  // One pair in 100: what the matrix of the issue lets through as exceptions.
  EXPECT_LE(d.far, d.apart / 100);
  EXPECT_LE(d.deeper, d.inside / 100 + 1);
  EXPECT_EQ(d.loose, 0);
  EXPECT_EQ(heap.w.world.statistics().m_devicePairs, device ? queries.size() : 0u);
}

TEST(ClosestPoints, AsBulletsOwn) { expectBulletsClosest(onDevice(), true); }
TEST(ClosestPoints, WithoutADevice) {
  btGpuSettings settings;
  settings.m_stockOnly = true;
  expectBulletsClosest(settings, false);
}

// What contactPairTest says: the nearest of all points that the pair's algorithm finds.
struct Nearest : btCollisionWorld::ContactResultCallback {
  Nearest() { m_closestDistanceThreshold = 1000; }
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    if (!found || point.getDistance() < distance) distance = point.getDistance();
    found = true;
    return 0;
  }
  bool found = false;
  btScalar distance = 0;
};

// How far two convex shapes are apart along a unit vector from B to A, by Bullet's own support functions: no more than
// they are.
double apartAlong(const btCollisionObject& a, const btCollisionObject& b, const btVector3& normal) {
  const auto reach = [](const btCollisionObject& object, const btVector3& along) {
    const auto& shape = static_cast<const btConvexShape&>(*object.getCollisionShape());
    const btVector3 local = along * object.getWorldTransform().getBasis();
    const btVector3 point = shape.localGetSupportingVertexWithoutMargin(local) + local * shape.getMargin();
    return double(along.dot(object.getWorldTransform()(point)));
  };
  return -reach(a, -normal) - reach(b, normal);
}

// Curved shapes, points with a margin, and compounds, nested ones too, with each other and planes. Apart, the tolerance
// is as above; inside, ours may be less deep, as the shortest way out is never the longer one, and compounds are as
// deep as their deepest shapes.
TEST(ClosestPoints, OfEveryShape) {
  ShapeYard yard;
  yard.w.objects.add(0, yard.w.objects.plane({0, 1, 0}, -5), {0, 0, 0});
  const int kinds[] = {0, 1, 3, 5, 6, 7, 8, 15, 16, 18, 21, 22, 23, 24, 27};
  for (const int kind : kinds) {
    for (int i = 0; i < 2; ++i) {
      btCollisionShape* shape = yard.shape(kind);
      if (kind == 16) shape->setLocalScaling(btVector3(1, 1, 1));
      yard.add(1, shape, yard.random.vector(2.5));
    }
  }
  std::vector<btGpuClosestQuery> queries;
  for (const btRigidBody* a : yard.w.objects.bodies()) {
    for (const btRigidBody* b : yard.w.objects.bodies()) {
      if (a == b) continue;
      btGpuClosestQuery q;
      q.m_objectA = a;
      q.m_objectB = b;
      queries.push_back(q);
    }
  }
  std::vector<btGpuClosestPoints> answers;
  yard.w.world.closestPointsBatch(queries, answers);
  Differences d;
  for (size_t i = 0; i < queries.size(); ++i) {
    Nearest stock;
    yard.w.world.contactPairTest(const_cast<btCollisionObject*>(queries[i].m_objectA),
                                 const_cast<btCollisionObject*>(queries[i].m_objectB), stock);
    if (!stock.found) continue;
    ++d.pairs;
    ASSERT_TRUE(answers[i].m_found) << i;
    const double distance = double(stock.distance), off = double(answers[i].m_distance) - distance;
    const double size = std::min(sizeOf(*queries[i].m_objectA), sizeOf(*queries[i].m_objectB));
    const bool isApart = distance > 0;
    isApart ? ++d.apart : ++d.inside;
    const auto isConvex = [](const btCollisionObject* o) { return o->getCollisionShape()->isConvex(); };
    // Stock's GJK ends early on curved shapes. Ours are that far apart if they are along our normal, and if our points
    // are, which is looked at below.
    const bool isProven = isConvex(queries[i].m_objectA) && isConvex(queries[i].m_objectB) &&
                          apartAlong(*queries[i].m_objectA, *queries[i].m_objectB, answers[i].m_normalOnB) >
                              double(answers[i].m_distance) - 1e-3 * distance - 1e-4;
    if (isApart ? std::fabs(off) > 1e-3 * distance + 1e-4 && !isProven : off < -0.01 * size) {
      isApart ? ++d.far : ++d.deeper;
      if (std::getenv("BTGPU_TEST_VERBOSE")) {
        printf("%s and %s: ours %f, stock's %f\n", queries[i].m_objectA->getCollisionShape()->getName(),
               queries[i].m_objectB->getCollisionShape()->getName(), double(answers[i].m_distance), distance);
      }
    }
    const btVector3 between = answers[i].m_pointOnA - answers[i].m_pointOnB;
    const double along = double(between.dot(answers[i].m_normalOnB));
    if (std::fabs(along - double(answers[i].m_distance)) > 1e-4 * (1 + std::fabs(distance))) ++d.loose;
  }
  printf("%d pairs, %d apart, %d inside, %d far, %d deeper, %d loose\n", d.pairs, d.apart, d.inside, d.far, d.deeper,
         d.loose);
  EXPECT_GT(d.apart, 300);
  EXPECT_GT(d.inside, 50);
  EXPECT_LE(d.far, d.apart / 100);
  EXPECT_LE(d.deeper, d.inside / 100 + 1);
  EXPECT_EQ(d.loose, 0);
  EXPECT_EQ(yard.w.world.statistics().m_devicePairs, queries.size()) << reportText(yard.w.world);
}

TEST(ClosestPoints, OfKnownPairs) {
  GpuWorld w(onDevice());
  btRigidBody* left = w.objects.add(1, w.objects.sphere(1), {0, 0, 0});
  btRigidBody* right = w.objects.add(1, w.objects.sphere(s(0.5)), {4, 0, 0});
  btRigidBody* box = w.objects.add(1, w.objects.box({1, 1, 1}), {0, 5, 0});
  btRigidBody* plane = w.objects.add(0, w.objects.plane({0, 1, 0}, -3), {0, 0, 0});
  btRigidBody* plane2 = w.objects.add(0, w.objects.plane({1, 0, 0}, -30), {0, 0, 0});
  struct Own : btCylinderShape {
    using btCylinderShape::btCylinderShape;
  };
  Own cylinder(btVector3(s(0.5), s(0.5), s(0.5)));
  btRigidBody* other = w.objects.add(1, &cylinder, {0, 0, 5});
  struct Case {
    const btCollisionObject *a, *b;
    btVector3 point;
    double radius, limit, distance;
    btVector3 normal, onB;
  };
  const btVector3 none(0, 0, 0);
  const std::vector<Case> cases = {
      {left, right, none, 0, 1e18, 2.5, {-1, 0, 0}, {s(3.5), 0, 0}},
      {right, left, none, 0, 1e18, 2.5, {1, 0, 0}, {1, 0, 0}},
      {left, right, none, 0, 2.6, 2.5, {-1, 0, 0}, {s(3.5), 0, 0}},
      {left, right, none, 0, 2.4, -1, none, none},  // too far: distance < 0 stands for not found, where onB is 0
      {left, nullptr, {0, 3, 0}, 0, 1e18, 2, {0, -1, 0}, {0, 3, 0}},
      {left, nullptr, {0, 3, 0}, 0.5, 1e18, 1.5, {0, -1, 0}, {0, s(2.5), 0}},
      {box, nullptr, {0, s(5.9), 0}, 0, 1e18, -0.1, {0, -1, 0}, {0, s(5.9), 0}},
      {box, nullptr, {s(1.7), 5, 0}, 0.2, 1e18, 0.5, {-1, 0, 0}, {s(1.5), 5, 0}},
      {left, plane, none, 0, 1e18, 2, {0, 1, 0}, {0, -3, 0}},
      {plane, left, none, 0, 1e18, 2, {0, -1, 0}, {0, -1, 0}},
      {plane, nullptr, {2, -4, 2}, 0.5, 1e18, -1.5, {0, -1, 0}, {2, s(-4.5), 2}},
      {left, other, none, 0, 1e18, 3.5, {0, 0, -1}, {0, 0, s(4.5)}},
  };
  std::vector<btGpuClosestQuery> queries;
  for (const Case& c : cases) {
    btGpuClosestQuery q;
    q.m_objectA = c.a;
    q.m_objectB = c.b;
    q.m_point = c.point;
    q.m_radius = s(c.radius);
    q.m_maxDistance = s(c.limit);
    queries.push_back(q);
  }
  std::vector<btGpuClosestPoints> answers;
  w.world.closestPointsBatch(queries, answers);
  for (size_t i = 0; i < cases.size(); ++i) {
    const bool found = cases[i].normal.length2() > 0;
    EXPECT_EQ(answers[i].m_found, found) << "case " << i;
    if (!found || !answers[i].m_found) continue;
    // Floats, and for the cylinder Bullet's GJK.
    EXPECT_NEAR(double(answers[i].m_distance), cases[i].distance, 2e-4) << "case " << i;
    EXPECT_LT(length(answers[i].m_normalOnB - cases[i].normal), 2e-3) << "case " << i;
    EXPECT_LT(length(answers[i].m_pointOnB - cases[i].onB), 5e-3) << "case " << i;
  }
  EXPECT_EQ(w.world.statistics().m_hostPairs, 1u) << "that of the application's own class";
  EXPECT_EQ(reported(w.world, "closest points").m_count, 1u) << reportText(w.world);

  const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
  queries.assign(6, btGpuClosestQuery());
  queries[1].m_objectA = queries[1].m_objectB = left;
  queries[2].m_objectA = left;
  queries[2].m_point.setX(nan);
  queries[3].m_objectA = left;
  queries[3].m_radius = -1;
  queries[4].m_objectA = left;
  queries[4].m_maxDistance = nan;
  queries[5].m_objectA = plane;
  queries[5].m_objectB = plane2;
  w.world.closestPointsBatch(queries, answers);
  for (size_t i = 0; i < queries.size(); ++i) {
    EXPECT_FALSE(answers[i].m_found) << "query " << i << " makes no sense";
    EXPECT_EQ(answers[i].m_distance, btScalar(BT_LARGE_FLOAT)) << i;
  }
}

}  // namespace
}  // namespace btgpu::test
