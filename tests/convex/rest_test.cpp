// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Cylinders, cones and spheres of several sizes at rest and rolling, as in stock; every kind of convex shape, and the
// empty one, is the device's.
#include <cmath>

#include "tests/convex/shape_kinds.h"
#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

const btQuaternion kUpright = btQuaternion::getIdentity();
const btQuaternion kLying(btVector3(0, 0, 1), SIMD_HALF_PI);

// On a plane (row 0), on a box (row 1), on a hull (row 2): a cylinder that stands, one that lies, a cone on its base, a
// coin, and three spheres.
template <typename World>
struct Rests {
  WorldOf<World> w;
  std::vector<btRigidBody*> bodies;

  Rests() {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    w.objects.add(0, w.objects.box(btVector3(20, s(0.5), 2)), btVector3(0, s(0.5), 10));
    w.objects.add(0, w.objects.hull(scenes::prism(8, 20, 0.46)), btVector3(0, s(0.5), 40));
    auto* drum = w.objects.template shape<btCylinderShape>(btVector3(s(0.5), s(0.5), s(0.5)));
    auto* coin = w.objects.template shape<btCylinderShape>(btVector3(s(0.5), s(0.05), s(0.5)));
    auto* hat = w.objects.template shape<btConeShape>(s(0.5), 1);
    const btVector3 at[] = {btVector3(s(-0.4), 0, 0), btVector3(s(0.4), 0, s(-0.3)), btVector3(0, 0, s(0.4))};
    const btScalar radii[] = {s(0.3), s(0.3), s(0.2)};
    auto* spheres = w.objects.template shape<btMultiSphereShape>(at, radii, 3);
    const double heights[] = {0, 1, 1}, rows[] = {0, 10, 40};
    for (int k = 0; k < 3; ++k) {
      const auto put = [&](btCollisionShape* shape, double x, double y, const btQuaternion& turn) {
        bodies.push_back(w.objects.add(1, shape, btTransform(turn, btVector3(s(x), s(heights[k] + y), s(rows[k])))));
        bodies.back()->setRollingFriction(s(0.05));
      };
      put(drum, -8, 0.52, kUpright);
      put(drum, -4, 0.52, kLying);
      put(hat, 0, 0.56, kUpright);
      put(coin, 4, 0.07, kUpright);
      put(spheres, 8, 0.32, kUpright);
    }
  }
};

TEST(Round, RestsWhereStockHasIt) {
  Rests<btGpuDynamicsWorld> gpu;
  Rests<btDiscreteDynamicsWorld> stock;
  gpu.w.run(300);
  stock.w.run(300);
  expectAllOnDevice(gpu.w.world);
  for (size_t i = 0; i < gpu.bodies.size(); ++i) {
    const btTransform &ours = gpu.bodies[i]->getWorldTransform(), &theirs = stock.bodies[i]->getWorldTransform();
    // What stands on a cap must not have tilted; stock's own does where a point a step is all that it finds.
    const bool stands = i % 5 != 1 && i % 5 != 4;
    if (stands) { EXPECT_GT(double(ours.getBasis()[1][1]), 0.9999) << "body " << i; }
    EXPECT_NEAR(double(ours.getOrigin().y()), double(theirs.getOrigin().y()), 3e-3) << "body " << i;
    EXPECT_FALSE(gpu.bodies[i]->isActive()) << "body " << i << " never slept";
    EXPECT_LT(length(gpu.bodies[i]->getLinearVelocity()), 1e-6) << "body " << i;
  }
}

// A tower of cylinders, and a cone on top.
TEST(Round, TowerStands) {
  GpuWorld w;
  w.world.setGravity(btVector3(0, -10, 0));
  w.objects.add(0, w.objects.box(btVector3(50, 5, 50)), btVector3(0, -5, 0));
  auto* drum = w.objects.template shape<btCylinderShape>(btVector3(s(0.6), s(0.4), s(0.6)));
  std::vector<btRigidBody*> tower;
  for (int i = 0; i < 6; ++i) tower.push_back(w.objects.add(1, drum, btVector3(0, s(0.4 + 0.8 * i), 0)));
  tower.push_back(
      w.objects.add(1, w.objects.template shape<btConeShape>(s(0.5), s(0.8)), btVector3(0, s(4.8 + 0.44), 0)));
  w.run(400);
  expectAllOnDevice(w.world);
  for (size_t i = 0; i < tower.size(); ++i) {
    EXPECT_GT(double(tower[i]->getWorldTransform().getBasis()[1][1]), 0.9999) << i;
    EXPECT_FALSE(tower[i]->isActive()) << i;
  }
}

template <typename World>
struct Roll {
  WorldOf<World> w;
  btRigidBody* body;

