// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batches of rays, held against btCollisionWorld::rayTest of the same world: what the device casts has to be what stock
// would have found just then.
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>

#include <limits>
#include <set>

#include "tests/support/shape_yard.h"

namespace btgpu::test {
namespace {

// In a double world all convex shapes but spheres are the host's.
constexpr bool kFloat = sizeof(btScalar) == sizeof(float);
constexpr double kTolerance = 1e-4;
// The device's normals of spheres in a double world are exact; stock's are those of the step before its cast ended:
// within 2.6 degrees, a cosine of 0.999.
constexpr double kNormal = kFloat ? 1e-3 : 0.045;

// All that btCollisionWorld::rayTest says of the first hit.
struct StockHit : btCollisionWorld::ClosestRayResultCallback {
  explicit StockHit(const btGpuRay& ray)
      : ClosestRayResultCallback(ray.m_from, ray.m_to), ignored(ray.m_ignoredObject) {
    m_collisionFilterGroup = ray.m_collisionFilterGroup;
    m_collisionFilterMask = ray.m_collisionFilterMask;
    m_flags = ray.m_flags;
  }
  bool needsCollision(btBroadphaseProxy* proxy) const override {
    return proxy->m_clientObject != ignored && ClosestRayResultCallback::needsCollision(proxy);
  }
  btScalar addSingleResult(btCollisionWorld::LocalRayResult& r, bool inWorld) override {
    part = r.m_localShapeInfo ? r.m_localShapeInfo->m_shapePart : -1;
    triangle = r.m_localShapeInfo ? r.m_localShapeInfo->m_triangleIndex : -1;
    return ClosestRayResultCallback::addSingleResult(r, inWorld);
  }
  const btCollisionObject* ignored;
  int part = -1, triangle = -1;
};

struct Yard : ShapeYard {
  using ShapeYard::ShapeYard;

  // Anything between and beyond the bodies: long, short, from inside, grazing, axis-parallel.
  std::vector<btGpuRay> rays(int count) {
    std::vector<btGpuRay> all(static_cast<size_t>(count));
    for (size_t i = 0; i < all.size(); ++i) {
      btGpuRay& ray = all[i];
      const btVector3 middle(8, 4, 8);
      ray.m_from = middle + random.vector(i % 3 == 0 ? 12 : 60);
      ray.m_to = middle + random.vector(10);
      if (i % 7 == 0) ray.m_to = ray.m_from + random.vector(3);
      if (i % 11 == 0) ray.m_to = ray.m_from + btVector3(0, -40, 0);
    }
    return all;
  }

