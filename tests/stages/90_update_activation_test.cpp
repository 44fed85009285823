// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/90_update_activation.h"

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <set>

#include "gpu_engine/stages/90_update_activation_reference.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

struct SleepScene {
  WorldBuilder builder;
  StepSettings settings;

  uint add(int state, float time, float4 linear = {}, float4 angular = {}, uint flags = BODY_INTEGRATED) {
    const uint i = builder.add(m_shape, {}, 1);
    builder.info(i).flags = BODY_PRESENT | BODY_RIGID | flags;
    builder.activation(i) = {state, time};
    builder.velocity(i) = {linear, angular};
    return i;
  }
  uint bodyCount() const { return builder.bodyCount(); }

 private:
  int m_shape = builder.sphere(1);
};

struct Sleep {
  std::vector<BodyActivation> activations;
  std::vector<BodyVelocity> velocities;
};

class UpdateActivationTest : public DeviceTest {
 protected:
  Sleep device(const SleepScene& scene, uint overflow = 0) {
    const WorldInput in = scene.builder.finish();
    StageBench bench(queue(), in, scene.settings);
    DeviceWorld& world = bench.world();
    bench.write(world.stepActivations, in.activations.values);
    bench.poison(world.activations);
    StepCounters counters{};
    counters.overflow = overflow;
    bench.setCounters(counters);
    bench.run<UpdateActivation>();
    return {bench.read(world.activations, in.bodyCount), bench.read(world.velocities, in.bodyCount)};
  }

  Sleep expectAsReference(const SleepScene& scene) {
    const Sleep actual = device(scene);
    const WorldInput in = scene.builder.finish();
    Sleep expected = {in.activations.values, in.velocities.values};
    updateActivationReference(makeStepParams(scene.settings, false), in.infos.values, in.dampings.values,
                              expected.velocities, expected.activations);
    for (uint i = 0; i < scene.bodyCount(); ++i) {
      EXPECT_EQ(actual.activations[i].state, expected.activations[i].state) << "body " << i;
      EXPECT_EQ(actual.activations[i].deactivationTime, expected.activations[i].deactivationTime) << "body " << i;
      EXPECT_TRUE(sameBits(actual.velocities[i], expected.velocities[i])) << "body " << i;
      if (HasFailure()) break;
    }
    return actual;
  }
};

// ---- by hand

TEST_F(UpdateActivationTest, TimerSmall) {
  SleepScene scene;  // thresholds: 0.8 and 1
  scene.settings.timeStep = 0.25f;
  scene.add(STATE_ACTIVE, 1, {0.79f, 0, 0, 0}, {0, 0.99f, 0, 0});
  scene.add(STATE_ACTIVE, 1, {0, 0.8f, 0, 0});
  scene.add(STATE_ACTIVE, 1, {}, {0, 0, 1, 0});
  scene.add(STATE_ACTIVE, 1.74f);
  scene.add(STATE_ACTIVE, 1.75f);
  scene.add(STATE_ACTIVE, 1.76f);
  const Sleep s = expectAsReference(scene);
  EXPECT_EQ(s.activations[0].deactivationTime, 1.25f);
  EXPECT_EQ(s.activations[1].deactivationTime, 0) << "on the threshold is fast";
  EXPECT_EQ(s.activations[2].deactivationTime, 0);
  EXPECT_EQ(s.activations[3].state, STATE_ACTIVE);
  EXPECT_EQ(s.activations[4].state, STATE_ACTIVE) << "just the two seconds are not enough";
  EXPECT_EQ(s.activations[5].state, STATE_WANTS_DEACTIVATION);
}

TEST_F(UpdateActivationTest, SleepersStopSmall) {
  SleepScene scene;
  const uint i = scene.add(STATE_SLEEPING, 3, {5, 0, 0, 0}, {0, 5, 0, 0});
  const Sleep s = expectAsReference(scene);
  EXPECT_EQ(s.activations[i].state, STATE_SLEEPING);
  EXPECT_EQ(s.activations[i].deactivationTime, 3);
  EXPECT_TRUE(sameBits(s.velocities[i], BodyVelocity{}));
}

TEST_F(UpdateActivationTest, KinematicSleepsAtOnceSmall) {
  SleepScene scene;
  const uint slow = scene.add(STATE_ACTIVE, 3, {0.1f, 0, 0, 0}, {}, BODY_INTEGRATED | BODY_KINEMATIC);
  const uint fast = scene.add(STATE_ACTIVE, 3, {2, 0, 0, 0}, {}, BODY_INTEGRATED | BODY_KINEMATIC);
  const Sleep s = expectAsReference(scene);
  EXPECT_EQ(s.activations[slow].state, STATE_SLEEPING);
  EXPECT_EQ(s.velocities[slow].linear.x, 0.1f) << "and keeps its velocity";
  EXPECT_EQ(s.activations[fast].state, STATE_ACTIVE);
}

// Those not in the world's list, and those in quarantine: only committed.
TEST_F(UpdateActivationTest, NotIntegratedSmall) {
  SleepScene scene;
  for (const uint flags : {0u, BODY_STATIC, BODY_INTEGRATED | BODY_QUARANTINED}) {
    scene.add(STATE_ACTIVE, 3, {}, {}, flags);
    scene.add(STATE_SLEEPING, 3, {5, 0, 0, 0}, {}, flags);
  }
  const Sleep s = expectAsReference(scene);
  for (const uint i : {0u, 2u, 4u}) EXPECT_EQ(s.activations[i].state, STATE_ACTIVE) << "body " << i;
  for (const uint i : {1u, 3u, 5u}) EXPECT_EQ(s.velocities[i].linear.x, 5) << "body " << i;
}

