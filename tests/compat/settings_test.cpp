// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What contact points, bodies and worlds can have of their own: the steps run on the device, and are stock's.
#include <BulletCollision/CollisionDispatch/btBoxBoxCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>

#include <cmath>
#include <functional>
#include <set>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 v(double x, double y, double z) { return {s(x), s(y), s(z)}; }

// One manifold between a body and one that does not move: both solvers have the same rows in the same order. A row's
// update rounds some 8 times, by half a unit in the size of the speeds; at most 8 rows, 10 iterations; roundings go
// either way. What the steps before were off goes on by the velocity, and contacts give none of it back.
double noiseAfter(int step, double speed) {
  return step * std::sqrt(8.0 * 80) * 0.5 * double(FLT_EPSILON) * speed * (1 + step / 60.0);
}

// A body on a floor, given a push.
template <typename World>
struct Slider : WorldOf<World> {
  explicit Slider(bool ball) {
    this->world.setGravity(v(0, -10, 0));
    auto& o = this->objects;
    floor = o.add(0, o.box(v(20, 1, 20)), v(0, -1, 0));
    body = o.add(2, ball ? static_cast<btCollisionShape*>(o.sphere(s(0.5))) : o.box(v(0.5, 0.25, 0.5)),
                 v(0, ball ? 0.5 : 0.25, 0));
    body->setAngularFactor(0);
    body->setLinearVelocity(v(1, 0, 0.3));
    body->setActivationState(DISABLE_DEACTIVATION);
  }
  double x() const { return double(body->getWorldTransform().getOrigin().x()); }
  btRigidBody *floor, *body;
};

struct Prepared {
  std::function<void(btDiscreteDynamicsWorld&, btRigidBody&)> prepare;
  std::vector<std::string> shares;
};

// Where the body ends, after the steps were stock's one by one.
double expectAsStock(bool ball, const Prepared& what, int steps) {
  Slider<btGpuDynamicsWorld> gpu(ball);
  Slider<btDiscreteDynamicsWorld> stock(ball);
  what.prepare(gpu.world, *gpu.body);
  what.prepare(stock.world, *stock.body);
  for (int step = 1; step <= steps && !testing::Test::HasFailure(); ++step) {
    gpu.run(1);
    stock.run(1);
    expectNear(stateOf(*gpu.body), stateOf(*stock.body), noiseAfter(step, 10), "step " + std::to_string(step));
  }
  expectAllOnDevice(gpu.world, what.shares);
  return gpu.x();
}

// ---- friction anchors, and contact points with CFM, ERP or a motion of their own

TEST(OwnRows, FrictionAnchor) {
  const auto anchor = [](bool on) {
    return Prepared{[on](btDiscreteDynamicsWorld&, btRigidBody& body) {
                      if (on)
                        body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_HAS_FRICTION_ANCHOR);
                    },
                    {}};
  };
  const double held = expectAsStock(true, anchor(true), 60), loose = expectAsStock(true, anchor(false), 60);
  EXPECT_GT(std::fabs(held - loose), 1e-3) << "the anchor should have had an effect";
}

int g_flags;
btScalar g_first, g_second, g_motion;
bool ownPoint(btManifoldPoint& p, const btCollisionObjectWrapper*, int, int, const btCollisionObjectWrapper*, int,
              int) {
  p.m_contactPointFlags |= g_flags;
  if (g_flags & (BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP)) {
    p.m_contactCFM = g_first;
    p.m_contactERP = g_second;
  }
  if (g_flags & BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED) {
    p.m_lateralFrictionDir1 = v(1, 0, 0);
    p.m_lateralFrictionDir2 = v(0, 0, 1);
    p.m_contactMotion1 = g_motion;
    p.m_contactMotion2 = g_motion / 2;
  }
  return true;
}

