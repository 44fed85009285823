// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The dispatcher's manifolds, as an application walks them: after the step, and in a tick callback.
#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

constexpr double kTimeStep = 1.0 / 60.0;
using PairName = std::pair<int, int>;  // user indices, the lower one first

struct Touching {
  int points = 0;
  double deepest = 1e30;
  btVector3 normal{0, 0, 0};         // of the deepest point, from the object with the higher index to the other
  btVector3 pressure{0, 0, 0};       // position of each point times its impulse
  double total = 0;                  // of the impulses
  std::vector<btVector3> positions;  // of the points, on the second body
  btVector3 impulse{0, 0, 0};        // sum of the normal impulses, on the object with the lower index
  const btPersistentManifold* manifold = nullptr;
};

std::map<PairName, Touching> walk(btDispatcher& dispatcher) {
  std::map<PairName, Touching> touching;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* m = dispatcher.getManifoldByIndexInternal(i);
    const int a = m->getBody0()->getUserIndex(), b = m->getBody1()->getUserIndex();
    const btScalar sign = btScalar(a < b ? 1 : -1);
    for (int k = 0; k < m->getNumContacts(); ++k) {
      const btManifoldPoint& p = m->getContactPoint(k);
      Touching& t = touching[{std::min(a, b), std::max(a, b)}];
      t.manifold = m;
      t.pressure += p.getPositionWorldOnB() * p.m_appliedImpulse;
      t.total += double(p.m_appliedImpulse);
      t.positions.push_back(p.getPositionWorldOnB());
      ++t.points;
      t.impulse += p.m_normalWorldOnB * (sign * p.m_appliedImpulse);
      if (double(p.getDistance()) >= t.deepest) continue;
      t.deepest = double(p.getDistance());
      t.normal = p.m_normalWorldOnB * sign;
    }
  }
  return touching;
}

// A box that tumbles far below a plane without being pushed out of it: whatever old points its manifold still has, each
// step shows the corner that is deepest then.
TEST(Manifolds, TumblingBoxShowsItsDeepestCorner) {
  const btVector3 half(btScalar(0.47), btScalar(0.45), btScalar(0.23));
  for (const bool asHull : {false, true}) {
    GpuWorld w;
    w.world.setGravity(btVector3(0, 0, 0));
    w.objects.add(0, const_cast<btStaticPlaneShape*>(w.objects.plane(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0));
    btCollisionShape* shape = w.objects.box(half);
    if (asHull) {
      auto* hull = w.objects.shape<btConvexHullShape>();
      for (int k = 0; k < 8; ++k) hull->addPoint(half * btVector3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1));
      hull->setMargin(0);
      shape = hull;
    }
    btRigidBody* box = w.objects.add(1, shape, btVector3(0, btScalar(-2.8), 0));
    box->setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
    box->setActivationState(DISABLE_DEACTIVATION);
    box->setAngularVelocity(btVector3(5, btScalar(1.5), -3));
    for (int step = 0; step < 200; ++step) {
      // Contacts are those of the pose that a step begins with.
      double lowest = 1e30;
      for (int k = 0; k < 8; ++k) {
        const btVector3 corner = half * btVector3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
        lowest = std::min(lowest, double((box->getWorldTransform() * corner).y()));
      }
      w.run(1);
      double deepest = 1e30;
      for (int i = 0; i < w.dispatcher.getNumManifolds(); ++i) {
        const btPersistentManifold& m = *w.dispatcher.getManifoldByIndexInternal(i);
        for (int k = 0; k < m.getNumContacts(); ++k) {
          deepest = std::min(deepest, double(m.getContactPoint(k).getDistance()));
        }
      }
      // Floats of size 3, rounded some ten times on their way.
      ASSERT_NEAR(deepest, lowest, 10 * 3 * 6e-8) << "step " << step << (asHull ? ", hull" : ", box");
    }
    expectAllOnDevice(w.world);
  }
}

