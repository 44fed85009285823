// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batches of sweeps, held against btCollisionWorld::convexSweepTest of the same world, and against exact answers where
// there are some.
#include <LinearMath/btTransformUtil.h>

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "tests/support/shape_yard.h"

namespace btgpu::test {
namespace {

// Stock's sweeps and ours end at the first of their steps at which they are nearer than this.
constexpr double kNear = 0.001;
// Of a distance: that of GJK's rounding in world coordinates below 64 units, 4 ulp, and as much for its points.
constexpr double kRounding = 8 * 64 * double(FLT_EPSILON);

struct StockSweep : btCollisionWorld::ClosestConvexResultCallback {
  explicit StockSweep(const btGpuSweep& sweep)
      : ClosestConvexResultCallback(sweep.m_from.getOrigin(), sweep.m_to.getOrigin()), ignored(sweep.m_ignoredObject) {
    m_collisionFilterGroup = sweep.m_collisionFilterGroup;
    m_collisionFilterMask = sweep.m_collisionFilterMask;
  }
  bool needsCollision(btBroadphaseProxy* proxy) const override {
    return proxy->m_clientObject != ignored && ClosestConvexResultCallback::needsCollision(proxy);
  }
  const btCollisionObject* ignored;
};

struct Counts {
  int sweeps = 0, hits = 0, others = 0, far = 0, off = 0, turned = 0, apart = 0, stockOff = 0;
};

btVector3 farthest(const btConvexShape& of, const btTransform& at, const btVector3& along) {
  const btVector3 local = along * at.getBasis();
  return at(of.localGetSupportingVertexWithoutMargin(local) + local * of.getMargin());
}

// The convex parts of a shape: for each, how far along a direction it reaches.
template <typename Work>
void forEachPart(const btCollisionShape& shape, const btTransform& at, const Work& work) {
  if (shape.isConvex()) {
    const auto& convex = static_cast<const btConvexShape&>(shape);
    work([&](const btVector3& along) { return double(along.dot(farthest(convex, at, along))); });
  } else if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      forEachPart(*compound.getChildShape(i), at * compound.getChildTransform(i), work);
    }
  } else {
    struct Triangles : btTriangleCallback {
      Triangles(const btTransform& pose, double m, const Work& w) : at(pose), margin(m), work(w) {}
      void processTriangle(btVector3* corners, int, int) override {
        const btVector3 a = at(corners[0]), b = at(corners[1]), c = at(corners[2]);
        work([&](const btVector3& n) {
          return margin + std::max({double(n.dot(a)), double(n.dot(b)), double(n.dot(c))});
        });
      }
      const btTransform& at;
      double margin;
      const Work& work;
    };
    const auto& concave = static_cast<const btConcaveShape&>(shape);
    Triangles triangles(at, double(concave.getMargin()), work);
    const btVector3 large(100, 100, 100);
    concave.processAllTriangles(&triangles, -large, large);
  }
}

// How far the sweep's shape, after a part of its way, and the object are apart at least, by Bullet's own support
// functions: that of each part of the object along the better one of two unit vectors; the part for which that is
// least.
double apart(const btGpuSweep& sweep, btScalar fraction, const btCollisionObject& object, const btVector3& n,
             const btVector3& m) {
  btVector3 linear, angular;
  btTransformUtil::calculateVelocity(sweep.m_from, sweep.m_to, 1, linear, angular);
  btTransform a;
  btTransformUtil::integrateTransform(sweep.m_from, linear, angular, fraction, a);
  const double alongN = double(n.dot(farthest(*sweep.m_shape, a, -n)));
  const double alongM = double(m.dot(farthest(*sweep.m_shape, a, -m)));
  double least = BT_LARGE_FLOAT;
  forEachPart(*object.getCollisionShape(), object.getWorldTransform(),
              [&](const auto& reach) { least = std::min(least, std::max(alongN - reach(n), alongM - reach(m))); });
  return least + double(sweep.m_allowedCcdPenetration);
}

