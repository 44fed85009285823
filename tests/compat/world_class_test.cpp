// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The class itself: its size, constructors and settings, and how a world may live and die.
#include <cstdlib>
#include <new>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

// A box that falls on a floor, in any world.
struct FallingBox {
  scenes::Objects objects;
  btRigidBody* box;

  explicit FallingBox(btDiscreteDynamicsWorld& world, double height = 2) : objects(world) {
    world.setGravity(btVector3(0, -10, 0));
    objects.add(0, objects.box(btVector3(10, 1, 10)), btVector3(0, -1, 0));
    box = objects.add(1, objects.box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5))),
                      btVector3(0, btScalar(height), 0));
  }
  double height() const { return double(box->getWorldTransform().getOrigin().y()); }
};

// Dispatcher and so on for a world that a test makes itself.
struct Parts {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
};

void step(btDiscreteDynamicsWorld& world, int steps) {
  for (int i = 0; i < steps; ++i) world.stepSimulation(btScalar(1.0 / 60), 0);
}

TEST(WorldClass, IsAsLargeAsItsBase) {
  EXPECT_EQ(sizeof(btGpuDynamicsWorld), sizeof(btDiscreteDynamicsWorld));
  EXPECT_EQ(alignof(btGpuDynamicsWorld), alignof(btDiscreteDynamicsWorld));
  // Debian's Bullet 3.24, as compiled into applications.
  EXPECT_EQ(sizeof(btGpuDynamicsWorld), sizeof(btScalar) == 4 ? 512u : 672u);
}

TEST(WorldClass, IsABulletWorld) {
  Parts parts;
  btGpuDynamicsWorld world(&parts.dispatcher, &parts.broadphase, &parts.solver, &parts.configuration);
  btDynamicsWorld* base = &world;
  EXPECT_EQ(base->getWorldType(), BT_DISCRETE_DYNAMICS_WORLD);
  EXPECT_EQ(base->getConstraintSolver(), &parts.solver);
  EXPECT_EQ(base->getDispatcher(), &parts.dispatcher);
}

// Without a solver Bullet's constructor makes one of its own; without bodies there is nothing to do.
TEST(WorldClass, OwnSolverAndEmptyWorld) {
  Parts parts;
  btGpuDynamicsWorld world(&parts.dispatcher, &parts.broadphase, nullptr, &parts.configuration);
  step(world, 2);
  expectAllOnDevice(world);
  const FallingBox scene(world);
  step(world, 2);
  expectAllOnDevice(world);
  EXPECT_EQ(world.statistics().m_deviceSteps, 4u);
  EXPECT_LT(scene.height(), 2);
}

TEST(WorldClass, SettingsByConstructor) {
  btGpuSettings settings;
  settings.m_stockOnly = true;
  GpuWorld w(settings);
  StockWorld stock;
  const FallingBox a(w.world), b(stock.world);
  w.run(30);
  stock.run(30);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 0u);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 30u);
  EXPECT_EQ(reported(w.world, "device").m_count, 30u) << reportText(w.world);
  EXPECT_EQ(w.world.statistics().m_device, "");
  expectSame(stateOf(*a.box), stateOf(*b.box), "box");
}

TEST(WorldClass, ConfigureTakesEffectWithTheNextStep) {
  GpuWorld w;
  const FallingBox scene(w.world);
  w.run(10);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 10u);
  EXPECT_NE(w.world.statistics().m_device, "");
  btGpuSettings settings;
  settings.m_stockOnly = true;
  btGpuDynamicsWorld::configure(&w.world, settings);
  w.run(10);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 10u);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 10u);
  settings.m_stockOnly = false;
  btGpuDynamicsWorld::configure(&w.world, settings);
  w.run(10);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 20u);
}

TEST(WorldClass, ChangeOfDeviceKeepsTheBodies) {
  GpuWorld w;
  StockWorld stock;
  const FallingBox a(w.world, 5), b(stock.world, 5);
  w.run(10);
  btGpuSettings settings;
  settings.m_device = "0";  // the same device by another name: to the world it is another engine
  btGpuDynamicsWorld::configure(&w.world, settings);
  w.run(10);
  stock.run(20);
  expectAllOnDevice(w.world);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 20u);
  expectNear(stateOf(*a.box), stateOf(*b.box), floatNoise(20, 5), "box");
}

// A device that is not there means the stock path; another choice is tried with the next step.
TEST(WorldClass, DeviceThatIsNotThere) {
  btGpuSettings settings;
  settings.m_device = "no such device";
  GpuWorld w(settings);
  const FallingBox scene(w.world);
  testing::internal::CaptureStderr();
  w.run(3);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
  EXPECT_NE(said.find("no such device"), std::string::npos) << said;
  EXPECT_EQ(reported(w.world, "device").m_count, 3u);
  btGpuDynamicsWorld::configure(&w.world, btGpuSettings());
  w.run(3);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 3u);
}

