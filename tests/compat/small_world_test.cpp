// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Small worlds: on stock's own path, bit by bit, until they have grown; and never while somebody looks at the device.
#include "tests/support/facade_world.h"
#include "tests/support/scoped_environment.h"

namespace btgpu::test {
namespace {

btGpuSettings limitedTo(int manifolds) {
  btGpuSettings settings;
  settings.m_smallWorld = manifolds;
  return settings;
}

template <typename World>
struct Pile {
  WorldOf<World> w;
  btCollisionShape* box = w.objects.box(btVector3(1, 1, 1));
  std::vector<btRigidBody*> boxes;

  template <typename... Settings>
  explicit Pile(const Settings&... settings) : w(settings...) {
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  }
  // Side by side on the plane, each a manifold.
  void grow(int count) {
    for (int i = 0; i < count; ++i) {
      const auto n = static_cast<btScalar>(boxes.size());
      boxes.push_back(w.objects.add(1, box, btVector3(3 * n, btScalar(0.98), 0)));
    }
  }
  void shrinkTo(size_t count) {
    for (; boxes.size() > count; boxes.pop_back()) w.world.removeRigidBody(boxes.back());
  }
};

using GpuPile = Pile<btGpuDynamicsWorld>;

TEST(SmallWorld, StepsAsStockBitByBit) {
  GpuPile gpu(limitedTo(30));
  Pile<btDiscreteDynamicsWorld> stock;
  gpu.grow(5);
  stock.grow(5);
  gpu.w.run(40);
  stock.w.run(40);
  const btGpuStatistics s = gpu.w.world.statistics();
  EXPECT_EQ(s.m_smallSteps, 40u);
  EXPECT_EQ(s.m_stockSteps, 40u);
  EXPECT_EQ(s.m_deviceSteps, 0u);
  EXPECT_EQ(s.m_device, "");
  EXPECT_TRUE(gpu.w.world.fallbackReport().empty());  // nothing that a device could not do
  for (size_t i = 0; i < 5; ++i) expectSame(stateOf(*gpu.boxes[i]), stateOf(*stock.boxes[i]), std::to_string(i));
}

// Of the first step nothing is known but the bodies: they count as a pile, three manifolds each.
TEST(SmallWorld, TheFirstStepGoesByBodies) {
  GpuPile below(limitedTo(30)), above(limitedTo(30));
  below.grow(9);  // 27 manifolds and a body's worth
  above.grow(10);
  below.w.run(1);
  above.w.run(1);
  EXPECT_EQ(below.w.world.statistics().m_deviceSteps, 0u);
  EXPECT_EQ(above.w.world.statistics().m_deviceSteps, 1u);
}

TEST(SmallWorld, GrowsOntoTheDeviceAndBack) {
  GpuPile pile(limitedTo(20));
  btGpuDynamicsWorld& world = pile.w.world;
  pile.grow(6);
  pile.w.run(20);
  EXPECT_EQ(world.statistics().m_deviceSteps, 0u);
  const btScalar impulse = world.getDispatcher()->getManifoldByIndexInternal(0)->getContactPoint(0).getAppliedImpulse();
  EXPECT_GT(impulse, 0);
  pile.grow(14);  // 20 manifolds and 2 for the bodies, one step later
  pile.w.run(20);
  EXPECT_EQ(world.statistics().m_smallSteps, 21u);
  EXPECT_EQ(world.statistics().m_deviceSteps, 19u);
  EXPECT_EQ(world.getDispatcher()->getNumManifolds(), 20);
  pile.shrinkTo(12);  // 12 and 1: not half as small
  pile.w.run(10);
  EXPECT_EQ(world.statistics().m_deviceSteps, 29u);
  pile.shrinkTo(6);
  pile.w.run(10);
  EXPECT_EQ(world.statistics().m_deviceSteps, 30u);  // one more, after which there are as few manifolds
  EXPECT_EQ(world.statistics().m_smallSteps, 30u);
  // It stayed at rest all the time: impulses came along.
  for (const btRigidBody* box : pile.boxes) {
    EXPECT_LT(double(box->getLinearVelocity().length()), 1e-3);
    EXPECT_NEAR(double(box->getWorldTransform().getOrigin().y()), 0.98, 0.02);
  }
}

// The manifolds of sleepers count, though no solver sees them: a pile that falls asleep stays on its path.
TEST(SmallWorld, SleepersStayWhereTheyAre) {
  GpuPile pile(limitedTo(20));
  pile.grow(30);
  for (btRigidBody* box : pile.boxes) box->forceActivationState(ISLAND_SLEEPING);
  pile.w.run(10);
  EXPECT_EQ(pile.w.world.statistics().m_deviceSteps, 10u);
}

void expectOnDevice(const btGpuSettings& settings, const char* what) {
  GpuPile pile(settings);
  pile.grow(2);
  pile.w.run(2);
  EXPECT_EQ(pile.w.world.statistics().m_deviceSteps, 2u) << what;
}

TEST(SmallWorld, NotWhileSomebodyLooks) {
  const ScopedVariable limit("BTGPU_SMALL_WORLD", "1000");
  GpuPile pile{btGpuSettings()};
  pile.grow(2);
  pile.w.run(2);
  EXPECT_EQ(pile.w.world.statistics().m_smallSteps, 2u);
  expectOnDevice(limitedTo(0), "turned off by setting");
  btGpuSettings settings;
  settings.m_device = "0";
  expectOnDevice(settings, "a device by name");
  settings = {};
  settings.m_crosscheckEvery = 1;
  expectOnDevice(settings, "cross-check");
  settings = {};
  settings.m_profile = true;
  expectOnDevice(settings, "profile");
  settings = {};
  settings.m_keepContacts = true;
  expectOnDevice(settings, "contacts kept");
  settings = {};
  settings.m_hostStages = "80";
  expectOnDevice(settings, "host stages");
  {
    const ScopedVariable off("BTGPU_CROSSCHECK", "0");
    GpuPile stays{btGpuSettings()};
    stays.grow(2);
    stays.w.run(2);
    EXPECT_EQ(stays.w.world.statistics().m_smallSteps, 2u);
  }
  const ScopedVariable crosscheck("BTGPU_CROSSCHECK", "1");
  expectOnDevice({}, "cross-check by the environment");
}

TEST(SmallWorld, Environment) {
  {
    const ScopedVariable never("BTGPU_SMALL_WORLD", "0");
    expectOnDevice({}, "turned off");
  }
  const ScopedVariable nonsense("BTGPU_SMALL_WORLD", "few");
  testing::internal::CaptureStderr();
  GpuPile pile{btGpuSettings()};
  EXPECT_NE(testing::internal::GetCapturedStderr().find("BTGPU_SMALL_WORLD=few"), std::string::npos);
  pile.grow(2);
  pile.w.run(2);
  EXPECT_EQ(pile.w.world.statistics().m_smallSteps, 2u);  // the default
}

TEST(SmallWorld, TakesEffectWithTheSettings) {
  GpuPile pile(limitedTo(0));
  pile.grow(3);
  pile.w.run(3);
  btGpuDynamicsWorld::configure(&pile.w.world, limitedTo(100));
  pile.w.run(3);
  btGpuDynamicsWorld::configure(&pile.w.world, limitedTo(0));
  pile.w.run(3);
  EXPECT_EQ(pile.w.world.statistics().m_deviceSteps, 6u);
  EXPECT_EQ(pile.w.world.statistics().m_smallSteps, 3u);
}

}  // namespace
}  // namespace btgpu::test
