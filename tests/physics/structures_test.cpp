// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A tower, a long plank under many boxes, a moving platform.
#include <cmath>

#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

template <typename World>
struct Tower {
  WorldOf<World> w;
  std::vector<btRigidBody*> boxes;

  Tower() {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.box(btVector3(50, 5, 50)), btVector3(0, -5, 0));
    btBoxShape* box = w.objects.box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
    for (int i = 0; i < 20; ++i) boxes.push_back(w.objects.add(1, box, btVector3(0, btScalar(0.5 + i), 0)));
  }
  // Step at which all boxes are asleep; -1 if they are not within `steps`.
  int runUntilAsleep(int steps) {
    for (int i = 0; i < steps; ++i) {
      w.run(1);
      bool asleep = true;
      for (const btRigidBody* b : boxes) asleep = asleep && b->getActivationState() == ISLAND_SLEEPING;
      if (asleep) return i;
    }
    return -1;
  }
};

TEST(TowerOf20, StandsAndSleepsWhenStockDoes) {
  Tower<btGpuDynamicsWorld> gpu;
  Tower<btDiscreteDynamicsWorld> stock;
  const int ours = gpu.runUntilAsleep(600), theirs = stock.runUntilAsleep(600);
  ASSERT_GE(theirs, 0) << "stock's tower never slept";
  ASSERT_GE(ours, 0) << "our tower never slept";
  EXPECT_NEAR(ours, theirs, 0.2 * theirs);
  gpu.w.run(600 - ours);
  for (size_t i = 0; i < gpu.boxes.size(); ++i) {
    const btVector3& p = gpu.boxes[i]->getWorldTransform().getOrigin();
    EXPECT_NEAR(double(p.y()), 0.5 + double(i), 0.1) << "box " << i;
    // Settling shifts the boxes, in stock by up to 0.29 of their width.
    EXPECT_NEAR(double(p.x()), 0, 0.4);
    EXPECT_NEAR(double(p.z()), 0, 0.4);
  }
  expectAllOnDevice(gpu.w.world);
}

template <typename World>
struct Plank {
  WorldOf<World> w;
  btRigidBody* plank;
  std::vector<btRigidBody*> boxes;

  Plank() {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.box(btVector3(200, 5, 200)), btVector3(0, -5, 0));
    plank = w.objects.add(100, w.objects.box(btVector3(50, btScalar(0.25), 2)), btVector3(0, btScalar(0.25), 0));
    btBoxShape* box = w.objects.box(btVector3(btScalar(0.2), btScalar(0.2), btScalar(0.2)));
    for (int i = 0; i < 100; ++i) {
      for (int row = 0; row < 2; ++row) {
        boxes.push_back(w.objects.add(1, box, btVector3(btScalar(i - 49.5), btScalar(0.71), btScalar(row ? 1 : -1))));
      }
    }
  }
};

// 200 constraints on one moving body: more than there are parallel colours.
TEST(LongPlank, Carries200Boxes) {
  Plank<btGpuDynamicsWorld> gpu;
  Plank<btDiscreteDynamicsWorld> stock;
  gpu.w.run(240);
  stock.w.run(240);
  EXPECT_GT(gpu.w.world.statistics().m_contactPoints, 800u);
  const auto& p = gpu.plank->getWorldTransform();
  EXPECT_NEAR(double(p.getOrigin().y()), double(stock.plank->getWorldTransform().getOrigin().y()), 0.01);
  EXPECT_GT(double(p.getBasis()[1][1]), 0.9999) << "the plank should lie flat";
  for (size_t i = 0; i < gpu.boxes.size(); ++i) {
    EXPECT_NEAR(double(gpu.boxes[i]->getWorldTransform().getOrigin().y()),
                double(stock.boxes[i]->getWorldTransform().getOrigin().y()), 0.01)
        << "box " << i;
  }
  expectAllOnDevice(gpu.w.world);
}

template <typename World>
struct Platform {
  WorldOf<World> w;
  btRigidBody *platform, *box;

  Platform() {
    w.world.setGravity(btVector3(0, -10, 0));
    platform = w.objects.add(0, w.objects.box(btVector3(5, btScalar(0.5), 5)), btVector3(0, btScalar(-0.5), 0));
    w.world.removeRigidBody(platform);
    platform->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    platform->setActivationState(DISABLE_DEACTIVATION);
    w.world.addRigidBody(platform);
    box = w.objects.add(1, w.objects.box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5))),
                        btVector3(0, btScalar(0.5), 0));
    box->setFriction(1);
    platform->setFriction(1);
  }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) {
      // Speeds up gently to 2 units a second, slower than friction could carry.
      const btScalar speed = btScalar(2.0 * std::min(1.0, i / 60.0));
      btTransform t = platform->getWorldTransform();
      t.getOrigin() += btVector3(speed / 60, 0, 0);
      platform->setWorldTransform(t);
      w.run(1);
    }
  }
};

TEST(KinematicPlatform, CarriesABox) {
  Platform<btGpuDynamicsWorld> gpu;
  Platform<btDiscreteDynamicsWorld> stock;
  gpu.run(240);
  stock.run(240);
  const double travelled = double(gpu.platform->getWorldTransform().getOrigin().x());
  ASSERT_GT(travelled, 6);
  EXPECT_NEAR(double(gpu.box->getWorldTransform().getOrigin().x()),
              double(stock.box->getWorldTransform().getOrigin().x()), 0.01);
  EXPECT_NEAR(double(gpu.box->getWorldTransform().getOrigin().x()), travelled, 0.2);
  EXPECT_NEAR(double(gpu.box->getLinearVelocity().x()), 2, 0.05);
  expectAllOnDevice(gpu.w.world);
}

}  // namespace
}  // namespace btgpu::test
