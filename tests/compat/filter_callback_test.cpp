// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btOverlapFilterCallback: the application decides which pairs may collide, in place of groups and masks. It is asked
// by the host's broadphase, and the device collides what it let through.
#include <map>
#include <memory>
#include <set>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

constexpr const char* kShare = "overlap filter callback";

btScalar s(double v) { return static_cast<btScalar>(v); }

int indexOf(const btBroadphaseProxy* proxy) {
  return static_cast<const btCollisionObject*>(proxy->m_clientObject)->getCollisionShape()->getUserIndex();
}

// Bodies whose shapes have one user index pass through each other, but for 0, which meets all: whatever groups and
// masks say.
struct ByIndex : btOverlapFilterCallback {
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    asked.insert(std::minmax(a->m_uniqueId, b->m_uniqueId));
    return indexOf(a) != indexOf(b) || indexOf(a) == 0;
  }
  mutable std::set<std::pair<int, int>> asked;
};

// Columns of boxes over a floor; boxes of one index are on top of each other in every other column. `compounds`: of two
// boxes each.
template <typename World>
struct Columns {
  explicit Columns(bool filtered, bool compounds = false) {
    if (filtered) w.world.getPairCache()->setOverlapFilterCallback(&filter);
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, shape(0, btVector3(40, 1, 40), false), btVector3(0, -1, 0));
    for (int column = 0; column < 6; ++column) {
      for (int level = 0; level < 4; ++level) {
        const int index = column % 2 ? 7 : 1 + level;
        bodies.push_back(w.objects.add(1, shape(index, btVector3(s(0.5), s(0.5), s(0.5)), compounds),
                                       btVector3(s(2.0 * column), s(0.5 + level), 0)));
      }
    }
    // A mask that lets the floor through: the callback does not.
    if (filtered) bodies.back()->getBroadphaseHandle()->m_collisionFilterMask = 0;
  }
  btCollisionShape* shape(int index, const btVector3& half, bool compound) {
    btCollisionShape* made;
    if (compound) {
      auto* two = w.objects.template shape<btCompoundShape>();
      const btVector3 quarter = half * btVector3(s(0.5), 1, 1);
      for (const int side : {-1, 1}) {
        two->addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(quarter.x() * s(side), 0, 0)),
                           w.objects.box(quarter));
      }
      made = two;
    } else {
      made = w.objects.template shape<btBoxShape>(half);
    }
    made->setUserIndex(index);
    return made;
  }
  ByIndex filter;
  World w;
  std::vector<btRigidBody*> bodies;
};

void expectSameHeights(const Columns<GpuWorld>& gpu, const Columns<StockWorld>& stock) {
  for (size_t i = 0; i < gpu.bodies.size(); ++i) {
    const btVector3 a = gpu.bodies[i]->getWorldTransform().getOrigin();
    const btVector3 b = stock.bodies[i]->getWorldTransform().getOrigin();
    EXPECT_NEAR(double(a.y()), double(b.y()), 0.02) << "body " << i;
  }
}

class FilterCallback : public ::testing::TestWithParam<bool> {};

TEST_P(FilterCallback, CollidesWhatItLetsThrough) {
  Columns<GpuWorld> gpu(true, GetParam());
  Columns<StockWorld> stock(true, GetParam());
  gpu.w.run(60);
  stock.w.run(60);
  expectSameHeights(gpu, stock);
  // It matters: boxes of a column of one index lie in each other, others on top.
  EXPECT_LT(double(gpu.bodies[7]->getWorldTransform().getOrigin().y()), 1.0);
  EXPECT_GT(double(gpu.bodies[3]->getWorldTransform().getOrigin().y()), 3.0);
  EXPECT_EQ(gpu.filter.asked, stock.filter.asked) << "the same pairs are asked for";
  expectAllOnDevice(gpu.w.world, {kShare});
  EXPECT_EQ(reported(gpu.w.world, kShare).m_count, 60u);
}
INSTANTIATE_TEST_SUITE_P(Shapes, FilterCallback, ::testing::Bool(),
                         [](const auto& p) { return p.param ? "Compounds" : "Boxes"; });

TEST(FilterCallbackTest, WithoutHostQueries) {
  Columns<GpuWorld> gpu(true);
  Columns<StockWorld> stock(true);
  btGpuSettings settings;
  settings.m_hostQueries = settings.m_contacts = false;
  btGpuDynamicsWorld::configure(&gpu.w.world, settings);
  gpu.w.run(60);
  stock.w.run(60);
  expectSameHeights(gpu, stock);
  expectAllOnDevice(gpu.w.world, {kShare});
}

// Pairs that are already there stay in stock until they part; new ones are asked for.
TEST(FilterCallbackTest, SetAndTakenAway) {
  Columns<GpuWorld> gpu(false);
  Columns<StockWorld> stock(false);
  const auto run = [](auto& columns) {
    columns.w.run(5);
    columns.w.world.getPairCache()->setOverlapFilterCallback(&columns.filter);
    columns.w.run(20);
    columns.w.world.getPairCache()->setOverlapFilterCallback(nullptr);
    columns.w.run(20);
  };
  run(gpu);
  run(stock);
  expectSameHeights(gpu, stock);
  EXPECT_EQ(gpu.filter.asked, stock.filter.asked);
  expectAllOnDevice(gpu.w.world, {kShare});
  EXPECT_EQ(reported(gpu.w.world, kShare).m_count, 20u);
}