// Of a sweep that ends elsewhere than stock's: true if stock's ends while the two are still farther apart than kNear,
// or goes on though they are not: its GJK ends early on curved shapes (docs/decisions/0022-curved-shapes.md).
bool isStockOff(const btGpuSweep& sweep, const btGpuSweepHit& hit, const StockSweep& stock) {
  const btScalar first = std::min(hit.m_closestHitFraction, stock.m_closestHitFraction);
  const double gap = apart(sweep, first, *hit.m_collisionObject, hit.m_hitNormalWorld, stock.m_hitNormalWorld);
  return hit.m_closestHitFraction < stock.m_closestHitFraction ? gap <= kNear + kRounding : gap > kNear + kRounding;
}

// Of two normals the one along which the two are farther apart is the better one.
bool isNormalBetter(const btGpuSweep& sweep, const btGpuSweepHit& hit, const StockSweep& stock) {
  const auto along = [&](const btVector3& n) {
    return apart(sweep, hit.m_closestHitFraction, *hit.m_collisionObject, n, n);
  };
  return along(hit.m_hitNormalWorld) >= along(stock.m_hitNormalWorld) - kRounding;
}

struct SweepYard : ShapeYard {
  using ShapeYard::ShapeYard;

  btConvexShape* moving(int kind) { return static_cast<btConvexShape*>(shape(kind)); }

  // Through the yard; most do not turn on their way.
  std::vector<btGpuSweep> sweeps(const std::vector<btConvexShape*>& moved, int count) {
    std::vector<btGpuSweep> all(static_cast<size_t>(count));
    const btVector3 middle(8, 4, 8);
    for (size_t i = 0; i < all.size(); ++i) {
      btGpuSweep& sweep = all[i];
      sweep.m_shape = moved[i % moved.size()];
      sweep.m_from = random.pose(middle + random.vector(20));
      sweep.m_to = sweep.m_from;
      sweep.m_to.setOrigin(middle + random.vector(10));
      if (i % 4 == 1)
        sweep.m_to.setRotation(btQuaternion(random.vector(1).normalized(), random.uniform(0, 0.7)) *
                               sweep.m_from.getRotation());
      if (i % 5 == 0) sweep.m_to.setOrigin(sweep.m_from.getOrigin() + btVector3(0, -20, 0));
      if (i % 7 == 0) sweep.m_allowedCcdPenetration = s(0.05);
    }
    return all;
  }

  Counts compare(const std::vector<btGpuSweep>& sweeps) {
    std::vector<btGpuSweepHit> hits;
    w.world.convexSweepBatch(sweeps, hits);
    Counts c;
    for (size_t i = 0; i < sweeps.size(); ++i) {
      const btGpuSweep& sweep = sweeps[i];
      StockSweep stock(sweep);
      w.world.convexSweepTest(sweep.m_shape, sweep.m_from, sweep.m_to, stock, sweep.m_allowedCcdPenetration);
      compareOne(sweep, hits[i], stock, c);
    }
    return c;
  }

  void compareOne(const btGpuSweep& sweep, const btGpuSweepHit& hit, const StockSweep& stock, Counts& c) {
    ++c.sweeps;
    c.hits += stock.hasHit();
    if (hit.m_collisionObject != stock.m_hitCollisionObject) {
      ++c.others;
      if (verbose) {
        printf("  another: ours %d at %.6f, stock's %d at %.6f, allowed %.2f\n",
               hit.hasHit() ? hit.m_collisionObject->getWorldArrayIndex() : -1, double(hit.m_closestHitFraction),
               stock.hasHit() ? stock.m_hitCollisionObject->getWorldArrayIndex() : -1,
               double(stock.m_closestHitFraction), double(sweep.m_allowedCcdPenetration));
      }
      return;
    }
    if (!stock.hasHit()) return;
    const btVector3 along = sweep.m_to.getOrigin() - sweep.m_from.getOrigin();
    const double off = std::fabs(double(hit.m_closestHitFraction - stock.m_closestHitFraction));
    // Both are within kNear of the surface, measured along the normal.
    const double closing = std::fabs(double(along.dot(stock.m_hitNormalWorld)));
    if (off > 1e-4) {
      isStockOff(sweep, hit, stock) ? ++c.stockOff : ++c.far;
      if (off * closing > kNear + 2 * kRounding && !isStockOff(sweep, hit, stock)) ++c.off;
    }
    const double cosine = double(hit.m_hitNormalWorld.dot(stock.m_hitNormalWorld));
    // At the start several triangles or shapes of a compound may be met at once, and any of them counts.
    const bool isOne = hit.m_collisionObject->getCollisionShape()->isConvex() || hit.m_closestHitFraction > 0;
    if (isOne && cosine < 0.999 && !isNormalBetter(sweep, hit, stock)) ++c.turned;
    if (isOne && double((hit.m_hitPointWorld - stock.m_hitPointWorld).dot(stock.m_hitNormalWorld)) > 0.01) ++c.apart;
    if (verbose && (off > 1e-4 || cosine < 0.999)) {
      printf(
          "  object %d (%s by %s): ours %.6f stock's %.6f, closing %.4f, cosine of normals %.6f, allowed %.2f, stock "
          "off %d\n",
          hit.m_collisionObject->getWorldArrayIndex(), hit.m_collisionObject->getCollisionShape()->getName(),
          sweep.m_shape->getName(), double(hit.m_closestHitFraction), double(stock.m_closestHitFraction), closing,
          cosine, double(sweep.m_allowedCcdPenetration), isStockOff(sweep, hit, stock));
    }
  }
  bool verbose = std::getenv("BTGPU_TEST_VERBOSE") != nullptr;

