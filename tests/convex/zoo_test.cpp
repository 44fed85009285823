// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Degenerate convex shapes: without radius or height, needles, very small and very large ones, scaled by negative
// numbers, with sizes that are no numbers. All against all and on a plane and a box: no hang, no crash, no NaN.
#include <chrono>
#include <cmath>
#include <limits>

#include "tests/convex/shape_kinds.h"
#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

struct Animal {
  std::string name;
  btCollisionShape* shape;
};

btCollisionShape* scaled(btCollisionShape* shape, double x, double y, double z) {
  shape->setLocalScaling(btVector3(s(x), s(y), s(z)));
  return shape;
}

btCollisionShape* hullOf(ShapeStore& store, const std::vector<btVector3>& points) {
  auto* hull = store.make<btConvexHullShape>();
  for (const btVector3& p : points) hull->addPoint(p, false);
  hull->recalcLocalAabb();
  return hull;
}

std::vector<Animal> zoo(ShapeStore& store) {
  const btVector3 origin(0, 0, 0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  const btVector3 centres[] = {origin, x, y};
  const btScalar none[] = {0, 0, 0}, mixed[] = {0, s(0.5), s(1e-4)};
  auto* cloud = store.make<std::vector<btVector3>>(std::vector<btVector3>{origin, x, x, x * s(0.5)});
  auto* sliver = store.make<btTriangleMesh>();
  sliver->addTriangle(origin, x, x * s(0.5) + y * s(1e-6));
  auto* noMesh = store.make<btTriangleMesh>();
  std::vector<Animal> all = {
      {"cylinder without radius", store.make<btCylinderShape>(btVector3(0, s(0.5), 0))},
      {"cylinder without height", store.make<btCylinderShapeX>(btVector3(0, s(0.5), s(0.5)))},
      {"cylinder without either", store.make<btCylinderShapeZ>(origin)},
      {"cylinder thinner than its margin",
       [&] {
         auto* c = store.make<btCylinderShape>(btVector3(s(0.1), s(0.1), s(0.1)));
         c->setMargin(s(0.3));
         return c;
       }()},
      {"needle", store.make<btCylinderShape>(btVector3(s(1e-4), 2, s(1e-4)))},
      {"plate", store.make<btCylinderShape>(btVector3(2, s(1e-4), 2))},
      {"tiny cylinder", store.make<btCylinderShape>(btVector3(s(1e-4), s(1e-4), s(1e-4)))},
      {"negative cylinder", scaled(store.make<btCylinderShape>(btVector3(s(0.5), s(0.5), s(0.5))), -1, -1, -1)},
      {"cone without radius", store.make<btConeShape>(0, 1)},
      {"cone without height", store.make<btConeShapeX>(s(0.5), 0)},
      {"cone without either", store.make<btConeShapeZ>(0, 0)},
      {"needle cone", store.make<btConeShape>(s(1e-4), 4)},
      {"tiny cone", store.make<btConeShape>(s(1e-4), s(1e-4))},
      {"negative cone", scaled(store.make<btConeShape>(s(0.5), 1), -1, -1, -1)},
      {"spheres without radius", store.make<btMultiSphereShape>(centres, none, 3)},
      {"spheres of all sizes", store.make<btMultiSphereShape>(centres, mixed, 3)},
      {"spheres in one place", store.make<btMultiSphereShape>(std::vector<btVector3>(3, origin).data(), mixed, 3)},
      {"stretched spheres", scaled(store.make<btMultiSphereShape>(centres, mixed, 3), 2, -1, s(0.5))},
      {"flattened spheres", scaled(store.make<btMultiSphereShape>(centres, mixed, 3), 1, 0, 1)},
      {"no spheres", store.make<btMultiSphereShape>(centres, none, 0)},
      {"points on a line", store.make<btConvexPointCloudShape>(cloud->data(), 4, btVector3(1, 1, 1))},
      {"no points", store.make<btConvexPointCloudShape>(cloud->data(), 0, btVector3(1, 1, 1))},
      {"sliver mesh", store.make<btConvexTriangleMeshShape>(sliver)},
      {"empty mesh", store.make<btConvexTriangleMeshShape>(noMesh, false)},
      {"simplex of one", store.make<btBU_Simplex1to4>(origin)},
      {"simplex of two", store.make<btBU_Simplex1to4>(origin, x)},
      {"flat simplex", store.make<btBU_Simplex1to4>(origin, x, y, x + y)},
      {"triangle in one place", store.make<btTriangleShape>(origin, origin, origin)},
      {"sliver", store.make<btTriangleShape>(origin, x, x * 2 + y * s(1e-6))},
      {"flat box", store.make<btBox2dShape>(btVector3(s(0.5), s(0.5), 0))},
      {"2D box of nothing", store.make<btBox2dShape>(origin)},
      {"scaled to nothing", store.make<btUniformScalingShape>(store.make<btCylinderShape>(btVector3(1, 1, 1)), 0)},
      {"turned inside out", store.make<btUniformScalingShape>(store.make<btConeShape>(s(0.5), 1), -1)},
      {"negative hull", scaled(hullOf(store, {origin, x, y, z}), -1, 1, 1)},
      {"flattened hull", scaled(hullOf(store, {origin, x, y, z}), 1, 0, 1)},
  };
  return all;
}

void expectFinite(const GpuWorld& w, const std::string& name) {
  for (const btRigidBody* body : const_cast<GpuWorld&>(w).objects.bodies()) {
    const btTransform& t = body->getWorldTransform();
    for (int k = 0; k < 3; ++k) {
      ASSERT_TRUE(std::isfinite(double(t.getOrigin()[k]))) << name;
      ASSERT_TRUE(std::isfinite(double(t.getBasis()[k].length()))) << name;
      ASSERT_TRUE(std::isfinite(double(body->getLinearVelocity()[k]))) << name;
    }
  }
}

// Inertia of its own kind would be zero or worse.
btRigidBody* add(GpuWorld& w, btCollisionShape* shape, const btVector3& at) {
  auto* unit = w.objects.sphere(s(0.5));
  btRigidBody* body = w.objects.add(1, unit, at);
  w.world.removeRigidBody(body);
  body->setCollisionShape(shape);
  w.world.addRigidBody(body);
  return body;
}

TEST(Zoo, AllAgainstAll) {
  ShapeStore store;
  const auto animals = zoo(store);
  GpuWorld w;
  w.world.setGravity(btVector3(0, -10, 0));
  w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  w.objects.add(0, w.objects.box(btVector3(50, s(0.5), 50)), btVector3(0, 0, 100));
  // Each meets each, in one place, a little apart and on top; a third of them on the plane, the rest on the box.
  const size_t n = animals.size();
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i; j < n; ++j) {
      const btVector3 place(s(4.0 * double(j)), s(0.5), s(4.0 * double(i)));
      add(w, animals[i].shape, place);
      add(w, animals[j].shape, place + btVector3(s(0.2 * double((i + j) % 3)), s(0.3 * double((i + j) % 4)), 0));
    }
  }
  for (int step = 0; step < 6; ++step) {
    w.run(10);
    expectFinite(w, "step " + std::to_string(10 * step));
    if (HasFatalFailure()) return;
  }
  expectAllOnDevice(w.world);
}

