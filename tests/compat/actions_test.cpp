// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Actions: called each substep with current transforms; what they change counts, and the sleep timers come
// after them.
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>

#include <functional>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

struct Action : btActionInterface {
  std::function<void(btCollisionWorld&, btScalar)> work;
  void updateAction(btCollisionWorld* world, btScalar timeStep) override { work(*world, timeStep); }
  void debugDraw(btIDebugDraw*) override {}
};

template <typename World>
struct Scene {
  WorldOf<World> w;
  Action action;
  std::vector<double> seen;
  btRigidBody *thrown, *resting;

  Scene() {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    btCollisionShape* ball = w.objects.sphere(s(0.5));
    thrown = w.objects.add(1, ball, btVector3(0, 10, 0));
    resting = w.objects.add(1, ball, btVector3(5, s(0.5), 0));
    w.world.addAction(&action);
  }
  ~Scene() { w.world.removeAction(&action); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  void expectSameAs(const Scene<btDiscreteDynamicsWorld>& stock, int substeps) const {
    // A contact turns the rounding of a position into a velocity, by the inverse of the time step.
    const double tolerance = floatNoise(substeps, 10) + 60 * floatNoise(1, 10);
    expectNear(stateOf(*thrown), stateOf(*stock.thrown), tolerance, "thrown ball");
    expectNear(stateOf(*resting), stateOf(*stock.resting), tolerance, "resting ball");
    ASSERT_EQ(seen.size(), stock.seen.size());
    for (size_t i = 0; i < seen.size(); ++i) ASSERT_NEAR(seen[i], stock.seen[i], tolerance) << "call " << i;
  }
};

// `setUp(scene)` gives the action its work; `frames` frames of two substeps.
template <typename SetUp>
void compare(const SetUp& setUp, int frames) {
  Scene<btGpuDynamicsWorld> gpu;
  Scene<btDiscreteDynamicsWorld> stock;
  setUp(gpu);
  setUp(stock);
  for (int i = 0; i < frames; ++i) {
    gpu.w.world.stepSimulation(s(1.0 / 30), 4, s(1.0 / 60));
    stock.w.world.stepSimulation(s(1.0 / 30), 4, s(1.0 / 60));
    gpu.expectSameAs(stock, 2 * (i + 1));
    if (testing::Test::HasFatalFailure() || testing::Test::HasNonfatalFailure()) return;
  }
  EXPECT_EQ(gpu.w.world.statistics().m_deviceSteps, unsigned(2 * frames));
  expectAllOnDevice(gpu.w.world, {"actions"});
}

TEST(Actions, SeeEachSubstep) {
  compare(
      [](auto& scene) {
        scene.action.work = [&scene](btCollisionWorld&, btScalar timeStep) {
          scene.seen.push_back(double(scene.thrown->getWorldTransform().getOrigin().y()));
          scene.seen.push_back(double(scene.thrown->getInterpolationWorldTransform().getOrigin().y()));
          scene.seen.push_back(double(scene.thrown->getLinearVelocity().y()));
          scene.seen.push_back(double(timeStep));
        };
      },
      20);
}

TEST(Actions, ChangeVelocitiesAndForces) {
  compare(
      [](auto& scene) {
        scene.action.work = [&scene](btCollisionWorld&, btScalar timeStep) {
          btRigidBody& b = *scene.thrown;
          b.setLinearVelocity(b.getLinearVelocity() * s(0.99) + btVector3(s(0.1), 0, 0));
          b.applyCentralForce(btVector3(0, 0, 5));  // counts in the next substep of the same frame
          b.applyTorqueImpulse(btVector3(0, timeStep, 0));
        };
      },
      30);
}

// The timers are advanced after the actions, with their velocities.
TEST(Actions, SleepTimersComeAfterThem) {
  compare(
      [](auto& scene) {
        scene.action.work = [&scene](btCollisionWorld&, btScalar) {
          // Fast during the solve, slow when the timers look, and the other way round.
          scene.thrown->setLinearVelocity(btVector3(0, s(0.3), 0));
          scene.thrown->setAngularVelocity(btVector3(0, 0, 0));
          scene.resting->setAngularVelocity(btVector3(0, s(1.5), 0));
        };
      },
      80);
}

TEST(Actions, PutBodiesToSleepAndWakeThem) {
  compare(
      [](auto& scene) {
        auto calls = std::make_shared<int>(0);
        scene.action.work = [&scene, calls](btCollisionWorld&, btScalar) {
          ++*calls;
          if (*calls == 5) scene.resting->forceActivationState(ISLAND_SLEEPING);
          if (*calls == 20) scene.resting->activate(true);
          if (*calls == 10) scene.thrown->forceActivationState(DISABLE_SIMULATION);
          if (*calls == 30) scene.thrown->forceActivationState(ACTIVE_TAG);
        };
      },
      30);
}

// With an action in the world, and without, bodies fall asleep in the same step.
TEST(Actions, IdleActionChangesNothing) {
  compare([](auto& scene) { scene.action.work = [](btCollisionWorld&, btScalar) {}; }, 75);
}

TEST(Actions, AddAndRemoveBodiesAndActions) {
  Action second;
  int calls = 0;
  second.work = [&calls](btCollisionWorld&, btScalar) { ++calls; };
  int callsOf[2], world = 0;
  const auto run = [&](auto& scene) {
    calls = 0;
    int count = 0;
    scene.action.work = [&](btCollisionWorld& w, btScalar) {
      ++count;
      auto& dynamics = static_cast<btDiscreteDynamicsWorld&>(w);
      if (count == 3) dynamics.addAction(&second);
      if (count == 5) dynamics.removeRigidBody(scene.resting);
      if (count == 9) dynamics.addRigidBody(scene.resting);
      if (count == 12) dynamics.removeAction(&second);
    };
    scene.w.run(20);
    callsOf[world++] = calls;
    scene.action.work = [](btCollisionWorld&, btScalar) {};
  };
  Scene<btGpuDynamicsWorld> gpu;
  Scene<btDiscreteDynamicsWorld> stock;
  run(gpu);
  run(stock);
  EXPECT_EQ(callsOf[0], callsOf[1]);
  gpu.expectSameAs(stock, 20);
  expectAllOnDevice(gpu.w.world, {"actions"});
}

// A raycast vehicle: ray tests from inside the action, impulses by its wheels.
template <typename World>
struct Car {
  WorldOf<World> w;
  btRigidBody* chassis;
  btRaycastVehicle* vehicle;