  void expectSame(const std::vector<btGpuSweep>& sweeps, const char* what) {
    const Counts c = compare(sweeps);
    printf("%s: %d sweeps, %d hits, %d other bodies, %d fractions (%d of stock off), %d off, %d normals, %d points\n",
           what, c.sweeps, c.hits, c.others, c.far, c.stockOff, c.off, c.turned, c.apart);
    const int few = std::max(1, c.sweeps / 100);
    EXPECT_GT(c.hits, c.sweeps / 10) << what;
    EXPECT_LE(c.others, few) << what << ": other bodies";
    EXPECT_LE(c.far, few) << what << ": fractions";
    EXPECT_LE(c.off, few) << what << ": farther from the surface than sweeps end";
    EXPECT_LE(c.turned, few) << what << ": normals";
    EXPECT_LE(c.apart, few) << what << ": points";
  }
};

constexpr int kMoving[] = {0, 1, 2, 3, 4, 6, 8, 15, 17, 18, 20, 22};

TEST(Sweeps, ThroughCommonShapes) {
  SweepYard yard;
  yard.fill(100, ShapeYard::kCommon);
  std::vector<btConvexShape*> moved;
  for (const int kind : {0, 1, 2, 3}) moved.push_back(yard.moving(kind));
  yard.expectSame(yard.sweeps(moved, 3000), "before the first step");
  yard.w.run(5);
  yard.expectSame(yard.sweeps(moved, 3000), "after steps");
  EXPECT_EQ(yard.w.world.statistics().m_deviceSweeps, 6000u);
  EXPECT_EQ(yard.w.world.statistics().m_hostSweeps, 0u);
  EXPECT_TRUE(yard.w.world.fallbackReport().empty()) << reportText(yard.w.world);
}

// Each kind of shape that moves, and each kind that is met.
TEST(Sweeps, OfEachKind) {
  for (const int kind : kMoving) {
    SweepYard yard;
    yard.fill(100, ShapeYard::kAll);
    yard.expectSame(yard.sweeps({yard.moving(kind), yard.moving(kind)}, 600),
                    ("moving kind " + std::to_string(kind)).c_str());
  }
}
TEST(Sweeps, AtEachKind) {
  for (int kind = 0; kind < ShapeYard::kAll; ++kind) {
    SweepYard yard;
    for (int i = 0; i < 20; ++i) yard.add(0, yard.shape(kind), btVector3(s(4 * (i % 5)), s(2), s(4 * (i / 5))));
    const std::vector<btConvexShape*> moved = {yard.moving(0), yard.moving(1), yard.moving(3), yard.moving(6)};
    yard.expectSame(yard.sweeps(moved, 600), ("at kind " + std::to_string(kind)).c_str());
  }
}

