// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Shapes and callbacks that the device lacks: their contacts come from Bullet's own algorithms, and the step runs on
// the device all the same.
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <algorithm>
#include <cfloat>
#include <functional>

#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

constexpr double kTimeStep = 1.0 / 60.0;
btScalar s(double v) { return static_cast<btScalar>(v); }

// Nothing of the world ran on the stock path, and the report says what the CPU did inside the steps.
void expectShares(const btGpuDynamicsWorld& world, const std::vector<std::string>& names, unsigned steps) {
  EXPECT_EQ(world.statistics().m_stockSteps, 0u);
  EXPECT_EQ(world.statistics().m_deviceSteps, steps);
  std::vector<std::string> reported;
  for (const auto& f : world.fallbackReport()) {
    reported.push_back(f.m_what);
    EXPECT_FALSE(f.m_wholeStep) << f.m_what;
    EXPECT_EQ(f.m_count, steps) << f.m_what << ": steps in which it was so";
  }
  EXPECT_EQ(reported, names);
}

// What belongs to a test's shapes besides themselves; outlives the worlds.
struct Workshop {
  std::vector<std::shared_ptr<void>> keep;
  template <typename T, typename... Arguments>
  T* make(Arguments&&... arguments) {
    auto made = std::make_shared<T>(std::forward<Arguments>(arguments)...);
    keep.push_back(made);
    return made.get();
  }
};

class OwnCylinder : public btCylinderShape {
 public:
  using btCylinderShape::btCylinderShape;
};
class OwnConvexMesh : public btConvexTriangleMeshShape {
 public:
  using btConvexTriangleMeshShape::btConvexTriangleMeshShape;
};
class OwnSphere : public btSphereShape {
 public:
  using btSphereShape::btSphereShape;
};

// A shape that the device lacks and then another one that it has: the device's manifold of the pair was made without
// knowing a breaking threshold.
TEST(HostContacts, ShapeThatBecomesTheDevices) {
  const auto run = [](auto& w, Workshop& shop) {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, const_cast<btStaticPlaneShape*>(w.objects.plane(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0));
    btRigidBody* body = w.objects.add(1, shop.make<OwnSphere>(s(0.5)), btVector3(0, s(0.5), 0));
    body->setActivationState(DISABLE_DEACTIVATION);
    w.run(5);
    w.world.getPairCache()->cleanProxyFromPairs(body->getBroadphaseHandle(), &w.dispatcher);
    body->setCollisionShape(w.objects.box(btVector3(s(0.4), s(0.5), s(0.4))));
    w.run(5);
  };
  for (const bool contacts : {false, true}) {
    Workshop shop;
    GpuWorld gpu;
    StockWorld stock;
    btGpuSettings settings;
    settings.m_contacts = contacts;
    btGpuDynamicsWorld::configure(&gpu.world, settings);
    run(gpu, shop);
    run(stock, shop);
    settings.m_contacts = true;
    btGpuDynamicsWorld::configure(&gpu.world, settings);
    gpu.run(1);
    stock.run(1);
    ASSERT_EQ(stock.dispatcher.getNumManifolds(), 1);
    ASSERT_EQ(gpu.dispatcher.getNumManifolds(), 1) << contacts;
    const btPersistentManifold &ours = *gpu.dispatcher.getManifoldByIndexInternal(0),
                               &theirs = *stock.dispatcher.getManifoldByIndexInternal(0);
    EXPECT_FLOAT_EQ(float(ours.getContactBreakingThreshold()), float(theirs.getContactBreakingThreshold())) << contacts;
    EXPECT_EQ(ours.getNumContacts(), 4) << contacts;
    EXPECT_EQ(gpu.world.statistics().m_stockSteps, 0u);
  }
}

struct Dropped {
  std::string name, bulletName;
  std::function<btCollisionShape*(Workshop&)> make;
};
void PrintTo(const Dropped& dropped, std::ostream* stream) { *stream << dropped.name; }