// Applications delete what belongs to a world in any order; with bodies still in its arrays Bullet's own
// destructor would follow their pointers, so those who delete bodies first empty the arrays (VDrift does).
TEST(WorldClass, DestroyedLast) {
  auto parts = std::make_unique<Parts>();
  auto* world = new btGpuDynamicsWorld(&parts->dispatcher, &parts->broadphase, &parts->solver, &parts->configuration);
  auto* shape = new btBoxShape(btVector3(1, 1, 1));
  std::vector<btRigidBody*> bodies;
  for (int i = 0; i < 4; ++i) {
    btRigidBody::btRigidBodyConstructionInfo info(btScalar(i), nullptr, shape, btVector3(1, 1, 1));
    info.m_startWorldTransform.setOrigin(btVector3(0, btScalar(1.9 * i), 0));
    bodies.push_back(new btRigidBody(info));
    world->addRigidBody(bodies.back());
  }
  step(*world, 5);
  expectAllOnDevice(*world);
  world->getCollisionObjectArray().clear();
  for (btRigidBody* body : bodies) delete body;
  delete shape;
  parts.reset();
  delete world;
}

// A new world at the address of one that died without its destructor (as worlds in a program's own pools do):
// it must know nothing of the old one.
TEST(WorldClass, NewWorldAtTheSameAddress) {
  alignas(btGpuDynamicsWorld) static unsigned char place[sizeof(btGpuDynamicsWorld)];
  Parts parts;
  auto* first =
      new (place) btGpuDynamicsWorld(&parts.dispatcher, &parts.broadphase, &parts.solver, &parts.configuration);
  {
    btGpuSettings settings;
    settings.m_stockOnly = true;
    FallingBox scene(*first);
    step(*first, 30);
    btGpuDynamicsWorld::configure(first, settings);
    step(*first, 3);
    EXPECT_EQ(first->statistics().m_stockSteps, 3u);
  }
  first->btDiscreteDynamicsWorld::~btDiscreteDynamicsWorld();  // ours does not run

  Parts newParts;
  auto* second = new (place)
      btGpuDynamicsWorld(&newParts.dispatcher, &newParts.broadphase, &newParts.solver, &newParts.configuration);
  EXPECT_EQ(second->statistics().m_deviceSteps, 0u);
  EXPECT_TRUE(second->fallbackReport().empty()) << reportText(*second);
  StockWorld stock;
  {
    const FallingBox a(*second, 3), b(stock.world, 3);
    step(*second, 20);
    stock.run(20);
    expectAllOnDevice(*second);
    EXPECT_EQ(second->statistics().m_deviceSteps, 20u);
    expectNear(stateOf(*a.box), stateOf(*b.box), floatNoise(20, 5), "box");
  }
  second->~btGpuDynamicsWorld();
}

// The same through the ordinary life of a world.
TEST(WorldClass, ManyWorldsOneAfterTheOther) {
  alignas(btGpuDynamicsWorld) static unsigned char place[sizeof(btGpuDynamicsWorld)];
  for (int i = 0; i < 5; ++i) {
    Parts parts;
    auto* world =
        new (place) btGpuDynamicsWorld(&parts.dispatcher, &parts.broadphase, &parts.solver, &parts.configuration);
    {
      const FallingBox scene(*world, 1 + i);
      step(*world, 2);
      EXPECT_EQ(world->statistics().m_deviceSteps, 2u);
      EXPECT_NEAR(scene.height(), 1 + i, 0.01) << "world " << i;
    }
    world->~btGpuDynamicsWorld();
  }
}

TEST(WorldClass, TwoWorldsAtOnce) {
  GpuWorld left, right;
  StockWorld stockLeft, stockRight;
  const FallingBox a(left.world, 2), b(right.world, 6), c(stockLeft.world, 2), d(stockRight.world, 6);
  for (int i = 0; i < 25; ++i) {
    left.run(1);
    if (i % 2) right.run(1);
    stockLeft.run(1);
    if (i % 2) stockRight.run(1);
  }
  expectNear(stateOf(*a.box), stateOf(*c.box), floatNoise(25, 5), "left");
  expectNear(stateOf(*b.box), stateOf(*d.box), floatNoise(25, 6), "right");
  expectAllOnDevice(left.world);
  expectAllOnDevice(right.world);
}

}  // namespace
}  // namespace btgpu::test