// A ball on its way meets another one where a quadratic equation says, less what it ends before the surface.
TEST(Sweeps, OfBallsAtBallsAreExact) {
  GpuWorld w(onDevice());
  Random random;
  for (int i = 0; i < 30; ++i) { w.objects.add(1, w.objects.sphere(random.uniform(0.3, 1.5)), random.vector(8)); }
  btSphereShape ball(s(0.4));
  std::vector<btGpuSweep> sweeps(500);
  for (btGpuSweep& sweep : sweeps) {
    sweep.m_shape = &ball;
    sweep.m_from.setOrigin(random.vector(1).normalized() * s(16));
    sweep.m_to.setOrigin(random.vector(8));
  }
  std::vector<btGpuSweepHit> hits;
  w.world.convexSweepBatch(sweeps, hits);
  int found = 0, grazing = 0;
  for (size_t i = 0; i < sweeps.size(); ++i) {
    const btVector3 from = sweeps[i].m_from.getOrigin(), along = sweeps[i].m_to.getOrigin() - from;
    double first = 2;
    const btCollisionObject* object = nullptr;
    for (const btRigidBody* body : w.objects.bodies()) {
      const double radius =
          double(static_cast<const btSphereShape*>(body->getCollisionShape())->getRadius()) + 0.4 + kNear;
      const btVector3 apart = from - body->getWorldTransform().getOrigin();
      const double a = double(along.length2()), b = double(apart.dot(along)),
                   c = double(apart.length2()) - radius * radius;
      if (b * b < a * c || b > 0) continue;
      const double fraction = (-b - std::sqrt(b * b - a * c)) / a;
      if (fraction > 1 || fraction > first) continue;
      first = fraction;
      object = body;
    }
    // A sweep that only comes nearer than kNear hits nothing or that; few do.
    if (!hits[i].hasHit() || hits[i].m_collisionObject != object) {
      if (hits[i].hasHit() != (object != nullptr)) ++grazing;
      continue;
    }
    ++found;
    const btVector3 at = from + along * hits[i].m_closestHitFraction - object->getWorldTransform().getOrigin();
    const double gap =
        double(at.length()) - 0.4 - double(static_cast<const btSphereShape*>(object->getCollisionShape())->getRadius());
    EXPECT_LE(gap, kNear + kRounding) << i;
    EXPECT_GE(gap, -kRounding) << i;
    EXPECT_GE(double(hits[i].m_closestHitFraction), first - kRounding) << i;
    EXPECT_GT(double(at.normalized().dot(hits[i].m_hitNormalWorld)), 0.9999) << i;
  }
  EXPECT_GT(found, 150);
  EXPECT_LE(grazing, 5);
}

// A box that falls flat onto boxes and planes.
TEST(Sweeps, OfBoxesAlongAnAxisAreExact) {
  GpuWorld w(onDevice());
  w.objects.add(0, w.objects.plane({0, 1, 0}, -1), {0, 0, 0});
  w.objects.add(1, w.objects.box({1, s(0.5), 1}), {5, 2, 0});
  btBoxShape box(btVector3(s(0.5), s(0.25), s(0.5)));
  std::vector<btGpuSweep> sweeps(3);
  for (btGpuSweep& sweep : sweeps) sweep.m_shape = &box;
  sweeps[0].m_from.setOrigin({0, 9, 0});
  sweeps[0].m_to.setOrigin({0, -11, 0});
  sweeps[1].m_from.setOrigin({5, 9, s(0.2)});
  sweeps[1].m_to.setOrigin({5, -11, s(0.2)});
  sweeps[2] = sweeps[1];
  sweeps[2].m_allowedCcdPenetration = s(0.1);
  std::vector<btGpuSweepHit> hits;
  w.world.convexSweepBatch(sweeps, hits);
  const double expected[] = {(9 + 1 - 0.25) / 20, (9 - 2.5 - 0.25) / 20, (9 - 2.5 - 0.25 + 0.1) / 20};
  for (size_t i = 0; i < sweeps.size(); ++i) {
    ASSERT_TRUE(hits[i].hasHit()) << i;
    // The first step ends on the surface, to rounding.
    EXPECT_NEAR(double(hits[i].m_closestHitFraction), expected[i], kNear / 20 + kRounding) << i;
    EXPECT_NEAR(double(hits[i].m_hitNormalWorld.y()), 1, 1e-5) << i;
    EXPECT_NEAR(double(hits[i].m_hitPointWorld.y()), i == 0 ? -1 : 2.5, 1e-4) << i;
  }
}