  // How many rays differ from stock's answer now, and how many hit.
  struct Counts {
    int rays = 0, hits = 0, others = 0, far = 0, turned = 0, infos = 0;
    std::set<const btCollisionObject*> objects;
  };
  Counts compare(const std::vector<btGpuRay>& rays) {
    std::vector<btGpuRayHit> hits;
    w.world.rayTestBatch(rays, hits);
    Counts c;
    for (size_t i = 0; i < rays.size(); ++i) {
      StockHit stock(rays[i]);
      w.world.rayTest(rays[i].m_from, rays[i].m_to, stock);
      ++c.rays;
      if (stock.hasHit()) ++c.hits;
      if (stock.hasHit()) c.objects.insert(stock.m_collisionObject);
      if (hits[i].m_collisionObject != stock.m_collisionObject) {
        ++c.others;
        continue;
      }
      if (!stock.hasHit()) {
        EXPECT_EQ(hits[i].m_closestHitFraction, 1) << "ray " << i;
        continue;
      }
      if (std::fabs(double(hits[i].m_closestHitFraction - stock.m_closestHitFraction)) > kTolerance) ++c.far;
      if (double((hits[i].m_hitNormalWorld - stock.m_hitNormalWorld).length()) > kNormal) ++c.turned;
      if (hits[i].m_shapePart != stock.part || hits[i].m_triangleIndex != stock.triangle) ++c.infos;
    }
    return c;
  }
  // The device does what stock does, operation by operation (in a double world only
  // spheres, exactly, and planes; all else there is the host's); what differs are hits as near as another one. The
  // issue's bound for those is one ray in 1000.
  void expectSame(const std::vector<btGpuRay>& rays, const char* what) {
    const Counts c = compare(rays);
    const int ties = std::max(1, c.rays / 1000);
    EXPECT_GT(c.hits, c.rays / 10) << what;
    EXPECT_LE(c.others, ties) << what << ": other bodies";
    EXPECT_LE(c.far, ties) << what << ": fractions";
    EXPECT_LE(c.infos, ties) << what << ": parts and triangles";
    EXPECT_LE(c.turned, ties) << what << ": normals";
  }
};

void expectOnDevice(Yard& yard) {
  EXPECT_GT(yard.w.world.statistics().m_deviceRays, 0u);
  EXPECT_EQ(yard.w.world.statistics().m_hostRays, 0u);
}

TEST(Rays, ThroughMixedShapes) {
  Yard yard;
  yard.fill(100, Yard::kCommon);
  yard.expectSame(yard.rays(4000), "before the first step");
  for (int i = 0; i < 3; ++i) {
    yard.w.run(5);
    yard.expectSame(yard.rays(4000), "after steps");
  }
  expectOnDevice(yard);
  for (const auto& f : yard.w.world.fallbackReport()) {
    if (!kFloat) break;
    EXPECT_EQ(f.m_reason.find("batched"), std::string::npos) << f.m_what << ": " << f.m_reason;
  }
}

TEST(Rays, ThroughEveryShapeOfTheDevice) {
  Yard yard;
  yard.fill(100, Yard::kOnDevice);
  yard.expectSame(yard.rays(8000), "before the first step");
  yard.w.run(5);
  yard.expectSame(yard.rays(8000), "after steps");
  expectOnDevice(yard);
  for (const auto& f : yard.w.world.fallbackReport()) {
    if (!kFloat) break;
    EXPECT_EQ(f.m_reason.find("batched"), std::string::npos) << f.m_what << ": " << f.m_reason;
  }
}

// One kind at a time, so that a rare difference in one of them does not hide among all the others.
TEST(Rays, AtEachKind) {
  for (int kind = 0; kind < Yard::kAll; ++kind) {
    Yard yard;
    for (int i = 0; i < 20; ++i) yard.add(0, yard.shape(kind), btVector3(s(4 * (i % 5)), s(2), s(4 * (i / 5))));
    std::vector<btGpuRay> rays(4000);
    for (size_t i = 0; i < rays.size(); ++i) {
      const btVector3 middle(s(4 * double(i % 5)), 2, s(4 * double(i / 5 % 4)));
      rays[i].m_from = middle + yard.random.vector(i % 7 == 0 ? 0.5 : 5);
      rays[i].m_to = middle + yard.random.vector(i % 5 == 0 ? 4 : 1);
      if (i % 2) rays[i].m_to += rays[i].m_to - rays[i].m_from;
      rays[i].m_flags = static_cast<unsigned>(i % 11 % 4) | (i % 6 == 0 ? 16u : 0u);
    }
    yard.expectSame(rays, ("kind " + std::to_string(kind)).c_str());
    EXPECT_TRUE(!kFloat || yard.w.world.fallbackReport().empty() == (kind < Yard::kOnDevice)) << kind;
  }
}

TEST(Rays, ThroughShapesOfTheHost) {
  Yard yard;
  yard.fill(100, Yard::kAll);
  yard.w.run(3);
  yard.expectSame(yard.rays(6000), "with nested compounds and height fields in diamonds");
  expectOnDevice(yard);
  EXPECT_GT(reported(yard.w.world, "Compound shape").m_count, 0u) << reportText(yard.w.world);
  EXPECT_GT(reported(yard.w.world, "HEIGHTFIELD shape").m_count, 0u) << reportText(yard.w.world);
}

// Corners that the application moves are seen by the next batch.
TEST(Rays, AtAMeshThatChanges) {
  Yard yard;
  auto* shape = static_cast<btBvhTriangleMeshShape*>(yard.mesh(true));
  yard.add(0, shape, {8, 4, 8});
  std::vector<btGpuRay> rays(2000);
  for (btGpuRay& ray : rays) {
    ray.m_from = btVector3(8, 4, 8) + yard.random.vector(5);
    ray.m_to = btVector3(8, 4, 8) + yard.random.vector(1);
    ray.m_to += ray.m_to - ray.m_from;
  }
  yard.expectSame(rays, "before");
  unsigned char *vertices, *indices;
  int count, stride, indexStride, faces;
  PHY_ScalarType type, indexType;
  shape->getMeshInterface()->getLockedVertexIndexBase(&vertices, count, type, stride, &indices, indexStride, faces,
                                                      indexType);
  // Within the bounds that Bullet's own tree has.
  for (int i = 0; i < count; i += 2) reinterpret_cast<btScalar*>(vertices + i * stride)[1] *= s(-0.5);
  shape->partialRefitTree(btVector3(-2, -2, -2), btVector3(2, 2, 2));
  yard.expectSame(rays, "after");
}

TEST(Rays, WhereNothingIs) {
  Yard yard;
  std::vector<btGpuRay> rays = yard.rays(100);
  EXPECT_EQ(yard.compare(rays).others, 0);
  std::vector<btGpuRayHit> hits(3);
  yard.w.world.rayTestBatch({}, hits);
  EXPECT_TRUE(hits.empty());
  yard.add(0, yard.w.objects.sphere(20), {8, 4, 8});
  const auto c = yard.compare(rays);
  EXPECT_EQ(c.others + c.far, 0);
  EXPECT_GT(c.hits, 20) << "one body alone";
}

TEST(Rays, OfNoLengthOrNotFinite) {
  Yard yard;
  yard.fill(50, Yard::kAll);
  yard.w.run(1);
  const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN(), inf = std::numeric_limits<btScalar>::infinity();
  std::vector<btGpuRay> rays = yard.rays(8);
  rays[0].m_to = rays[0].m_from;
  rays[1].m_from = yard.w.objects.bodies()[5]->getWorldTransform().getOrigin();
  rays[1].m_to = rays[1].m_from;
  rays[2].m_from.setX(nan);
  rays[3].m_to.setY(nan);
  rays[4].m_to.setZ(inf);
  rays[5].m_from.setX(-inf);
  rays[6].m_from = btVector3(s(-3e38), 0, 0);
  rays[6].m_to = btVector3(s(3e38), 0, 0);
  std::vector<btGpuRayHit> hits;
  yard.w.world.rayTestBatch(rays, hits);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_FALSE(hits[i].hasHit()) << "ray " << i;
    EXPECT_EQ(hits[i].m_closestHitFraction, 1) << "ray " << i;
  }
  EXPECT_TRUE(!kFloat || !hits[6].hasHit()) << "its length is not finite";
}

TEST(Rays, FiltersFlagsAndIgnoredObjects) {
  Yard yard;
  yard.fill(100, Yard::kAll);
  const auto& bodies = yard.w.objects.bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    btBroadphaseProxy* proxy = bodies[i]->getBroadphaseHandle();
    proxy->m_collisionFilterGroup = 1 << (i % 4);
    proxy->m_collisionFilterMask = i % 5 == 0 ? 2 : -1;
  }
  std::vector<btGpuRay> rays = yard.rays(6000);
  for (size_t i = 0; i < rays.size(); ++i) {
    rays[i].m_collisionFilterGroup = 1 + static_cast<int>(i % 3);
    rays[i].m_collisionFilterMask = i % 2 ? 5 : -1;
    // FilterBackfaces, KeepUnflippedNormal; DisableHeightfieldAccelerator
    rays[i].m_flags = static_cast<unsigned>(i % 4) | (i % 5 == 0 ? 16u : 0u);
    if (i % 3 == 0) rays[i].m_ignoredObject = bodies[i % bodies.size()];
  }
  yard.expectSame(rays, "filters");
  std::vector<btGpuRayHit> hits;
  yard.w.world.rayTestBatch(rays, hits);
  // A ray that ignores what it hit hits something else.
  int moved = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].hasHit()) rays[i].m_ignoredObject = hits[i].m_collisionObject;
  }
  std::vector<btGpuRayHit> behind;
  yard.w.world.rayTestBatch(rays, behind);
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].hasHit()) continue;
    ASSERT_NE(behind[i].m_collisionObject, hits[i].m_collisionObject) << "ray " << i;
    if (behind[i].hasHit()) ++moved;
  }
  EXPECT_GT(moved, 100);
  btCollisionObject elsewhere;
  for (btGpuRay& ray : rays) ray.m_ignoredObject = &elsewhere;
  yard.expectSame(rays, "an ignored object that is not in the world");
}