TEST(Zoo, EachOnPlaneAndBox) {
  ShapeStore store;
  for (const Animal& animal : zoo(store)) {
    GpuWorld w;
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    w.objects.add(0, w.objects.box(btVector3(2, s(0.5), 2)), btVector3(10, s(0.5), 0));
    const btRigidBody* onPlane = add(w, animal.shape, btVector3(0, s(1.5), 0));
    const btRigidBody* onBox = add(w, animal.shape, btVector3(10, s(2.5), 0));
    w.run(60);
    expectFinite(w, animal.name);
    if (HasFatalFailure()) return;
    expectAllOnDevice(w.world);
    const bool bounded = animal.name != "no points" && animal.name != "empty mesh" && animal.name != "no spheres";
    // Without points Bullet's bounds are inside out, and meet nothing.
    if (!bounded) continue;
    EXPECT_GT(double(onPlane->getWorldTransform().getOrigin().y()), -2.5) << animal.name << " fell through the plane";
    EXPECT_GT(double(onBox->getWorldTransform().getOrigin().y()), -2.5) << animal.name << " fell through the box";
  }
}

// 1e-4 beside 1e4.
TEST(Zoo, SmallOnLarge) {
  GpuWorld w;
  w.world.setGravity(btVector3(0, -10, 0));
  w.objects.add(0, w.objects.shape<btCylinderShape>(btVector3(s(1e4), s(1e4), s(1e4))), btVector3(0, s(-1e4), 0));
  auto* small = w.objects.shape<btCylinderShape>(btVector3(s(1e-4), s(1e-4), s(1e-4)));
  auto* cone = w.objects.shape<btConeShape>(s(0.5), 1);
  const btRigidBody* tiny = add(w, small, btVector3(0, s(0.01), 0));
  const btRigidBody* hat = add(w, cone, btVector3(5, s(0.6), 0));
  w.run(120);
  expectFinite(w, "on a drum of 10 km");
  expectAllOnDevice(w.world);
  // A float of 1e4 is known to a millimetre.
  EXPECT_NEAR(double(hat->getWorldTransform().getOrigin().y()), 0.54, 0.02);
  EXPECT_GT(double(tiny->getWorldTransform().getOrigin().y()), -0.05);
}

// A size that is no number sends the step to stock, by name, as other shapes' do; put right, it is the device's again.
TEST(Zoo, NoNumbers) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  GpuWorld w;
  w.objects.add(0, w.objects.box(btVector3(5, 1, 5)), btVector3(0, -1, 0));
  auto* cone = w.objects.shape<btConeShape>(s(0.5), 1);
  add(w, cone, btVector3(100, 2, 0));
  w.run(1);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 0u);
  cone->setHeight(s(nan));
  w.run(1);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 1u);
  bool named = false;
  for (const auto& f : w.world.fallbackReport()) named = named || f.m_what == "Cone shape";
  EXPECT_TRUE(named);
  cone->setHeight(1);
  w.run(1);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 1u);
}

}  // namespace
}  // namespace btgpu::test