class OwnPoints : public testing::Test {
 protected:
  OwnPoints() { gContactAddedCallback = ownPoint; }
  ~OwnPoints() override { gContactAddedCallback = nullptr; }
  static Prepared flagged(int solverMode = 0) {
    return {[solverMode](btDiscreteDynamicsWorld& world, btRigidBody& body) {
              world.getSolverInfo().m_solverMode |= solverMode;
              body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
              body.setWorldTransform(btTransform(btQuaternion::getIdentity(), v(0, 0.22, 0)));
            },
            {"gContactAddedCallback"}};
  }
};

TEST_F(OwnPoints, CfmAndErp) {
  std::set<double> ends;
  for (const int flags : {0, int(BT_CONTACT_FLAG_HAS_CONTACT_CFM), int(BT_CONTACT_FLAG_HAS_CONTACT_ERP),
                          BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP}) {
    g_flags = flags;
    g_first = s(0.002);
    g_second = s(0.7);
    ends.insert(expectAsStock(false, flagged(), 30));
  }
  EXPECT_EQ(ends.size(), 4u) << "each should have had an effect";
}

TEST_F(OwnPoints, FrictionAnchor) {
  g_flags = 0;
  Prepared anchored = flagged();
  anchored.prepare = [plain = anchored.prepare](btDiscreteDynamicsWorld& world, btRigidBody& body) {
    plain(world, body);
    body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_HAS_FRICTION_ANCHOR);
  };
  const double held = expectAsStock(false, anchored, 60), loose = expectAsStock(false, flagged(), 60);
  EXPECT_GT(std::fabs(held - loose), 1e-4) << "the anchor should have had an effect";
}

// A conveyor belt.
TEST_F(OwnPoints, Motion) {
  g_flags = BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
  for (const int two : {0, int(SOLVER_USE_2_FRICTION_DIRECTIONS)}) {
    g_motion = s(-1.5);
    const double back = expectAsStock(false, flagged(SOLVER_ENABLE_FRICTION_DIRECTION_CACHING | two), 90);
    g_motion = s(1.5);
    const double on = expectAsStock(false, flagged(SOLVER_ENABLE_FRICTION_DIRECTION_CACHING | two), 90);
    EXPECT_GT(std::fabs(on - back), 1.0) << "the belt should have carried it";
  }
}

// ---- islands that are not split