TEST(Rays, ByGjkAreTheHosts) {
  Yard yard;
  yard.fill(50, Yard::kCommon);
  std::vector<btGpuRay> rays = yard.rays(500);
  for (size_t i = 0; i < rays.size(); i += 2) rays[i].m_flags = btTriangleRaycastCallback::kF_UseGjkConvexCastRaytest;
  yard.expectSame(rays, "GJK casts");
  EXPECT_EQ(yard.w.world.statistics().m_hostRays, 250u);
  EXPECT_EQ(reported(yard.w.world, "kF_UseGjkConvexCastRaytest").m_count, 1u);
}

TEST(Rays, AfterChangesByHand) {
  Yard yard;
  yard.fill(100, Yard::kAll);
  yard.w.run(2);
  yard.expectSame(yard.rays(2000), "before");
  const auto& bodies = yard.w.objects.bodies();
  for (size_t i = 1; i < bodies.size(); i += 3) {
    btTransform t = bodies[i]->getWorldTransform();
    t.setOrigin(t.getOrigin() + yard.random.vector(1));
    bodies[i]->setWorldTransform(t);
  }
  yard.expectSame(yard.rays(4000), "moved; stock's broadphase does not know yet");
  yard.w.world.updateAabbs();
  yard.expectSame(yard.rays(4000), "moved, and the AABBs updated");
  btCollisionObject* gone = bodies[7];
  yard.w.world.removeRigidBody(bodies[7]);
  yard.w.world.removeRigidBody(bodies[30]);
  const auto rays = yard.rays(6000);
  yard.expectSame(rays, "removed");
  std::vector<btGpuRayHit> hits;
  yard.w.world.rayTestBatch(rays, hits);
  for (const auto& hit : hits) ASSERT_NE(hit.m_collisionObject, gone);
  yard.w.world.addRigidBody(bodies[7]);
  yard.w.world.addRigidBody(bodies[30]);
  auto* box = static_cast<btBoxShape*>(bodies[2]->getCollisionShape());
  box->setLocalScaling(btVector3(2, 1, s(0.5)));
  yard.expectSame(yard.rays(4000), "added again, another scaled");
  yard.w.run(2);
  yard.expectSame(yard.rays(4000), "a step later");
  expectOnDevice(yard);
}