btTriangleMesh* tetrahedron(Workshop& w) {
  auto* mesh = w.make<btTriangleMesh>();
  const btVector3 p[] = {btVector3(s(-0.5), s(-0.4), s(-0.5)), btVector3(s(0.5), s(-0.4), s(-0.5)),
                         btVector3(0, s(-0.4), s(0.6)), btVector3(0, s(0.5), 0)};
  const int faces[4][3] = {{0, 1, 2}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  for (const auto& f : faces) mesh->addTriangle(p[f[0]], p[f[1]], p[f[2]]);
  return mesh;
}

const Dropped kDropped[] = {
    {"DerivedFromCylinder", "CylinderY",
     [](Workshop& w) { return w.make<OwnCylinder>(btVector3(s(0.5), s(0.4), s(0.5))); }},
    {"DerivedFromConvexMesh", "ConvexTrimesh", [](Workshop& w) { return w.make<OwnConvexMesh>(tetrahedron(w)); }},
    {"DerivedFromSphere", "SPHERE", [](Workshop& w) { return w.make<OwnSphere>(s(0.5)); }},
};

class HostShapes : public testing::TestWithParam<Dropped> {};

template <typename World>
struct Drop {
  Drop(Workshop& workshop, const Dropped& dropped, const btGpuSettings& settings) : w(settings) {
    build(workshop, dropped);
  }
  Drop(Workshop& workshop, const Dropped& dropped) { build(workshop, dropped); }
  // On a plane and on a box of the device.
  void build(Workshop& workshop, const Dropped& dropped) {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, const_cast<btStaticPlaneShape*>(w.objects.plane(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0));
    w.objects.add(0, w.objects.box(btVector3(2, s(0.5), 2)), btVector3(8, s(0.5), 0));
    btCollisionShape* shape = dropped.make(workshop);
    w.objects.add(2, shape, btVector3(0, 1, 0));
    w.objects.add(2, shape, btVector3(8, 2, 0));
    w.objects.add(1, w.objects.box(btVector3(s(0.3), s(0.3), s(0.3))), btVector3(0, s(2.5), 0));  // on top of it
    for (btRigidBody* body : w.objects.bodies()) body->setSleepingThresholds(0, 0);
  }
  WorldOf<World> w;
};

double weightOnGround(btDispatcher& dispatcher) {
  double lift = 0;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& m = *dispatcher.getManifoldByIndexInternal(i);
    const bool ground0 = m.getBody0()->isStaticObject(), ground1 = m.getBody1()->isStaticObject();
    if (ground0 == ground1) continue;
    for (int k = 0; k < m.getNumContacts(); ++k) {
      const btManifoldPoint& p = m.getContactPoint(k);
      lift += double(p.m_normalWorldOnB.y() * p.m_appliedImpulse) * (ground1 ? 1 : -1);
    }
  }
  return lift;
}

// One body falls onto one that does not move: without a pile there is no chaos, and after a second of contact both
// worlds agree to what ten iterations leave open.
TEST_P(HostShapes, FallAndRestAsInStock) {
  Workshop workshop;
  Drop<btGpuDynamicsWorld> gpu(workshop, GetParam());
  Drop<btDiscreteDynamicsWorld> stock(workshop, GetParam());
  constexpr int kSteps = 240, kMeasured = 60;
  double gpuLift = 0, stockLift = 0;
  for (int i = 0; i < kSteps; ++i) {
    gpu.w.run(1);
    stock.w.run(1);
    if (i >= kSteps - kMeasured) {
      gpuLift += weightOnGround(gpu.w.dispatcher);
      stockLift += weightOnGround(stock.w.dispatcher);
    }
    if (i > 60) continue;  // one body on one that does not move: nothing chaotic yet
    const btVector3 apart = gpu.w.objects.bodies()[3]->getWorldTransform().getOrigin() -
                            stock.w.objects.bodies()[3]->getWorldTransform().getOrigin();
    ASSERT_LT(double(apart.length()), 2e-3) << "step " << i;
  }
  // What lies still in stock lies still here, at the same height. (The box on top may slide off, in its own way.)
  bool allLie = true;
  for (size_t body = 2; body < 5; ++body) {
    const btRigidBody &g = *gpu.w.objects.bodies()[body], &e = *stock.w.objects.bodies()[body];
    const bool lies = length(e.getLinearVelocity()) < 0.01 && (body != 4 || length(g.getLinearVelocity()) < 0.01);
    allLie = allLie && lies;
    if (!lies) continue;
    EXPECT_NEAR(double(g.getWorldTransform().getOrigin().y()), double(e.getWorldTransform().getOrigin().y()), 5e-3)
        << body;
  }
  if (allLie) { EXPECT_NEAR(gpuLift / kMeasured, stockLift / kMeasured, 0.02 * 5 * 10 * kTimeStep); }
  expectShares(gpu.w.world, {GetParam().bulletName + " shape"}, kSteps);
}

