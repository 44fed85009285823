// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// When things fall asleep, and what wakes up.
#include <algorithm>
#include <numeric>
#include <random>
#include <set>

#include "samples/scenes/parts.h"
#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 vec(double x, double y, double z) { return {s(x), s(y), s(z)}; }

template <typename World>
std::vector<btRigidBody*> moving(WorldOf<World>& w) {
  std::vector<btRigidBody*> bodies;
  for (btRigidBody* body : w.objects.bodies()) {
    if (!body->isStaticOrKinematicObject()) bodies.push_back(body);
  }
  return bodies;
}

// Of each body, the step in which it fell asleep for good; `steps` if it did not.
template <typename World>
std::vector<int> fallAsleep(WorldOf<World>& w, const std::vector<btRigidBody*>& bodies, int steps) {
  std::vector<int> asleep(bodies.size(), steps);
  for (int step = 0; step < steps; ++step) {
    w.run(1);
    bool all = true;
    for (size_t i = 0; i < bodies.size(); ++i) {
      if (bodies[i]->isActive()) asleep[i] = steps;
      if (!bodies[i]->isActive() && asleep[i] == steps) asleep[i] = step;
      all = all && asleep[i] < steps;
    }
    if (all) break;
  }
  return asleep;
}

double mean(const std::vector<int>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

// When a stack falls asleep is chance: eight runs of stock, from starts that differ by a millionth, take 257 to 325
// steps. So the means of several are compared, which are off by 9 % at most: three standard errors of a difference.
template <typename World>
std::vector<int> stacksFallAsleep() {
  std::vector<int> all;
  for (int run = 0; run < 8; ++run) {
    WorldOf<World> w;
    scenes::find("stack")->build(w.objects, {6, 6, 6});
    const auto bodies = moving(w);
    for (size_t i = 0; i < bodies.size(); ++i) bodies[i]->translate(vec(0, 1e-6 * run * double(i % 7), 0));
    const std::vector<int> asleep = fallAsleep(w, bodies, 900);
    all.insert(all.end(), asleep.begin(), asleep.end());
  }
  return all;
}

TEST(FallingAsleep, StackTakesAsLongAsStocks) {
  const double ours = mean(stacksFallAsleep<btGpuDynamicsWorld>()),
               stock = mean(stacksFallAsleep<btDiscreteDynamicsWorld>());
  ASSERT_LT(stock, 500) << "stock's stacks stayed awake";
  EXPECT_NEAR(ours, stock, 0.2 * stock);
  RecordProperty("ours", std::to_string(ours));
  RecordProperty("stock", std::to_string(stock));
}

// A hundred ragdolls, each by itself: a heap of them is one island, which sleeps when all of it happens to be slow at
// once; that of scene `ragdolls` never is, neither in stock nor here, in 8,000 steps.
template <typename World>
std::vector<int> ragdollsFallAsleep() {
  WorldOf<World> w;
  scenes::addFloor(w.objects);
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    scenes::addRagdoll(w.objects, vec(5 * (i % 10), 0.6, 5 * (i / 10)), scenes::randomRotation(random),
                       scenes::Limbs::Boxes);
  }
  return fallAsleep(w, moving(w), 900);
}

TEST(FallingAsleep, RagdollsTakeAsLongAsStocks) {
  const double ours = mean(ragdollsFallAsleep<btGpuDynamicsWorld>()),
               stock = mean(ragdollsFallAsleep<btDiscreteDynamicsWorld>());
  ASSERT_LT(stock, 400) << "stock's ragdolls stayed awake";
  EXPECT_NEAR(ours, stock, 0.2 * stock);
  RecordProperty("ours", std::to_string(ours));
  RecordProperty("stock", std::to_string(stock));
}

// ---- waking up

// Islands more than the broadphase's margin apart (docs/decisions/0004-pairs-without-margin.md): a wall of 1,000
// bricks, a chain of links that don't touch, whose middle joint is disabled, two piles on one static table, a ball that
// hangs from the world next to one that does not.
template <typename World>
struct Islands {
  WorldOf<World> w;
  std::vector<btRigidBody*> wall, chain, piles[2], balls;
  std::vector<btRigidBody*> all;

