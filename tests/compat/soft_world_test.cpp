// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btGpuSoftRigidDynamicsWorld: on the device while it holds no soft body, and just what btSoftRigidDynamicsWorld is
// with one.
#include "compat/btGpuSoftRigidDynamicsWorld.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

template <typename World>
struct Lab {
  Lab() : dispatcher(&configuration), world(&dispatcher, &broadphase, &solver, &configuration), objects(world) {
    world.setGravity(btVector3(0, -10, 0));
    world.getWorldInfo().m_dispatcher = &dispatcher;
    world.getWorldInfo().m_broadphase = &broadphase;
    world.getWorldInfo().m_gravity = world.getGravity();
    objects.add(0, objects.box(btVector3(20, 1, 20)), btVector3(0, -1, 0));
    btCollisionShape* box = objects.box(btVector3(s(0.5), s(0.5), s(0.5)));
    for (int i = 0; i < 30; ++i) {
      bodies.push_back(objects.add(1, box, btVector3(s(1.5 * (i % 5)), s(0.5 + i / 5), s(0.1 * (i % 3)))));
    }
  }
  ~Lab() {
    if (rope) removeRope();
  }
  void addRope() {
    rope = btSoftBodyHelpers::CreateRope(world.getWorldInfo(), btVector3(-3, 5, 0), btVector3(3, 5, 0), 8, 1);
    world.addSoftBody(rope);
  }
  void removeRope() {
    world.removeSoftBody(rope);
    delete rope;
    rope = nullptr;
  }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) world.stepSimulation(s(1.0 / 60), 0);
  }
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  World world;
  scenes::Objects objects;
  std::vector<btRigidBody*> bodies;
  btSoftBody* rope = nullptr;
};

using Stock = Lab<btSoftRigidDynamicsWorld>;
using Gpu = Lab<btGpuSoftRigidDynamicsWorld>;

TEST(SoftWorld, OnTheDeviceWithoutSoftBodies) {
  Stock stock;
  Gpu gpu;
  stock.run(60);
  gpu.run(60);
  for (size_t i = 0; i < gpu.bodies.size(); ++i) {
    EXPECT_LE(
        distance(gpu.bodies[i]->getWorldTransform().getOrigin(), stock.bodies[i]->getWorldTransform().getOrigin()),
        0.02)
        << i;
  }
  EXPECT_EQ(gpu.world.statistics().m_deviceSteps, 60u);
  EXPECT_TRUE(gpu.world.fallbackReport().empty());
  EXPECT_EQ(gpu.world.getWorldType(), BT_SOFT_RIGID_DYNAMICS_WORLD);
  std::vector<btGpuRayHit> hits;
  gpu.world.rayTestBatch({btGpuRay{btVector3(0, 20, 0), btVector3(0, -20, 0)}}, hits);
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_NE(hits[0].m_collisionObject, nullptr);
}

TEST(SoftWorld, ExactlyAsStockWithASoftBody) {
  Stock stock;
  Gpu gpu;
  const auto run = [](auto& lab) {
    lab.addRope();
    lab.run(30);
    std::vector<btVector3> nodes;
    for (int i = 0; i < lab.rope->m_nodes.size(); ++i) nodes.push_back(lab.rope->m_nodes[i].m_x);
    return nodes;
  };
  EXPECT_TRUE(run(gpu) == run(stock)) << "the rope's nodes";
  for (size_t i = 0; i < gpu.bodies.size(); ++i) {
    expectSame(stateOf(*gpu.bodies[i]), stateOf(*stock.bodies[i]), "body " + std::to_string(i));
  }
  EXPECT_EQ(gpu.world.statistics().m_stockSteps, 30u);
  ASSERT_EQ(gpu.world.fallbackReport().size(), 1u);
  EXPECT_EQ(gpu.world.fallbackReport()[0].m_what, "soft body");
  gpu.removeRope();
  gpu.run(5);
  EXPECT_EQ(gpu.world.statistics().m_deviceSteps, 5u);
}

// As six of the surveyed engines do: a class of their own on top.
TEST(SoftWorld, Derived) {
  class Own : public btGpuSoftRigidDynamicsWorld {
   public:
    using btGpuSoftRigidDynamicsWorld::btGpuSoftRigidDynamicsWorld;
    void solveConstraints(btContactSolverInfo& info) override { btGpuSoftRigidDynamicsWorld::solveConstraints(info); }
  };
  Lab<Own> lab;
  lab.run(3);
  ASSERT_EQ(lab.world.fallbackReport().size(), 1u);
  EXPECT_EQ(lab.world.fallbackReport()[0].m_what, "world");
  EXPECT_EQ(lab.world.statistics().m_stockSteps, 3u);
}

}  // namespace
}  // namespace btgpu::test