TEST(Rays, InTickCallbacks) {
  struct Asking {
    Yard* yard;
    int asked = 0;
    static void tick(btDynamicsWorld* world, btScalar) {
      auto* self = static_cast<Asking*>(world->getWorldUserInfo());
      self->yard->expectSame(self->yard->rays(1000), "in a tick callback");
      ++self->asked;
    }
  };
  for (const bool pre : {false, true}) {
    Yard yard;
    yard.fill(75, Yard::kAll);
    Asking asking{&yard};
    yard.w.world.setInternalTickCallback(Asking::tick, &asking, pre);
    yard.w.run(4);
    EXPECT_EQ(asking.asked, 4);
    EXPECT_GT(yard.w.world.statistics().m_deviceSteps, 0u);
    expectOnDevice(yard);
  }
}

TEST(Rays, WithoutHostQueries) {
  btGpuSettings settings = onDevice();
  settings.m_hostQueries = false;
  Yard yard(settings);
  yard.fill(75, Yard::kCommon);
  yard.w.run(20);
  const auto rays = yard.rays(3000);
  std::vector<btGpuRayHit> hits;
  yard.w.world.rayTestBatch(rays, hits);
  yard.w.world.updateAabbs();  // so that stock sees where the bodies are
  int hitCount = 0, others = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    StockHit stock(rays[i]);
    yard.w.world.rayTest(rays[i].m_from, rays[i].m_to, stock);
    if (stock.hasHit()) ++hitCount;
    if (hits[i].m_collisionObject != stock.m_collisionObject) ++others;
  }
  EXPECT_GT(hitCount, 300);
  EXPECT_LE(others, 3);
}

TEST(Rays, WithoutADevice) {
  for (const int way : {0, 1}) {
    btGpuSettings settings = onDevice();
    if (way == 0) settings.m_stockOnly = true;
    if (way == 1) settings.m_smallBatch = 1000000;
    Yard yard(settings);
    yard.fill(75, Yard::kAll);
    yard.w.run(3);
    yard.expectSame(yard.rays(3000), "on the CPU");
    EXPECT_EQ(yard.w.world.statistics().m_deviceRays, 0u);
    EXPECT_EQ(yard.w.world.statistics().m_hostRays, 3000u);
  }
}

TEST(Rays, AreTheSameEachTime) {
  Yard yard;
  yard.fill(100, Yard::kAll);
  yard.w.run(3);
  const auto rays = yard.rays(5000);
  std::vector<btGpuRayHit> first, again;
  yard.w.world.rayTestBatch(rays, first);
  yard.w.world.rayTestBatch(yard.rays(10), again);
  yard.w.world.rayTestBatch(rays, again);
  for (size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(first[i].m_collisionObject, again[i].m_collisionObject);
    ASSERT_EQ(first[i].m_closestHitFraction, again[i].m_closestHitFraction);
    ASSERT_EQ(first[i].m_hitNormalWorld, again[i].m_hitNormalWorld);
  }
}

}  // namespace
}  // namespace btgpu::test