// Ground 0; three towers of three boxes, 1 to 9; a ball on top of the first, 10.
void buildTowers(scenes::Objects& o) {
  const auto number = [&](btRigidBody* body) { body->setUserIndex(static_cast<int>(o.bodies().size()) - 1); };
  number(o.add(0, const_cast<btStaticPlaneShape*>(o.plane(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0)));
  auto* box = o.box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
  for (int i = 0; i < 9; ++i) number(o.add(2, box, btVector3(btScalar(3 * (i / 3)), btScalar(0.5 + i % 3), 0)));
  number(o.add(1, o.sphere(btScalar(0.4)), btVector3(0, btScalar(3.4), 0)));
}

template <typename World>
struct Towers : WorldOf<World> {
  explicit Towers(const btGpuSettings& settings) : WorldOf<World>(settings) { build(); }
  Towers() { build(); }
  void build() {
    this->world.setGravity(btVector3(0, -10, 0));
    buildTowers(this->objects);
  }
};
using GpuTowers = Towers<btGpuDynamicsWorld>;
using StockTowers = Towers<btDiscreteDynamicsWorld>;

void expectSameContacts(const std::map<PairName, Touching>& gpu, const std::map<PairName, Touching>& stock, int step) {
  ASSERT_EQ(gpu.size(), stock.size()) << "step " << step;
  for (const auto& [name, s] : stock) {
    ASSERT_EQ(gpu.count(name), 1u) << name.first << ", " << name.second;
    const Touching& g = gpu.at(name);
    EXPECT_NEAR(g.deepest, s.deepest, 2e-3) << "the solver's own residual at rest: " << step;
    EXPECT_GT(double(g.normal.dot(s.normal)), 0.9999);
    for (const btVector3& p : g.positions) {
      const btVector3 apart = p - s.positions.front();
      EXPECT_NEAR(double(apart.dot(s.normal)), 0, 4e-3) << "in stock's contact plane";
      EXPECT_LT(double(apart.length()), 1.5) << "on the same face, whichever corners carry it";
    }
  }
}

void expectWeightCarried(const std::map<PairName, Touching>& touching, double relative) {
  btVector3 onGround(0, 0, 0);
  for (const auto& [name, t] : touching) {
    if (name.first == 0) onGround += t.impulse;
  }
  const double weight = (9 * 2 + 1) * 10 * kTimeStep;
  EXPECT_NEAR(double(-onGround.y()), weight, relative * weight);
}

// Where a contact's force acts, as a mean over many steps: in one step the solver's ten iterations leave it open.
btVector3 centreOfPressure(const std::vector<std::map<PairName, Touching>>& ticks, size_t first, PairName name) {
  btVector3 pressure(0, 0, 0);
  double total = 0;
  for (size_t i = first; i < ticks.size(); ++i) {
    pressure += ticks[i].at(name).pressure;
    total += ticks[i].at(name).total;
  }
  return pressure / btScalar(total);
}

// What the tick callback sees, step by step.
std::vector<std::map<PairName, Touching>>* g_ticks = nullptr;
void recordTick(btDynamicsWorld* world, btScalar) { g_ticks->push_back(walk(*world->getDispatcher())); }

TEST(Manifolds, SamePairsPointsAndWeightAsStockInTicksAndAtTheEnd) {
  GpuTowers gpu;
  StockTowers stock;
  std::vector<std::map<PairName, Touching>> gpuTicks, stockTicks;
  gpu.world.setInternalTickCallback(recordTick);
  stock.world.setInternalTickCallback(recordTick);
  constexpr int kSteps = 60;
  for (int i = 0; i < kSteps / 2; ++i) {  // two substeps each
    g_ticks = &gpuTicks;
    gpu.world.stepSimulation(btScalar(2 * kTimeStep), 4, btScalar(kTimeStep));
    g_ticks = &stockTicks;
    stock.world.stepSimulation(btScalar(2 * kTimeStep), 4, btScalar(kTimeStep));
    expectSameContacts(walk(gpu.dispatcher), gpuTicks.back(), i);
  }
  ASSERT_EQ(gpuTicks.size(), stockTicks.size());
  for (size_t i = 30; i < gpuTicks.size(); ++i) expectSameContacts(gpuTicks[i], stockTicks[i], static_cast<int>(i));
  for (const auto& [name, t] : stockTicks.back()) {
    const btVector3 apart = centreOfPressure(gpuTicks, 30, name) - centreOfPressure(stockTicks, 30, name);
    EXPECT_LT(double(apart.length()), 0.05) << name.first << ", " << name.second;
  }
  expectWeightCarried(stockTicks.back(), 0.02);
  expectWeightCarried(gpuTicks.back(), 0.02);
  expectAllOnDevice(gpu.world);
}

TEST(Manifolds, WhatSleepsKeepsItsContacts) {
  GpuTowers gpu;
  gpu.run(400);
  ASSERT_FALSE(gpu.objects.bodies()[1]->isActive());
  const auto before = walk(gpu.dispatcher);
  EXPECT_GE(before.size(), 10u);
  gpu.run(5);
  const auto after = walk(gpu.dispatcher);
  ASSERT_EQ(after.size(), before.size());
  for (const auto& [name, t] : before) {
    EXPECT_EQ(after.at(name).points, t.points);
    EXPECT_EQ(after.at(name).impulse, t.impulse);
  }
  expectWeightCarried(after, 0.02);
}

TEST(Manifolds, APairKeepsItsManifold) {
  GpuTowers gpu;
  gpu.run(20);
  const auto before = walk(gpu.dispatcher);
  for (int i = 0; i < 20; ++i) {
    gpu.run(1);
    for (const auto& [name, t] : walk(gpu.dispatcher)) {
      if (before.count(name)) { EXPECT_EQ(t.manifold, before.at(name).manifold); }
    }
  }
  int aged = 0;
  for (int i = 0; i < gpu.dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& m = *gpu.dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < m.getNumContacts(); ++k) aged = std::max(aged, m.getContactPoint(k).getLifeTime());
  }
  EXPECT_GT(aged, 30);
}

