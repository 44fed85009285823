// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Classes that an application derives from the world, and pair caches of its own: a stage that was overridden
// has to be called, so the step runs on the stock path and says why.
#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

int calls = 0;

#define OVERRIDING(Name, Function, Declaration, ...) \
  struct Name : btGpuDynamicsWorld {                 \
    using btGpuDynamicsWorld::btGpuDynamicsWorld;    \
    static const char* stage() { return #Function; } \
    void Function Declaration override {             \
      ++calls;                                       \
      btGpuDynamicsWorld::Function(__VA_ARGS__);     \
    }                                                \
  }

OVERRIDING(Predicting, predictUnconstraintMotion, (btScalar timeStep), timeStep);
OVERRIDING(PredictingContacts, createPredictiveContacts, (btScalar timeStep), timeStep);
OVERRIDING(Colliding, performDiscreteCollisionDetection, ());
OVERRIDING(Grouping, calculateSimulationIslands, ());
OVERRIDING(Solving, solveConstraints, (btContactSolverInfo & info), info);
OVERRIDING(Integrating, integrateTransforms, (btScalar timeStep), timeStep);
OVERRIDING(Activating, updateActivationState, (btScalar timeStep), timeStep);

template <typename World>
class OverriddenStage : public testing::Test {};
using Worlds = testing::Types<Predicting, PredictingContacts, Colliding, Grouping, Solving, Integrating, Activating>;
TYPED_TEST_SUITE(OverriddenStage, Worlds);

TYPED_TEST(OverriddenStage, IsCalled) {
  calls = 0;
  WorldOf<TypeParam> w;
  w.objects.add(1, w.objects.sphere(1), btVector3(0, 5, 0));
  w.run(3);
  EXPECT_EQ(calls, 3);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 3u);
  const btGpuFallback world = reported(w.world, "world");
  EXPECT_EQ(world.m_count, 3u);
  EXPECT_EQ(world.m_reason, std::string("its class overrides ") + TypeParam::stage());
}

// What stepSimulation calls around the step is called there as ever.
struct AroundTheStep : btGpuDynamicsWorld {
  using btGpuDynamicsWorld::btGpuDynamicsWorld;
  void saveKinematicState(btScalar timeStep) override {
    ++calls;
    btGpuDynamicsWorld::saveKinematicState(timeStep);
  }
  void applyGravity() override {
    ++calls;
    btGpuDynamicsWorld::applyGravity();
  }
  void synchronizeMotionStates() override {
    ++calls;
    btGpuDynamicsWorld::synchronizeMotionStates();
  }
  void clearForces() override {
    ++calls;
    btGpuDynamicsWorld::clearForces();
  }
};

TEST(DerivedWorld, StaysOnTheDevice) {
  calls = 0;
  WorldOf<AroundTheStep> w;
  w.objects.add(1, w.objects.sphere(1), btVector3(0, 5, 0));
  w.run(3);
  EXPECT_EQ(calls, 12);
  expectAllOnDevice(w.world);
}

// A pair cache that keeps pairs out in its own way.
struct PickyCache : btHashedOverlappingPairCache {
  btBroadphasePair* addOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*) override { return nullptr; }
};

TEST(DerivedPairCache, RunsOnTheStockPath) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  PickyCache cache;
  btDbvtBroadphase broadphase(&cache);
  btSequentialImpulseConstraintSolver solver;
  btGpuDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  scenes::Objects objects(world);
  objects.add(0, objects.box(btVector3(5, 1, 5)), btVector3(0, -1, 0));
  btRigidBody* ball = objects.add(1, objects.sphere(btScalar(0.5)), btVector3(0, btScalar(0.6), 0));
  for (int i = 0; i < 60; ++i) world.stepSimulation(btScalar(1.0 / 60), 0);
  EXPECT_LT(double(ball->getWorldTransform().getOrigin().y()), -1) << "its cache lets it fall through";
  EXPECT_EQ(reported(world, "pair cache").m_count, 60u);
}

// Bullet's other two caches are its own.
TEST(DerivedPairCache, SortedCacheIsBulletsOwn) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btSortedOverlappingPairCache cache;
  btSimpleBroadphase broadphase(16, &cache);
  btSequentialImpulseConstraintSolver solver;
  btGpuDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  scenes::Objects objects(world);
  objects.add(1, objects.sphere(btScalar(0.5)), btVector3(0, 1, 0));
  for (int i = 0; i < 3; ++i) world.stepSimulation(btScalar(1.0 / 60), 0);
  expectAllOnDevice(world);
}

// Contacts of a detection that the application asked for itself do not stay in the dispatcher as they are once the
// world steps: they are brought up to date, or go if the application wants none.
class OwnDetection : public testing::TestWithParam<bool> {};

TEST_P(OwnDetection, LeavesNoStaleManifolds) {
  btGpuSettings settings;
  settings.m_contacts = GetParam();
  GpuWorld w(settings);
  w.objects.add(0, w.objects.box(btVector3(5, 1, 5)), btVector3(0, -1, 0));
  btRigidBody* ball = w.objects.add(1, w.objects.sphere(btScalar(0.5)), btVector3(0, btScalar(0.49), 0));
  for (int i = 0; i < 2; ++i) {
    w.world.performDiscreteCollisionDetection();
    EXPECT_EQ(w.dispatcher.getNumManifolds(), 1);
    w.run(1);
    ASSERT_EQ(w.dispatcher.getNumManifolds(), settings.m_contacts ? 1 : 0);
    if (!settings.m_contacts) continue;
    const btPersistentManifold& m = *w.dispatcher.getManifoldByIndexInternal(0);
    ASSERT_EQ(m.getNumContacts(), 1);
    EXPECT_GT(m.getContactPoint(0).m_appliedImpulse, 0) << "of the step, not of the detection before it";
  }
  w.run(60);
  EXPECT_NEAR(double(ball->getWorldTransform().getOrigin().y()), 0.5, 0.02);
  expectAllOnDevice(w.world);
}
INSTANTIATE_TEST_SUITE_P(Contacts, OwnDetection, testing::Bool());

}  // namespace
}  // namespace btgpu::test