// A kinematic body wakes what it has a manifold with; a pair that was never let through has none, in no step.
TEST(FilterCallbackTest, WhatIsKeptApartIsNotWoken) {
  const auto run = [](auto& w, int index) {
    ByIndex filter;
    w.world.getPairCache()->setOverlapFilterCallback(&filter);
    const auto box = [&](int userIndex) {
      btCollisionShape* shape = w.objects.box(btVector3(1, 1, 1));
      shape->setUserIndex(userIndex);
      return shape;
    };
    btRigidBody* waker = w.objects.add(0, box(7), btVector3(0, 0, 0));
    w.world.removeRigidBody(waker);
    waker->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    waker->setActivationState(DISABLE_DEACTIVATION);
    w.world.addRigidBody(waker);
    btRigidBody* sleeper = w.objects.add(1, box(index), btVector3(0, s(1.5), 0));
    w.run(2);  // both worlds know the pair
    sleeper->forceActivationState(ISLAND_SLEEPING);
    w.run(2);
    w.world.getPairCache()->setOverlapFilterCallback(nullptr);
    return sleeper->getActivationState();
  };
  for (const int index : {7, 8}) {
    GpuWorld gpu;
    StockWorld stock;
    const int expected = run(stock, index);
    EXPECT_EQ(expected, index == 7 ? ISLAND_SLEEPING : ACTIVE_TAG);
    EXPECT_EQ(run(gpu, index), expected) << index;
    expectAllOnDevice(gpu.world, {kShare});
  }
}

// Bodies that also must not collide by setIgnoreCollisionCheck.
TEST(FilterCallbackTest, WithIgnoredPairs) {
  Columns<GpuWorld> gpu(true);
  Columns<StockWorld> stock(true);
  const auto run = [](auto& columns) {
    for (size_t i = 1; i < 4; ++i) columns.bodies[0]->setIgnoreCollisionCheck(columns.bodies[i], true);
    columns.w.run(60);
  };
  run(gpu);
  run(stock);
  expectSameHeights(gpu, stock);
  EXPECT_LT(double(gpu.bodies[1]->getWorldTransform().getOrigin().y()), 1.0);
  expectAllOnDevice(gpu.w.world, {kShare});
}

// What the callback refuses is no pair any more once the broadphase has asked again, and its contacts are gone; a pair
// that it lets through, but that is told to ignore each other, keeps those that it has. As in stock.
TEST(FilterCallbackTest, RefusedPairsForgetTheirContacts) {
  struct Refusing : btOverlapFilterCallback {
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
      return a != refused && b != refused;
    }
    const btBroadphaseProxy* refused = nullptr;
  };
  struct Scene {
    btRigidBody *refused, *ignoring, *other;
  };
  const auto run = [](auto& w, Refusing& filter) {
    w.world.setGravity(btVector3(0, -10, 0));
    btRigidBody* floor =
        w.objects.add(0, const_cast<btStaticPlaneShape*>(w.objects.plane(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0));
    btCollisionShape* box = w.objects.box(btVector3(s(0.5), s(0.5), s(0.5)));
    const Scene scene{w.objects.add(1, box, btVector3(0, s(0.5), 0)), w.objects.add(1, box, btVector3(3, s(0.5), 0)),
                      w.objects.add(1, box, btVector3(6, s(0.5), 0))};
    for (btRigidBody* body : {scene.refused, scene.ignoring, scene.other}) {
      body->setActivationState(DISABLE_DEACTIVATION);
      // Friction's direction follows a slip of nothing but rounding, which double worlds know from less than the device.
      body->setFriction(0);
    }
    w.run(20);
    filter.refused = scene.refused->getBroadphaseHandle();
    w.world.getPairCache()->setOverlapFilterCallback(&filter);
    w.world.getPairCache()->removeOverlappingPairsContainingProxy(scene.refused->getBroadphaseHandle(), &w.dispatcher);
    scene.ignoring->setIgnoreCollisionCheck(floor, true);
    w.run(30);
    return scene;
  };
  Refusing ofGpu, ofStock;
  GpuWorld gpu;
  StockWorld stock;
  btGpuSettings settings;
  settings.m_crosscheckEvery = 1;
  btGpuDynamicsWorld::configure(&gpu.world, settings);
  const Scene ours = run(gpu, ofGpu), theirs = run(stock, ofStock);
  const auto height = [](const btRigidBody* body) { return double(body->getWorldTransform().getOrigin().y()); };
  EXPECT_LT(height(theirs.refused), -0.5) << "it falls through the floor";
  EXPECT_NEAR(height(ours.refused), height(theirs.refused), 1e-3) << "it rested within the slop";
  EXPECT_NEAR(height(theirs.ignoring), 0.5, 0.01) << "it is held by the contacts that it had";
  EXPECT_NEAR(height(ours.ignoring), height(theirs.ignoring), 1e-3);
  EXPECT_NEAR(height(ours.other), height(theirs.other), 1e-3);
  EXPECT_EQ(gpu.world.crosscheck().m_failedSteps, 0u);
  // A check that begins in the middle knows no contacts of pairs that it has not seen collide.
  settings.m_crosscheckOtherDepths = 1e-9;
  btGpuDynamicsWorld::configure(&gpu.world, settings);
  gpu.run(3);
  EXPECT_EQ(gpu.world.crosscheck().m_failedSteps, 0u);
  expectAllOnDevice(gpu.world, {kShare});
}

}  // namespace
}  // namespace btgpu::test