TEST(Manifolds, GoWithTheirBodies) {
  GpuTowers gpu;
  gpu.run(20);
  EXPECT_GT(gpu.dispatcher.getNumManifolds(), 0);
  for (btRigidBody* body : gpu.objects.bodies()) {
    gpu.world.removeRigidBody(body);
    for (const auto& [name, t] : walk(gpu.dispatcher)) {
      EXPECT_NE(name.first, body->getUserIndex());
      EXPECT_NE(name.second, body->getUserIndex());
    }
    gpu.run(1);
  }
  EXPECT_EQ(gpu.dispatcher.getNumManifolds(), 0);
  for (btRigidBody* body : gpu.objects.bodies()) gpu.world.addRigidBody(body);
  gpu.run(3);
  EXPECT_GE(walk(gpu.dispatcher).size(), 9u) << "new manifolds for those that came back";
}

TEST(Manifolds, OffSavesThemAndChangesNothing) {
  btGpuSettings off;
  off.m_contacts = false;
  GpuTowers with, without(off);
  for (int i = 0; i < 30; ++i) {
    with.run(1);
    without.run(1);
    EXPECT_EQ(without.dispatcher.getNumManifolds(), 0);
  }
  for (size_t i = 0; i < with.objects.bodies().size(); ++i) {
    EXPECT_EQ(with.objects.bodies()[i]->getWorldTransform(), without.objects.bodies()[i]->getWorldTransform());
  }
  btGpuDynamicsWorld::configure(&without.world, btGpuSettings());
  without.run(1);
  with.run(1);
  expectSameContacts(walk(without.dispatcher), walk(with.dispatcher), 31);
  btGpuDynamicsWorld::configure(&with.world, off);
  with.run(1);
  EXPECT_EQ(with.dispatcher.getNumManifolds(), 0);
}

// A world that slept through the change must not come out without its contacts.
TEST(Manifolds, TurnedOnWhileAllSleep) {
  btGpuSettings off;
  off.m_contacts = false;
  GpuTowers gpu(off);
  gpu.run(400);
  ASSERT_FALSE(gpu.objects.bodies()[1]->isActive());
  btGpuDynamicsWorld::configure(&gpu.world, btGpuSettings());
  gpu.run(1);
  expectWeightCarried(walk(gpu.dispatcher), 0.02);
}

TEST(Manifolds, TurnedOffAndOnWhileAllSleep) {
  btGpuSettings off;
  off.m_contacts = false;
  GpuTowers gpu;
  gpu.run(400);
  ASSERT_FALSE(gpu.objects.bodies()[1]->isActive());
  for (const btGpuSettings& settings : {off, btGpuSettings()}) {
    btGpuDynamicsWorld::configure(&gpu.world, settings);
    gpu.run(1);
  }
  expectWeightCarried(walk(gpu.dispatcher), 0.02);
}