// A body that falls through a sensor: where islands are not split, stock's solver gets its contacts too.
template <typename World>
struct Sensor : WorldOf<World> {
  explicit Sensor(bool split) {
    this->world.setGravity(v(0, -10, 0));
    this->world.getSimulationIslandManager()->setSplitIslands(split);
    auto& o = this->objects;
    btRigidBody* sensor = o.add(0, o.box(v(2, 1, 2)), v(0, -1, 0));
    sensor->setCollisionFlags(sensor->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
    body = o.add(1, o.sphere(s(0.5)), v(0, 0.6, 0));
    body->setActivationState(DISABLE_DEACTIVATION);
  }
  btRigidBody* body;
};

TEST(Islands, NotSplit) {
  double heights[2];
  for (const bool split : {false, true}) {
    Sensor<btGpuDynamicsWorld> gpu(split);
    Sensor<btDiscreteDynamicsWorld> stock(split);
    for (int step = 1; step <= 60 && !HasFailure(); ++step) {
      gpu.run(1);
      stock.run(1);
      expectNear(stateOf(*gpu.body), stateOf(*stock.body), noiseAfter(step, 10), "step " + std::to_string(step));
    }
    expectAllOnDevice(gpu.world);
    heights[split] = double(gpu.body->getWorldTransform().getOrigin().y());
  }
  EXPECT_GT(heights[false], 0.4);
  EXPECT_LT(heights[true], -1) << "a sensor holds nothing where islands are split";
}

// ---- planes that could move

// Bullet disables what moves and has no bounds.
template <typename World>
struct MovingPlane : WorldOf<World> {
  explicit MovingPlane(bool inCompound) {
    this->world.setGravity(v(0, -10, 0));
    auto& o = this->objects;
    auto* shape = const_cast<btStaticPlaneShape*>(o.plane(v(0, 1, 0), 0));
    compound.addChildShape(btTransform::getIdentity(), shape);
    // Of a compound without bounds Bullet's inertia is beyond floats.
    plane = o.add(50, inCompound ? static_cast<btCollisionShape*>(&compound) : shape, v(0, 0, 0));
    plane->setMassProps(50, v(0, 0, 0));
    ball = o.add(1, o.sphere(s(0.5)), v(0, 0.7, 0));
    ball->setActivationState(DISABLE_DEACTIVATION);
  }
  ~MovingPlane() { this->world.removeRigidBody(plane); }
  btCompoundShape compound;
  btRigidBody *plane, *ball;
};

TEST(MovingPlanes, AreDisabledAsInStock) {
  for (const bool inCompound : {false, true}) {
    SCOPED_TRACE(inCompound);
    MovingPlane<btGpuDynamicsWorld> gpu(inCompound);
    MovingPlane<btDiscreteDynamicsWorld> stock(inCompound);
    for (int step = 1; step <= 60 && !HasFailure(); ++step) {
      gpu.run(1);
      stock.run(1);
      const std::string when = "step " + std::to_string(step);
      expectNear(stateOf(*gpu.ball), stateOf(*stock.ball), noiseAfter(step, 10), when + ", ball");
      expectNear(stateOf(*gpu.plane), stateOf(*stock.plane), noiseAfter(step, 10), when + ", plane");
    }
    EXPECT_EQ(gpu.plane->getActivationState(), DISABLE_SIMULATION);
    EXPECT_NEAR(double(gpu.ball->getWorldTransform().getOrigin().y()), 0.5, 0.05) << "it holds all the same";
    expectAllOnDevice(gpu.world);
  }
}

// ---- the application's near callback and algorithms

int g_calls;
btCollisionObject* g_passes;
void selectiveNear(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info) {
  ++g_calls;
  if (pair.m_pProxy0->m_clientObject == g_passes || pair.m_pProxy1->m_clientObject == g_passes) return;
  btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

TEST(OwnNarrowphase, NearCallback) {
  int calls[2];
  Slider<btGpuDynamicsWorld> gpu(true);
  Slider<btDiscreteDynamicsWorld> stock(true);
  const auto run = [&](auto& slider, int& count) {
    btRigidBody* ghost = slider.objects.add(1, slider.objects.sphere(s(0.3)), v(3, 0.2, 0));
    slider.dispatcher.setNearCallback(selectiveNear);
    g_passes = ghost;
    g_calls = 0;
    slider.run(30);
    count = g_calls;
    return double(ghost->getWorldTransform().getOrigin().y());
  };
  const double gpuHeight = run(gpu, calls[0]), stockHeight = run(stock, calls[1]);
  EXPECT_GT(calls[1], 30);
  EXPECT_EQ(calls[0], calls[1]);
  EXPECT_NEAR(gpuHeight, stockHeight, noiseAfter(30, 10));
  EXPECT_LT(gpuHeight, -0.5) << "the callback keeps it out";
  expectNear(stateOf(*gpu.body), stateOf(*stock.body), noiseAfter(30, 10), "the other one");
  expectAllOnDevice(gpu.world, {"near callback"});
  gpu.dispatcher.setNearCallback(btCollisionDispatcher::defaultNearCallback);
  gpu.run(5);
  EXPECT_EQ(reported(gpu.world, "near callback").m_count, 30u);
  EXPECT_EQ(gpu.world.statistics().m_deviceSteps, 35u);
}

// Counts the algorithms made for spheres and boxes.
struct CountingFunc : btCollisionAlgorithmCreateFunc {
  explicit CountingFunc(btCollisionAlgorithmCreateFunc* stock) : m_stock(stock) {}
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override {
    ++g_calls;
    return m_stock->CreateCollisionAlgorithm(info, a, b);
  }
  btCollisionAlgorithmCreateFunc* m_stock;
};

TEST(OwnNarrowphase, AlgorithmOfTheApplications) {
  Slider<btGpuDynamicsWorld> gpu(true);
  Slider<btDiscreteDynamicsWorld> stock(true);
  const auto funcOf = [](auto& slider, int a, int b) {
    return slider.configuration.getCollisionAlgorithmCreateFunc(a, b);
  };
  CountingFunc gpuFunc(funcOf(gpu, SPHERE_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE));
  CountingFunc stockFunc(funcOf(stock, SPHERE_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE));
  gpuFunc.m_swapped = stockFunc.m_swapped = gpuFunc.m_stock->m_swapped;
  gpu.dispatcher.registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, &gpuFunc);
  stock.dispatcher.registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, &stockFunc);
  CountingFunc gpuSwapped(funcOf(gpu, BOX_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE));
  CountingFunc stockSwapped(funcOf(stock, BOX_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE));
  gpuSwapped.m_swapped = stockSwapped.m_swapped = gpuSwapped.m_stock->m_swapped;
  gpu.dispatcher.registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE, &gpuSwapped);
  stock.dispatcher.registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE, &stockSwapped);
  for (int step = 1; step <= 30 && !HasFailure(); ++step) {
    g_calls = 0;
    gpu.run(1);
    const int gpuCalls = g_calls;
    g_calls = 0;
    stock.run(1);
    EXPECT_EQ(gpuCalls, g_calls);
    if (step == 1) { EXPECT_EQ(g_calls, 1); }
    expectNear(stateOf(*gpu.body), stateOf(*stock.body), noiseAfter(step, 10), "step " + std::to_string(step));
  }
  expectAllOnDevice(gpu.world, {"SPHERE shape"});
}