TEST(Sweeps, FiltersAndIgnoredObjects) {
  SweepYard yard;
  yard.fill(100, ShapeYard::kAll);
  const auto& bodies = yard.w.objects.bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    btBroadphaseProxy* proxy = bodies[i]->getBroadphaseHandle();
    proxy->m_collisionFilterGroup = 1 << (i % 4);
    proxy->m_collisionFilterMask = i % 5 == 0 ? 2 : -1;
  }
  std::vector<btGpuSweep> sweeps = yard.sweeps({yard.moving(0), yard.moving(1)}, 1500);
  for (size_t i = 0; i < sweeps.size(); ++i) {
    sweeps[i].m_collisionFilterGroup = 1 + static_cast<int>(i % 3);
    sweeps[i].m_collisionFilterMask = i % 2 ? 5 : -1;
    if (i % 3 == 0) sweeps[i].m_ignoredObject = bodies[i % bodies.size()];
  }
  yard.expectSame(sweeps, "filters");
}

TEST(Sweeps, WithoutADevice) {
  btGpuSettings settings;
  settings.m_stockOnly = true;
  SweepYard yard(settings);
  yard.fill(100, ShapeYard::kAll);
  const Counts c = yard.compare(yard.sweeps({yard.moving(0), yard.moving(1)}, 1000));
  EXPECT_EQ(c.others + c.far + c.turned, 0) << "Bullet's own answers";
  EXPECT_EQ(yard.w.world.statistics().m_deviceSweeps, 0u);
  EXPECT_EQ(yard.w.world.statistics().m_hostSweeps, 1000u);
}

// A 2D shape and one of the application's own are Bullet's to sweep.
TEST(Sweeps, OfShapesOfTheHost) {
  struct Own : btSphereShape {
    using btSphereShape::btSphereShape;
  };
  SweepYard yard;
  yard.fill(50, ShapeYard::kCommon);
  Own own(s(0.5));
  auto sweeps = yard.sweeps({yard.moving(0), yard.moving(19), &own}, 900);
  yard.expectSame(sweeps, "shapes of the host");
  EXPECT_EQ(yard.w.world.statistics().m_hostSweeps, 600u);
  EXPECT_EQ(reported(yard.w.world, "batched sweeps").m_count, 1u) << reportText(yard.w.world);
}

TEST(Sweeps, ThatMakeNoSense) {
  SweepYard yard;
  yard.fill(50, ShapeYard::kCommon);
  btSphereShape ball(1);
  std::vector<btGpuSweep> sweeps(4);
  sweeps[1].m_shape = &ball;
  sweeps[2].m_shape = &ball;
  sweeps[2].m_to.setOrigin(btVector3(std::numeric_limits<btScalar>::quiet_NaN(), 0, 0));
  sweeps[3].m_shape = &ball;
  sweeps[3].m_from.getBasis()[1].setZ(std::numeric_limits<btScalar>::infinity());
  sweeps[3].m_to.setOrigin({8, 4, 8});
  std::vector<btGpuSweepHit> hits;
  yard.w.world.convexSweepBatch(sweeps, hits);
  for (const auto& hit : hits) EXPECT_FALSE(hit.hasHit());
}

TEST(Sweeps, AreTheSameEachTime) {
  SweepYard yard;
  yard.fill(100, ShapeYard::kAll);
  const auto sweeps = yard.sweeps({yard.moving(1), yard.moving(4)}, 1000);
  std::vector<btGpuSweepHit> first, again;
  yard.w.world.convexSweepBatch(sweeps, first);
  yard.w.world.convexSweepBatch(sweeps, again);
  for (size_t i = 0; i < sweeps.size(); ++i) {
    ASSERT_EQ(first[i].m_collisionObject, again[i].m_collisionObject);
    ASSERT_EQ(first[i].m_closestHitFraction, again[i].m_closestHitFraction);
    ASSERT_EQ(first[i].m_hitNormalWorld, again[i].m_hitNormalWorld);
  }
}

}  // namespace
}  // namespace btgpu::test