  Islands() {
    auto& o = w.objects;
    w.world.setGravity(vec(0, -10, 0));
    o.add(0, o.box(vec(200, 5, 200)), vec(0, -5, 0));
    btBoxShape* brick = o.box(vec(0.5, 0.25, 0.5));
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 50; ++x)
        wall.push_back(o.add(1, brick, vec(1.001 * x + (y % 2 ? 0.5 : 0), 0.25 + 0.5 * y, 0)));
    }
    for (int i = 0; i < 8; ++i) chain.push_back(o.add(1, brick, vec(3 * i, 0.25, 20)));
    for (int i = 0; i < 7; ++i) {
      const btVector3 half = vec(1.5, 0, 0);
      btTransform a = btTransform::getIdentity(), b = a;
      a.setOrigin(half);
      b.setOrigin(-half);
      o.template joint<btFixedConstraint>(false, *chain[size_t(i)], *chain[size_t(i + 1)], a, b)->setEnabled(i != 3);
    }
    o.add(0, o.box(vec(3, 0.5, 3)), vec(0, 0.5, 40));
    for (int k = 0; k < 2; ++k) {
      for (int i = 0; i < 3; ++i) piles[k].push_back(o.add(1, brick, vec(-1.5 + 3 * k, 1.25 + 0.5 * i, 40)));
    }
    btSphereShape* ball = o.sphere(s(0.4));
    for (int i = 0; i < 2; ++i) balls.push_back(o.add(1, ball, vec(2 * i, 0.4, 60)));
    o.template joint<btPoint2PointConstraint>(false, *balls[0], vec(0, 1, 0));
    all = moving(w);
  }
  // What is awake at any time in the steps after a ball has been dropped beside the middle of a body.
  std::set<size_t> wakenBy(const btRigidBody& hit, bool& slept) {
    const std::vector<int> asleep = fallAsleep(w, all, 600);
    slept = *std::max_element(asleep.begin(), asleep.end()) < 600;
    w.run(10);
    btRigidBody* ball =
        w.objects.add(s(0.2), w.objects.sphere(s(0.1)), hit.getWorldTransform().getOrigin() + vec(0.05, 0.8, 0.05));
    std::set<size_t> awake;
    for (int step = 0; step < 40; ++step) {
      w.run(1);
      for (size_t i = 0; i < all.size(); ++i) {
        if (all[i]->isActive()) awake.insert(i);
      }
    }
    EXPECT_GT(double(ball->getLinearVelocity().y()), -1) << "it fell past";
    return awake;
  }
};

struct Hit {
  const char* name;
  int body;  // of `all`
  size_t woken;
};

class WakingUp : public ::testing::TestWithParam<Hit> {
 protected:
  void SetUp() override { gDeactivationTime = s(0.3); }
  void TearDown() override { gDeactivationTime = s(2); }
};

TEST_P(WakingUp, OneHitWakesTheIslandThatStockWakes) {
  Islands<btGpuDynamicsWorld> gpu;
  Islands<btDiscreteDynamicsWorld> stock;
  const auto body = size_t(GetParam().body);
  bool oursSlept = false, stockSlept = false;
  const std::set<size_t> ours = gpu.wakenBy(*gpu.all[body], oursSlept);
  const std::set<size_t> stocks = stock.wakenBy(*stock.all[body], stockSlept);
  ASSERT_TRUE(oursSlept && stockSlept) << "not all fell asleep";
  EXPECT_EQ(ours, stocks);
  EXPECT_EQ(ours.size(), GetParam().woken);
  EXPECT_GT(gpu.w.world.statistics().m_restingSteps, 0u);
  expectAllOnDevice(gpu.w.world, {"joints"});
}

INSTANTIATE_TEST_SUITE_P(Islands, WakingUp,
                         ::testing::Values(Hit{"TopOfWall", 975, 1000}, Hit{"EndOfChain", 1000, 4},
                                           Hit{"OtherEndOfChain", 1007, 4}, Hit{"PileOnTable", 1010, 3},
                                           Hit{"OtherPile", 1013, 3}, Hit{"HangingBall", 1014, 1},
                                           Hit{"FreeBall", 1015, 1}),
                         [](const auto& p) { return std::string(p.param.name); });

}  // namespace
}  // namespace btgpu::test