TEST_P(HostShapes, WithoutContactsAndQueries) {
  Workshop workshop;
  btGpuSettings bare;
  bare.m_contacts = bare.m_hostQueries = false;
  Drop<btGpuDynamicsWorld> full(workshop, GetParam()), gpu(workshop, GetParam(), bare);
  full.w.run(60);
  gpu.w.run(60);
  for (size_t body = 2; body < 5; ++body) {
    EXPECT_EQ(gpu.w.objects.bodies()[body]->getWorldTransform(), full.w.objects.bodies()[body]->getWorldTransform())
        << "the settings say what the application sees, not what happens";
  }
}

INSTANTIATE_TEST_SUITE_P(All, HostShapes, testing::ValuesIn(kDropped),
                         [](const testing::TestParamInfo<Dropped>& test) { return test.param.name; });

// ---- static meshes -------------------------------------------------------------------------------------------------

// A wavy terrain of 20 by 20 cells of one unit.
btTriangleMesh* terrain(Workshop& w) {
  auto* mesh = w.make<btTriangleMesh>();
  const auto at = [](int x, int z) {
    return btVector3(s(x - 10), s(0.3 * std::sin(0.7 * x) * std::cos(0.5 * z)), s(z - 10));
  };
  for (int x = 0; x < 20; ++x) {
    for (int z = 0; z < 20; ++z) {
      mesh->addTriangle(at(x, z), at(x, z + 1), at(x + 1, z));
      mesh->addTriangle(at(x + 1, z), at(x, z + 1), at(x + 1, z + 1));
    }
  }
  return mesh;
}

// With PHY_FLOAT Bullet reads btScalars: doubles in a double world.
btCollisionShape* heights(Workshop& w) {
  auto* values = w.make<std::vector<btScalar>>(21 * 21);
  for (int x = 0; x < 21; ++x) {
    for (int z = 0; z < 21; ++z)
      (*values)[static_cast<size_t>(z * 21 + x)] = s(0.3 * std::sin(0.7 * x) * std::cos(0.5 * z));
  }
  return w.make<btHeightfieldTerrainShape>(21, 21, values->data(), s(1), s(-0.5), s(0.5), 1, PHY_FLOAT, false);
}

template <typename World>
void scatter(WorldOf<World>& w, btCollisionShape* ground) {
  w.world.setGravity(btVector3(0, -10, 0));
  w.objects.add(0, ground, btVector3(0, 0, 0));
  auto* box = w.objects.box(btVector3(s(0.4), s(0.3), s(0.5)));
  auto* ball = w.objects.sphere(s(0.4));
  for (int i = 0; i < 36; ++i) {
    btCollisionShape* shape = i % 3 ? static_cast<btCollisionShape*>(box) : ball;
    w.objects.add(1, shape, btVector3(s(1.3 * (i % 6) - 3), s(1.2), s(1.3 * (i / 6) - 3)))->setRollingFriction(s(0.02));
  }
}

void expectOnTerrain(btCollisionShape* ground) {
  WorldOf<btGpuDynamicsWorld> gpu;
  WorldOf<btDiscreteDynamicsWorld> stock;
  scatter(gpu, ground);
  scatter(stock, ground);
  constexpr int kSteps = 300;
  gpu.run(kSteps);
  stock.run(kSteps);
  double gpuHeight = 0, stockHeight = 0;
  for (size_t i = 1; i < gpu.objects.bodies().size(); ++i) {
    const double y = double(gpu.objects.bodies()[i]->getWorldTransform().getOrigin().y());
    const double stockY = double(stock.objects.bodies()[i]->getWorldTransform().getOrigin().y());
    EXPECT_GT(y, -0.31) << "through the ground: body " << i;
    EXPECT_GT(stockY, -0.31) << "through stock's ground: body " << i;
    gpuHeight += y / 36;
    stockHeight += stockY / 36;
  }
  EXPECT_NEAR(gpuHeight, stockHeight, 0.03) << "they come to rest in the same hollows";
  expectShares(gpu.world, {}, kSteps);
}