  Roll(bool onBox, bool cone) {
    w.world.setGravity(btVector3(0, -10, 0));
    if (onBox) {
      w.objects.add(0, w.objects.box(btVector3(50, 1, 50)), btVector3(0, -1, 0));
    } else {
      w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    }
    if (cone) {
      // On its side, about its tip.
      const double lean = 1.5707963267948966 + std::asin(0.4 / std::hypot(0.4, 1.2));
      body = w.objects.add(1, w.objects.template shape<btConeShape>(s(0.4), s(1.2)),
                           btTransform(btQuaternion(btVector3(0, 0, 1), s(lean)), btVector3(0, s(0.235), 0)));
      body->setAngularVelocity(btVector3(3, 1, 0));
    } else {
      body = w.objects.add(1, w.objects.template shape<btCylinderShapeX>(btVector3(s(0.6), s(0.5), s(0.5))),
                           btVector3(0, s(0.5), 0));
      // Without slip.
      body->setLinearVelocity(btVector3(0, 0, 3));
      body->setAngularVelocity(btVector3(6, 0, 0));
    }
    body->setFriction(s(0.8));
    body->setActivationState(DISABLE_DEACTIVATION);
  }
};

// Two seconds without rolling friction: straight on, not slower than stock's, and not through the ground.
TEST(Round, CylinderRollsAsStock) {
  for (const bool onBox : {false, true}) {
    Roll<btGpuDynamicsWorld> gpu(onBox, false);
    Roll<btDiscreteDynamicsWorld> stock(onBox, false);
    gpu.w.run(120);
    stock.w.run(120);
    expectAllOnDevice(gpu.w.world);
    const btVector3 &ours = gpu.body->getWorldTransform().getOrigin(),
                    &theirs = stock.body->getWorldTransform().getOrigin();
    EXPECT_NEAR(double(ours.z()), 6, 0.06) << "1 % of the way, on box: " << onBox;
    EXPECT_LE(std::fabs(double(ours.z()) - 6), std::fabs(double(theirs.z()) - 6) + 0.01) << onBox;
    EXPECT_NEAR(double(ours.x()), 0, 0.06) << "straight on, within 1 % of the way, on box: " << onBox;
    EXPECT_NEAR(double(ours.y()), 0.5, 0.005);
    EXPECT_NEAR(double(gpu.body->getLinearVelocity().z()), 3, 0.05) << onBox;
  }
}

TEST(Round, ConeRollsAboutItsTip) {
  for (const bool onBox : {false, true}) {
    Roll<btGpuDynamicsWorld> gpu(onBox, true);
    Roll<btDiscreteDynamicsWorld> stock(onBox, true);
    double lowest = 1, highest = 0;
    for (int i = 0; i < 120; ++i) {
      gpu.w.run(1);
      stock.w.run(1);
      lowest = std::min(lowest, double(gpu.body->getWorldTransform().getOrigin().y()));
      highest = std::max(highest, double(gpu.body->getWorldTransform().getOrigin().y()));
    }
    expectAllOnDevice(gpu.w.world);
    const btVector3 &ours = gpu.body->getWorldTransform().getOrigin(),
                    &theirs = stock.body->getWorldTransform().getOrigin();
    EXPECT_NEAR(double(ours.y()), double(theirs.y()), 0.01) << onBox;
    EXPECT_GT(lowest, 0.2) << "through the ground";
    EXPECT_LT(highest, 0.3) << "off the ground";
  }
}

TEST(Round, NoneOfTheKindsIsTheHosts) {
  GpuWorld w;
  w.world.setGravity(btVector3(0, -10, 0));
  w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  ShapeStore store;
  RandomSource random(1);
  const auto kinds = convexKinds();
  for (size_t i = 0; i < 3 * kinds.size(); ++i) {
    btCollisionShape* shape = kinds[i % kinds.size()].make(store, random, 0.5);
    btVector3 inertia(1, 1, 1);
    w.objects
        .add(1, store.make<btBoxShape>(btVector3(1, 1, 1)),
             btVector3(s(2.0 * double(i % 6)), s(1 + 1.2 * double(i / 6)), 0))
        ->setCollisionShape(shape);
  }
  auto* empty = w.objects.add(1, store.make<btBoxShape>(btVector3(1, 1, 1)), btVector3(0, 1, 20));
  empty->setCollisionShape(store.make<btEmptyShape>());
  w.run(60);
  expectAllOnDevice(w.world);
  EXPECT_LT(double(empty->getWorldTransform().getOrigin().y()), -3) << "nothing holds an empty shape up";
  for (const btRigidBody* body : w.objects.bodies()) {
    if (body == empty) continue;
    EXPECT_GT(double(body->getWorldTransform().getOrigin().y()), -0.1) << body->getCollisionShape()->getName();
  }
}

}  // namespace
}  // namespace btgpu::test