// ---- island tags

template <typename World>
void addIslands(WorldOf<World>& w) {
  w.world.setGravity(v(0, -10, 0));
  auto& o = w.objects;
  o.add(0, o.box(v(40, 1, 40)), v(0, -1, 0));
  auto* box = o.box(v(0.5, 0.5, 0.5));
  for (int i = 0; i < 12; ++i) o.add(1, box, v(3.0 * (i % 4), 0.5 + i / 4, 0));  // four columns of three
  btRigidBody* cart = o.add(0, box, v(-5, 0.5, 0));
  cart->setCollisionFlags(cart->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  o.add(1, box, v(-20, 0.5, 0));
}

TEST(IslandTags, AsInStock) {
  btGpuSettings settings;
  settings.m_islandTags = true;
  WorldOf<btGpuDynamicsWorld> gpu(settings);
  WorldOf<btDiscreteDynamicsWorld> stock;
  addIslands(gpu);
  addIslands(stock);
  gpu.run(10);
  stock.run(10);
  expectAllOnDevice(gpu.world);
  const auto &ours = gpu.world.getCollisionObjectArray(), &theirs = stock.world.getCollisionObjectArray();
  std::set<int> tags;
  for (int i = 0; i < ours.size(); ++i) {
    EXPECT_EQ(ours[i]->getCompanionId(), theirs[i]->getCompanionId()) << i;
    EXPECT_EQ(ours[i]->getIslandTag() < 0, theirs[i]->getIslandTag() < 0) << i;
    EXPECT_LT(ours[i]->getIslandTag(), 13) << "they count what can move";
    tags.insert(ours[i]->getIslandTag());
    for (int k = 0; k < i; ++k) {
      EXPECT_EQ(ours[i]->getIslandTag() == ours[k]->getIslandTag(),
                theirs[i]->getIslandTag() == theirs[k]->getIslandTag())
          << i << ", " << k;
    }
  }
  EXPECT_EQ(tags.size(), 6u) << "four columns, one alone, and -1";
}

}  // namespace
}  // namespace btgpu::test