TEST_F(UpdateActivationTest, NothingAfterOverflowSmall) {
  SleepScene scene;
  scene.add(STATE_SLEEPING, 3, {5, 0, 0, 0});
  const Sleep s = device(scene, OVERFLOW_PAIRS);
  EXPECT_TRUE(StageBench::isPoison(s.activations[0]));
  EXPECT_EQ(s.velocities[0].linear.x, 5);
}

// ---- every state with every speed, timer and setting

SleepScene everything() {
  SleepScene scene;
  const float4 velocities[] = {{}, {0.5f, 0.5f, 0, 0}, {0.7f, 0.7f, 0, 0}, {3, 0, 0, 0}};
  for (int state = STATE_UNSET; state <= STATE_FIXED_BASE; ++state) {
    for (const float4 linear : velocities) {
      for (const float4 angular : velocities) {
        for (const float time : {0.0f, 1.0f, 1.99f, 2.0f, 5.0f}) {
          for (const uint flags : {BODY_INTEGRATED, BODY_INTEGRATED | BODY_KINEMATIC}) {
            scene.add(state, time, linear, angular, flags);
          }
        }
      }
    }
  }
  return scene;
}

std::vector<StepSettings> sleepSettings() {
  std::vector<StepSettings> all(4);
  all[1].disableDeactivation = true;
  all[2].deactivationTime = 0;
  all[3].deactivationTime = 0.5f;
  all[3].timeStep = 0.1f;
  return all;
}

TEST_F(UpdateActivationTest, EverythingAsReference) {
  SleepScene scene = everything();
  for (const StepSettings& settings : sleepSettings()) {
    scene.settings = settings;
    expectAsReference(scene);
  }
}

TEST_F(UpdateActivationTest, HostDoesIt) {
  SleepScene scene = everything();
  scene.settings.hostActivation = true;
  const Sleep s = expectAsReference(scene);
  const WorldInput in = scene.builder.finish();
  for (uint i = 0; i < scene.bodyCount(); ++i) {
    ASSERT_TRUE(sameBits(s.activations[i], in.activations.values[i])) << "body " << i;
    ASSERT_TRUE(sameBits(s.velocities[i], in.velocities.values[i])) << "body " << i;
  }
}

TEST_F(UpdateActivationTest, ManyStepsSmall) {
  SleepScene scene;
  for (int i = 0; i < 5; ++i) scene.add(STATE_ACTIVE, 0, {0.3f * static_cast<float>(i), 0, 0, 0});
  scene.settings.timeStep = 0.125f;
  int steps = 0;
  for (; scene.builder.activation(0).state == STATE_ACTIVE && steps < 100; ++steps) {
    const Sleep s = expectAsReference(scene);
    for (uint i = 0; i < 5; ++i) scene.builder.activation(i) = s.activations[i];
  }
  EXPECT_EQ(steps, 17) << "the first step beyond two seconds";
  EXPECT_EQ(scene.builder.activation(2).state, STATE_WANTS_DEACTIVATION);
  EXPECT_EQ(scene.builder.activation(3).state, STATE_ACTIVE) << "too fast";
}

// ---- Bullet

class OpenBulletWorld : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;
  using btDiscreteDynamicsWorld::updateActivationState;
};

// Sets Bullet's globals for the time of a test.
struct BulletGlobals {
  explicit BulletGlobals(const StepSettings& s) : time(gDeactivationTime), disable(gDisableDeactivation) {
    gDeactivationTime = s.deactivationTime;
    gDisableDeactivation = s.disableDeactivation;
  }
  ~BulletGlobals() {
    gDeactivationTime = time;
    gDisableDeactivation = disable;
  }
  btScalar time;
  bool disable;
};

TEST_F(UpdateActivationTest, EverythingAsBullet) {
  SleepScene scene = everything();
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSphereShape shape(1);
  for (const StepSettings& settings : sleepSettings()) {
    scene.settings = settings;
    const BulletGlobals globals(settings);
    OpenBulletWorld world(&dispatcher, &broadphase, nullptr, &configuration);
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    for (uint i = 0; i < scene.bodyCount(); ++i) {
      bodies.push_back(std::make_unique<btRigidBody>(1.0f, nullptr, &shape, btVector3(1, 1, 1)));
      btRigidBody& body = *bodies.back();
      if (scene.builder.info(i).flags & BODY_KINEMATIC) {
        body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
      }
      world.addRigidBody(&body);
      const BodyVelocity& v = scene.builder.velocity(i);
      body.setLinearVelocity({v.linear.x, v.linear.y, v.linear.z});
      body.setAngularVelocity({v.angular.x, v.angular.y, v.angular.z});
      body.forceActivationState(scene.builder.activation(i).state);
      body.setDeactivationTime(scene.builder.activation(i).deactivationTime);
    }
    world.updateActivationState(settings.timeStep);
    const Sleep s = device(scene);
    std::set<int> states;
    for (uint i = 0; i < scene.bodyCount(); ++i) {
      ASSERT_EQ(s.activations[i].state, bodies[i]->getActivationState()) << "body " << i;
      ASSERT_EQ(s.activations[i].deactivationTime, bodies[i]->getDeactivationTime()) << "body " << i;
      ASSERT_EQ(s.velocities[i].linear.x, bodies[i]->getLinearVelocity().x()) << "body " << i;
      ASSERT_EQ(s.velocities[i].angular.x, bodies[i]->getAngularVelocity().x()) << "body " << i;
      states.insert(s.activations[i].state);
    }
    EXPECT_GE(states.size(), 3u);
    for (const auto& body : bodies) world.removeRigidBody(body.get());
  }
}

}  // namespace
}  // namespace btgpu
