// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The application's own pair callback, as triggers use it: called as in stock, and what it does to bodies
// takes effect in the same step.
#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>

#include <functional>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

using Effect = std::function<void(btRigidBody& sleeper, btRigidBody& visitor)>;

// Acts once, when the pair of trigger and visitor appears.
class Trigger : public btOverlappingPairCallback {
 public:
  btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override {
    ++added;
    if (involves(a, b, trigger) && involves(a, b, visitor) && effect) effect(*sleeper, *visitor);
    return nullptr;
  }
  void* removeOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*, btDispatcher*) override {
    ++removed;
    return nullptr;
  }
  void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override {}

  int added = 0, removed = 0;
  btRigidBody *trigger = nullptr, *sleeper = nullptr, *visitor = nullptr;
  Effect effect;

 private:
  static bool involves(btBroadphaseProxy* a, btBroadphaseProxy* b, btRigidBody* body) {
    return a->m_clientObject == body || b->m_clientObject == body;
  }
};

template <typename World>
struct Scene : WorldOf<World> {
  explicit Scene(const Effect& effect) {
    this->world.setGravity(btVector3(0, -10, 0));
    auto* box = this->objects.box(btVector3(s(0.5), s(0.5), s(0.5)));
    trigger.trigger = this->objects.add(0, this->objects.box(btVector3(2, 1, 2)), btVector3(0, 0, 0));
    trigger.trigger->setCollisionFlags(trigger.trigger->getCollisionFlags() |
                                       btCollisionObject::CF_NO_CONTACT_RESPONSE);
    trigger.sleeper = this->objects.add(1, box, btVector3(20, 5, 0));
    trigger.sleeper->forceActivationState(ISLAND_SLEEPING);
    trigger.visitor = this->objects.add(1, box, btVector3(0, 3, 0));
    trigger.effect = effect;
    this->world.getPairCache()->setInternalGhostPairCallback(&trigger);
  }
  ~Scene() { this->world.getPairCache()->setInternalGhostPairCallback(nullptr); }
  Trigger trigger;
};

void compare(const Effect& effect, int steps = 40) {
  Scene<btGpuDynamicsWorld> gpu(effect);
  Scene<btDiscreteDynamicsWorld> stock(effect);
  for (int i = 0; i < steps; ++i) {
    gpu.run(1);
    stock.run(1);
    const std::string when = "step " + std::to_string(i) + ": ";
    const double tolerance = floatNoise(i + 1, 20);
    expectNear(stateOf(*gpu.trigger.sleeper), stateOf(*stock.trigger.sleeper), tolerance, when + "sleeper");
    expectNear(stateOf(*gpu.trigger.visitor), stateOf(*stock.trigger.visitor), tolerance, when + "visitor");
    EXPECT_EQ(gpu.trigger.added, stock.trigger.added) << when;
    EXPECT_EQ(gpu.trigger.removed, stock.trigger.removed) << when;
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(stock.trigger.added, 0) << "or nothing was tested";
  expectAllOnDevice(gpu.world);
}

TEST(PairCallbacks, OnlyWatching) { compare(nullptr); }

TEST(PairCallbacks, WakeABody) {
  compare([](btRigidBody& sleeper, btRigidBody&) { sleeper.activate(true); });
}

TEST(PairCallbacks, PushABody) {
  compare([](btRigidBody&, btRigidBody& visitor) {
    visitor.applyCentralImpulse(btVector3(3, 1, 0));
    visitor.applyTorqueImpulse(btVector3(0, s(0.5), 0));
  });
}

TEST(PairCallbacks, ForceOnABody) {
  compare([](btRigidBody&, btRigidBody& visitor) { visitor.applyCentralForce(btVector3(300, 0, 0)); });
}

TEST(PairCallbacks, MoveABody) {
  compare([](btRigidBody&, btRigidBody& visitor) {
    visitor.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 9, 0)));
    visitor.setLinearVelocity(btVector3(0, 0, 1));
  });
}

// The user callback of the sweep-and-prune broadphases is another one than the pair cache's.
TEST(PairCallbacks, OfAnAxisSweep) {
  const auto run = [](auto* type) {
    using World = std::remove_pointer_t<decltype(type)>;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btAxisSweep3 broadphase(btVector3(-50, -50, -50), btVector3(50, 50, 50));
    btSequentialImpulseConstraintSolver solver;
    World world(&dispatcher, &broadphase, &solver, &configuration);
    scenes::Objects objects(world);
    Trigger trigger;
    auto* box = objects.box(btVector3(s(0.5), s(0.5), s(0.5)));
    trigger.trigger = objects.add(0, objects.box(btVector3(2, 1, 2)), btVector3(0, 0, 0));
    trigger.sleeper = trigger.trigger;
    trigger.visitor = objects.add(1, box, btVector3(0, 3, 0));
    trigger.effect = [](btRigidBody&, btRigidBody& visitor) { visitor.setLinearVelocity(btVector3(2, 5, 0)); };
    broadphase.setOverlappingPairUserCallback(&trigger);
    for (int i = 0; i < 50; ++i) world.stepSimulation(s(1.0 / 60), 0);
    EXPECT_GT(trigger.added, 0);
    broadphase.setOverlappingPairUserCallback(nullptr);
    return stateOf(*trigger.visitor);
  };
  expectNear(run(static_cast<btGpuDynamicsWorld*>(nullptr)), run(static_cast<btDiscreteDynamicsWorld*>(nullptr)),
             floatNoise(50, 10), "visitor");
}

}  // namespace
}  // namespace btgpu::test