  Car() {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    chassis = w.objects.add(800, w.objects.box(btVector3(1, s(0.5), 2)), btVector3(0, s(1.49), 0));
    chassis->setActivationState(DISABLE_DEACTIVATION);
    vehicle = w.objects.vehicle(chassis, 1);
  }

  void drive(int frame) {
    for (int wheel = 2; wheel < 4; ++wheel) vehicle->applyEngineForce(s(frame < 90 ? 1500 : 0), wheel);
    for (int wheel = 0; wheel < 2; ++wheel) vehicle->setSteeringValue(s(frame > 30 ? 0.2 : 0), wheel);
    for (int wheel = 0; wheel < 4; ++wheel) vehicle->setBrake(s(frame > 120 ? 20 : 0), wheel);
    w.run(1);
  }
};

TEST(Vehicle, DrivesAsInStock) {
  Car<btGpuDynamicsWorld> gpu;
  Car<btDiscreteDynamicsWorld> stock;
  for (int frame = 0; frame < 180; ++frame) {
    gpu.drive(frame);
    stock.drive(frame);
  }
  const btVector3 a = gpu.chassis->getWorldTransform().getOrigin(), b = stock.chassis->getWorldTransform().getOrigin();
  EXPECT_GT(double(b.length()), 5) << "it should have driven away";
  EXPECT_LE(distance(a, b), floatNoise(180, 10));
  EXPECT_LE(distance(gpu.chassis->getLinearVelocity(), stock.chassis->getLinearVelocity()), floatNoise(180, 10));
  for (int wheel = 0; wheel < 4; ++wheel) {
    EXPECT_EQ(gpu.vehicle->getWheelInfo(wheel).m_raycastInfo.m_isInContact,
              stock.vehicle->getWheelInfo(wheel).m_raycastInfo.m_isInContact);
  }
  expectAllOnDevice(gpu.w.world, {"actions"});
}

// A character controller: sweeps and contacts of its ghost inside the action.
template <typename World>
struct Walker {
  btGhostPairCallback pairCallback;
  WorldOf<World> w;
  btPairCachingGhostObject ghost;
  btSphereShape shape{s(0.5)};
  std::unique_ptr<btKinematicCharacterController> controller;

  Walker() {
    w.broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&pairCallback);
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    w.objects.add(0, w.objects.box(btVector3(s(0.5), 1, 3)), btVector3(5, 1, 0));  // a wall in its way
    btRigidBody* falling = w.objects.add(1, w.objects.sphere(s(0.5)), btVector3(2, 6, s(0.1)));
    falling->setRestitution(s(0.5));
    ghost.setCollisionShape(&shape);
    ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, s(1.5), 0)));
    ghost.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
    w.world.addCollisionObject(&ghost, btBroadphaseProxy::CharacterFilter,
                               btBroadphaseProxy::StaticFilter | btBroadphaseProxy::DefaultFilter);
    controller = std::make_unique<btKinematicCharacterController>(&ghost, &shape, s(0.2));
    controller->setGravity(btVector3(0, -10, 0));
    w.world.addCharacter(controller.get());
  }
  ~Walker() {
    w.world.removeCharacter(controller.get());
    w.world.removeCollisionObject(&ghost);
  }
  Walker(const Walker&) = delete;
  Walker& operator=(const Walker&) = delete;
};

TEST(Character, WalksAsInStock) {
  Walker<btGpuDynamicsWorld> gpu;
  Walker<btDiscreteDynamicsWorld> stock;
  for (int frame = 0; frame < 120; ++frame) {
    const auto walk = [frame](auto& walker) {
      walker.controller->setWalkDirection(btVector3(s(0.06), 0, s(frame > 60 ? 0.02 : 0)));
      if (frame == 40 && walker.controller->canJump()) walker.controller->jump(btVector3(0, 5, 0));
      walker.w.run(1);
    };
    walk(gpu);
    walk(stock);
    const btVector3 a = gpu.ghost.getWorldTransform().getOrigin(), b = stock.ghost.getWorldTransform().getOrigin();
    ASSERT_LE(distance(a, b), 0.01) << "frame " << frame;  // the controller's own sweeps stop 0.02 short
  }
  EXPECT_GT(double(stock.ghost.getWorldTransform().getOrigin().x()), 2);
  expectAllOnDevice(gpu.w.world, {"actions"});
}

}  // namespace
}  // namespace btgpu::test