TEST(DeviceMeshes, TriangleMesh) {
  Workshop w;
  expectOnTerrain(w.make<btBvhTriangleMeshShape>(terrain(w), true));
}
TEST(DeviceMeshes, ScaledTriangleMesh) {
  Workshop w;
  auto* mesh = w.make<btBvhTriangleMeshShape>(terrain(w), true);
  expectOnTerrain(w.make<btScaledBvhTriangleMeshShape>(mesh, btVector3(1, s(0.8), 1)));
}
TEST(DeviceMeshes, HeightField) {
  Workshop w;
  expectOnTerrain(heights(w));
}

// ---- the application's callbacks -----------------------------------------------------------------------------------

int g_calls = 0;
bool makeIce(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int, const btCollisionObjectWrapper*, int,
             int) {
  ++g_calls;
  point.m_combinedFriction = 0;
  return true;
}
bool countProcessed(btManifoldPoint&, void*, void*) {
  ++g_calls;
  return false;
}
btScalar slippery(const btCollisionObject*, const btCollisionObject*) { return 0; }

// Two boxes slide on a plane; the first one has the custom material.
template <typename World>
struct Sliders : WorldOf<World> {
  Sliders() {
    this->world.setGravity(btVector3(0, -10, 0));
    auto& o = this->objects;
    o.add(0, const_cast<btStaticPlaneShape*>(o.plane(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0));
    for (int i = 0; i < 2; ++i) {
      o.add(1, o.box(btVector3(s(0.5), s(0.2), s(0.5))), btVector3(0, s(0.2), s(3 * i)))
          ->setLinearVelocity(btVector3(2, 0, 0));
    }
    btRigidBody& first = *o.bodies()[1];
    first.setCollisionFlags(first.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  }
  double x(size_t body) const { return double(this->objects.bodies()[body]->getWorldTransform().getOrigin().x()); }
};

class HostCallbacks : public testing::Test {
 protected:
  void expectAsInStock(const std::vector<std::string>& names, bool secondToo = true) {
    Sliders<btGpuDynamicsWorld> gpu;
    g_calls = 0;
    gpu.run(60);
    const int gpuCalls = g_calls;
    Sliders<btDiscreteDynamicsWorld> stock;
    g_calls = 0;
    stock.run(60);
    EXPECT_NEAR(gpu.x(1), stock.x(1), 2e-3);
    if (secondToo) { EXPECT_NEAR(gpu.x(2), stock.x(2), 2e-3); }
    gpuSecond = gpu.x(2);
    // A point that flickers at the breaking threshold makes a call more or less.
    EXPECT_NEAR(gpuCalls, g_calls, 0.02 * g_calls);
    slidFirst = stock.x(1);
    slidSecond = stock.x(2);
    expectShares(gpu.world, names, 60);
  }
  ~HostCallbacks() override {
    gContactAddedCallback = nullptr;
    gContactProcessedCallback = nullptr;
    gCalculateCombinedFrictionCallback = &btManifoldResult::calculateCombinedFriction;
  }
  double slidFirst = 0, slidSecond = 0, gpuSecond = 0;
};

TEST_F(HostCallbacks, ContactAddedForTheBodiesThatAskForIt) {
  gContactAddedCallback = makeIce;
  expectAsInStock({"gContactAddedCallback"}, false);
  gContactAddedCallback = nullptr;
  Sliders<btGpuDynamicsWorld> plain;
  plain.run(60);
  EXPECT_EQ(gpuSecond, plain.x(2)) << "the other one stayed with the device";
  EXPECT_GT(slidFirst, 1.8) << "on ice";
  EXPECT_LT(slidSecond, 1.5) << "not on ice";
}

TEST_F(HostCallbacks, ContactProcessedForAll) {
  gContactProcessedCallback = countProcessed;
  expectAsInStock({"gContactProcessedCallback"});
}

TEST_F(HostCallbacks, CombineCallbackForAll) {
  gCalculateCombinedFrictionCallback = slippery;
  expectAsInStock({"material combine callback"});
  EXPECT_GT(slidSecond, 1.8);
}

bool makeRough(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int, const btCollisionObjectWrapper*, int,
               int) {
  point.m_combinedRollingFriction = s(0.02);
  point.m_combinedSpinningFriction = s(0.03);
  return true;
}

// A ball rolls along a plane, turning about the upright axis too; no body has rolling friction.
template <typename World>
struct RollingBall : WorldOf<World> {
  RollingBall() {
    this->world.setGravity(btVector3(0, -10, 0));
    auto& o = this->objects;
    o.add(0, const_cast<btStaticPlaneShape*>(o.plane(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0));
    ball = o.add(1, o.sphere(s(0.5)), btVector3(0, s(0.5), 0));
    ball->setLinearVelocity(btVector3(2, 0, 0));
    ball->setAngularVelocity(btVector3(0, 3, -4));
    ball->setDamping(0, 0);
    ball->setCollisionFlags(ball->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  }
  btRigidBody* ball;
};

// Also once the ball is the device's again, whose points begin with those that the host leaves it.
TEST_F(HostCallbacks, RollingFrictionOfPoints) {
  constexpr int kSteps = 60;
  RollingBall<btGpuDynamicsWorld> gpu;
  RollingBall<btDiscreteDynamicsWorld> stock, plain;
  // Each iteration rounds the velocities, of up to 4 / s, by half a unit for each of six rows; positions are sums of
  // them over at most two seconds.
  const double noise = 2 * kSteps * 10 * 6 * 0.5 * double(FLT_EPSILON) * 4;
  for (const ContactAddedCallback callback : {makeRough, ContactAddedCallback(nullptr)}) {
    gContactAddedCallback = callback;
    gpu.run(kSteps);
    stock.run(kSteps);
    const btRigidBody &a = *gpu.ball, &b = *stock.ball;
    EXPECT_NEAR(double((a.getLinearVelocity() - b.getLinearVelocity()).length()), 0, noise);
    EXPECT_NEAR(double((a.getAngularVelocity() - b.getAngularVelocity()).length()), 0, noise);
    EXPECT_NEAR(double((a.getWorldTransform().getOrigin() - b.getWorldTransform().getOrigin()).length()), 0, 2 * noise);
  }
  gContactAddedCallback = nullptr;
  plain.run(kSteps);
  EXPECT_LT(double(stock.ball->getLinearVelocity().length()), 0.95 * double(plain.ball->getLinearVelocity().length()));
  EXPECT_LT(double(stock.ball->getAngularVelocity().y()), 0.9 * double(plain.ball->getAngularVelocity().y()));
  EXPECT_EQ(gpu.world.statistics().m_stockSteps, 0u);
}

// A step that stock does anyway asks the application once, not once more for the device.
TEST_F(HostCallbacks, NotTwiceOnTheStockPath) {
  gContactProcessedCallback = countProcessed;
  int calls[2];
  for (const bool gpuWorld : {true, false}) {
    g_calls = 0;
    if (gpuWorld) {
      Sliders<btGpuDynamicsWorld> gpu;
      btGpuSettings nowhere;
      nowhere.m_device = "no such device";
      btGpuDynamicsWorld::configure(&gpu.world, nowhere);
      gpu.run(10);
      EXPECT_EQ(gpu.world.statistics().m_stockSteps, 10u);
    } else {
      Sliders<btDiscreteDynamicsWorld>().run(10);
    }
    calls[gpuWorld] = g_calls;
  }
  EXPECT_GT(calls[false], 10);
  EXPECT_EQ(calls[true], calls[false]);
}

// A callback that comes and goes: the bodies change hands, and the manifolds with them.
TEST_F(HostCallbacks, ComeAndGo) {
  WorldOf<btGpuDynamicsWorld> gpu;
  gpu.world.setGravity(btVector3(0, -10, 0));
  auto& o = gpu.objects;
  o.add(0, const_cast<btStaticPlaneShape*>(o.plane(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0));
  for (int i = 0; i < 4; ++i) o.add(1, o.box(btVector3(s(0.5), s(0.5), s(0.5))), btVector3(0, s(0.5 + i), 0));
  gpu.run(30);
  for (int round = 0; round < 3; ++round) {
    gContactProcessedCallback = countProcessed;
    gpu.run(5);
    EXPECT_NEAR(weightOnGround(gpu.dispatcher), 40 * kTimeStep, 0.1 * 40 * kTimeStep);
    gContactProcessedCallback = nullptr;
    gpu.run(5);
    EXPECT_NEAR(weightOnGround(gpu.dispatcher), 40 * kTimeStep, 0.1 * 40 * kTimeStep);
    EXPECT_NEAR(double(o.bodies()[4]->getWorldTransform().getOrigin().y()), 3.5, 0.02);
    EXPECT_LE(gpu.dispatcher.getNumManifolds(), 7)
        << "the plane's with every box, three between boxes: each pair has one";
  }
  EXPECT_EQ(gpu.world.statistics().m_stockSteps, 0u);
}

}  // namespace
}  // namespace btgpu::test