TEST(Manifolds, TheApplicationsOwnCollisionDetectionDoesNoHarm) {
  GpuTowers gpu, calm;
  for (int i = 0; i < 20; ++i) {
    gpu.run(1);
    calm.run(1);
    gpu.world.performDiscreteCollisionDetection();
  }
  EXPECT_GE(walk(gpu.dispatcher).size(), 10u);
  gpu.run(1);
  calm.run(1);
  const auto a = walk(gpu.dispatcher), b = walk(calm.dispatcher);
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, t] : b) {
    EXPECT_EQ(a.at(name).points, t.points);
    EXPECT_EQ(a.at(name).deepest, t.deepest);
    EXPECT_EQ(a.at(name).impulse, t.impulse);
  }
}

TEST(Manifolds, SurviveAStepOnTheStockPath) {
  GpuTowers gpu;
  gpu.run(30);
  const auto before = walk(gpu.dispatcher);
  btGpuSettings stockOnly;
  stockOnly.m_stockOnly = true;
  btGpuDynamicsWorld::configure(&gpu.world, stockOnly);
  for (int i = 0; i < 3; ++i) {
    gpu.run(1);
    for (const auto& [name, t] : walk(gpu.dispatcher)) {
      if (before.count(name)) { EXPECT_EQ(t.manifold, before.at(name).manifold) << "step " << i; }
    }
    expectWeightCarried(walk(gpu.dispatcher), 0.02);
  }
  EXPECT_EQ(gpu.world.statistics().m_stockSteps, 3u);
  btGpuDynamicsWorld::configure(&gpu.world, btGpuSettings());
  for (int i = 0; i < 3; ++i) {
    gpu.run(1);
    for (const auto& [name, t] : walk(gpu.dispatcher)) {
      if (before.count(name)) { EXPECT_EQ(t.manifold, before.at(name).manifold) << "step " << i; }
    }
    expectWeightCarried(walk(gpu.dispatcher), 0.02);
  }
}

TEST(Manifolds, WithoutTheHostsBroadphase) {
  btGpuSettings settings;
  settings.m_hostQueries = false;
  GpuTowers gpu(settings), current;
  for (int i = 0; i < 40; ++i) {
    gpu.run(1);
    current.run(1);
    expectSameContacts(walk(gpu.dispatcher), walk(current.dispatcher), i);
  }
  btRigidBody& ball = *gpu.objects.bodies()[10];
  ball.setLinearVelocity(btVector3(0, 8, 0));
  gpu.run(10);
  EXPECT_EQ(walk(gpu.dispatcher).count({3, 10}), 0u);
  EXPECT_EQ(
      gpu.world.getPairCache()->findPair(ball.getBroadphaseHandle(), gpu.objects.bodies()[3]->getBroadphaseHandle()),
      nullptr);
}

// ---- what the application keeps in a point, and its callbacks ------------------------------------------------------

struct Events {
  int given = 0, destroyed = 0, started = 0, ended = 0;
  std::set<void*> alive;
};
Events* g_events = nullptr;

bool onDestroyed(void* data) {
  ++g_events->destroyed;
  EXPECT_EQ(g_events->alive.erase(data), 1u) << "each once";
  return true;
}
void onStarted(btPersistentManifold* const& m) { g_events->started += m->getNumContacts() > 0 ? 1 : 100; }
void onEnded(btPersistentManifold* const&) { ++g_events->ended; }

// The callbacks are Bullet's globals: set for one test.
class ScopedCallbacks {
 public:
  explicit ScopedCallbacks(Events& events) {
    g_events = &events;
    gContactDestroyedCallback = onDestroyed;
    gContactStartedCallback = onStarted;
    gContactEndedCallback = onEnded;
  }
  ~ScopedCallbacks() {
    gContactDestroyedCallback = nullptr;
    gContactStartedCallback = nullptr;
    gContactEndedCallback = nullptr;
  }
  ScopedCallbacks(const ScopedCallbacks&) = delete;
  ScopedCallbacks& operator=(const ScopedCallbacks&) = delete;
};

// Gives every point that has none a datum of its own. Returns how many points have one that they were not given here.
void giveData(btDispatcher& dispatcher, Events& events) {
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    btPersistentManifold& m = *dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < m.getNumContacts(); ++k) {
      void*& data = m.getContactPoint(k).m_userPersistentData;
      if (data) {
        EXPECT_EQ(events.alive.count(data), 1u);
        EXPECT_GT(m.getContactPoint(k).getLifeTime(), 1) << "a new point has no data";
        continue;
      }
      data = reinterpret_cast<void*>(static_cast<std::uintptr_t>(++events.given));
      events.alive.insert(data);
    }
  }
}

template <typename World>
Events rollOff() {
  Events events;
  const ScopedCallbacks callbacks(events);
  {
    Towers<World> towers;
    towers.objects.bodies()[10]->setLinearVelocity(btVector3(2, 0, 0));
    towers.objects.bodies()[10]->setRestitution(btScalar(0.5));
    for (int i = 0; i < 90; ++i) {
      towers.run(1);
      giveData(towers.dispatcher, events);
    }
  }
  EXPECT_TRUE(events.alive.empty()) << "bodies that left the world took theirs along";
  EXPECT_EQ(events.given, events.destroyed);
  return events;
}

TEST(Manifolds, UserDataAndCallbacksAsInStock) {
  const Events gpu = rollOff<btGpuDynamicsWorld>(), stock = rollOff<btDiscreteDynamicsWorld>();
  EXPECT_EQ(gpu.started, stock.started);
  EXPECT_EQ(gpu.ended, stock.ended);
  EXPECT_GT(gpu.started, 10);
}

// The usual code of character controllers: from the ghost's overlapping pairs to the manifolds.
template <typename World>
int contactsOfGhost() {
  WorldOf<World> w;
  btGhostPairCallback callback;
  w.world.getPairCache()->setInternalGhostPairCallback(&callback);
  buildTowers(w.objects);
  btPairCachingGhostObject ghost;
  btSphereShape shape(btScalar(0.7));
  ghost.setCollisionShape(&shape);
  ghost.setCollisionFlags(ghost.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(btScalar(0.8), btScalar(0.6), 0)));
  w.world.addCollisionObject(&ghost, btBroadphaseProxy::SensorTrigger, btBroadphaseProxy::AllFilter);
  w.run(5);
  int contacts = 0;
  btManifoldArray manifolds;
  const btBroadphasePairArray& pairs = ghost.getOverlappingPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    const btBroadphasePair* pair = w.world.getPairCache()->findPair(pairs[i].m_pProxy0, pairs[i].m_pProxy1);
    if (!pair || !pair->m_algorithm) continue;
    manifolds.resize(0);
    pair->m_algorithm->getAllContactManifolds(manifolds);
    for (int k = 0; k < manifolds.size(); ++k) contacts += manifolds[k]->getNumContacts() > 0;
  }
  w.world.removeCollisionObject(&ghost);
  w.world.getPairCache()->setInternalGhostPairCallback(nullptr);
  return contacts;
}

TEST(Manifolds, OfAGhostAreFoundThroughItsPairs) {
  const int stock = contactsOfGhost<btDiscreteDynamicsWorld>();
  EXPECT_GE(stock, 2);
  EXPECT_EQ(contactsOfGhost<btGpuDynamicsWorld>(), stock);
}

// Lift of all contacts on the ground, averaged over the last 60 of 240 steps.
template <typename World>
double liftOfStack(WorldOf<World>& w) {
  w.world.setGravity(btVector3(0, -10, 0));
  scenes::find("stack")->build(w.objects, {8, 8, 8});
  for (int i = 0; i < static_cast<int>(w.objects.bodies().size()); ++i) {
    w.objects.bodies()[static_cast<size_t>(i)]->setUserIndex(i);
  }
  double lift = 0;
  w.run(180);
  for (int i = 0; i < 60; ++i) {
    w.run(1);
    for (const auto& [name, t] : walk(w.dispatcher)) {
      if (w.objects.bodies()[static_cast<size_t>(name.first)]->isStaticObject()) lift -= double(t.impulse.y()) / 60;
    }
  }
  return lift;
}

// More manifolds than one thread's share.
TEST(Manifolds, OfAWholeStack) {
  GpuWorld gpu;
  StockWorld stock;
  const double gpuLift = liftOfStack(gpu), stockLift = liftOfStack(stock);
  EXPECT_NEAR(gpuLift, stockLift, 0.05 * stockLift);
  EXPECT_GT(walk(gpu.dispatcher).size(), 1500u);
  EXPECT_EQ(walk(gpu.dispatcher).size(), gpu.world.statistics().m_contactManifolds);
}

}  // namespace
}  // namespace btgpu::test
