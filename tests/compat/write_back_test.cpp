// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Everything that a step leaves in Bullet's objects, against stock, after every step.
#include <stdexcept>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

// A world with its bodies by name. The ground is a plane, on which balls touch in one point: contacts of
// several points are solved in another order than stock's.
template <typename World>
struct Yard {
  WorldOf<World> w;
  btSphereShape* ball;
  btBoxShape* box;
  std::vector<std::pair<std::string, btRigidBody*>> bodies;

  Yard() {
    w.world.setGravity(btVector3(0, -10, 0));
    add("ground", 0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    ball = w.objects.sphere(s(0.5));
    box = w.objects.box(btVector3(s(0.3), s(0.4), s(0.5)));
  }
  btRigidBody* add(const std::string& name, double mass, btCollisionShape* shape, const btVector3& at) {
    btRigidBody* body = w.objects.add(s(mass), shape, at);
    bodies.push_back({name, body});
    return body;
  }
  btRigidBody* operator[](const std::string& name) const {
    for (const auto& b : bodies) {
      if (b.first == name) return b.second;
    }
    throw std::out_of_range(name);
  }
};

// Bodies in contact: each step the rounding of their distance is turned into a velocity within one time step,
// and forgotten in the next one.
double contactNoise(double scale) { return floatNoise(1, scale) * 60; }

template <typename Build, typename EachStep>
void compare(const Build& build, const EachStep& eachStep, int steps, double scale, bool touching = true) {
  Yard<btGpuDynamicsWorld> gpu;
  Yard<btDiscreteDynamicsWorld> stock;
  build(gpu);
  build(stock);
  for (int step = 0; step < steps; ++step) {
    eachStep(gpu, step);
    eachStep(stock, step);
    gpu.w.run(1);
    stock.w.run(1);
    for (size_t i = 0; i < gpu.bodies.size(); ++i) {
      expectNear(stateOf(*gpu.bodies[i].second), stateOf(*stock.bodies[i].second),
                 floatNoise(step + 1, scale) + (touching ? contactNoise(scale) : 0),
                 "step " + std::to_string(step) + " " + gpu.bodies[i].first);
    }
    if (testing::Test::HasFailure()) return;
  }
  expectAllOnDevice(gpu.w.world);
}

constexpr auto nothing = [](auto&, int) {};

TEST(WriteBack, FreeBodies) {
  compare(
      [](auto& y) {
        btRigidBody* b = y.add("spinning box", 2, y.box, btVector3(0, 20, 0));
        b->setLinearVelocity(btVector3(1, 2, 3));
        b->setAngularVelocity(btVector3(1, s(0.5), s(0.2)));
        b = y.add("damped ball", 1, y.ball, btVector3(5, 20, 0));
        b->setLinearVelocity(btVector3(1, 2, 3));
        b->setAngularVelocity(btVector3(1, s(0.5), s(0.2)));
        b->setDamping(s(0.3), s(0.6));
        b = y.add("bound to an axis", 1, y.box, btVector3(10, 20, 0));
        b->setLinearFactor(btVector3(1, 0, s(0.5)));
        b->setAngularFactor(btVector3(0, 1, 0));
        b->setLinearVelocity(btVector3(1, 0, 3));
        b->setAngularVelocity(btVector3(0, 2, 0));
        b = y.add("without gravity", 1, y.box, btVector3(15, 20, 0));
        b->setFlags(b->getFlags() | BT_DISABLE_WORLD_GRAVITY);
        b->setGravity(btVector3(0, 0, s(1.01)));  // at 1 its speed would come to the sleeping threshold exactly
        b = y.add("always awake", 1, y.ball, btVector3(20, 20, 0));
        b->setActivationState(DISABLE_DEACTIVATION);
        b = y.add("out of the simulation", 1, y.ball, btVector3(25, 20, 0));
        b->setLinearVelocity(btVector3(1, 0, 0));
        b->setActivationState(DISABLE_SIMULATION);
        b = y.add("asleep in the air", 1, y.ball, btVector3(30, 20, 0));
        b->forceActivationState(ISLAND_SLEEPING);
      },
      nothing, 60, 40, false);
}

// Forces act for one stepSimulation and are gone afterwards; those on a sleeping body as well.
TEST(WriteBack, ForcesAndImpulses) {
  compare(
      [](auto& y) {
        y.w.world.setGravity(btVector3(0, 0, 0));
        for (const char* name : {"a", "b", "c", "asleep"})
          y.add(name, 2, y.box, btVector3(s(5.0 * double(y.bodies.size())), 20, 0));
        y["asleep"]->forceActivationState(ISLAND_SLEEPING);
      },
      [](auto& y, int step) {
        if (step % 3 == 0) y["a"]->applyForce(btVector3(1, 2, s(step)), btVector3(0, s(0.1), 0));
        if (step % 3 == 1) y["b"]->applyTorque(btVector3(s(0.1), s(0.2), s(0.3)));
        if (step % 3 == 2) y["c"]->applyImpulse(btVector3(s(0.1), 0, s(0.2)), btVector3(0, s(0.1), 0));
        if (step % 3 == 2) y["c"]->applyCentralForce(btVector3(0, 1, 0));
        y["c"]->applyTorqueImpulse(btVector3(s(0.001), 0, 0));
        y["asleep"]->applyCentralForce(btVector3(5, 0, 0));
      },
      40, 25, false);
}

// Balls that fall, come to rest and fall asleep: timers, states, zeroed velocities; then one is woken up.
TEST(WriteBack, FallingAsleep) {
  compare(
      [](auto& y) {
        y.add("ball", 1, y.ball, btVector3(0, s(0.501), 0));
        y.add("ball above", 1, y.ball, btVector3(3, s(0.7), 0))->setRestitution(0);
        btRigidBody* b = y.add("slow threshold", 1, y.ball, btVector3(6, s(0.5), 0));
        b->setSleepingThresholds(s(0.001), s(0.001));
        b->setLinearVelocity(btVector3(s(0.1), 0, 0));
        b = y.add("never sleeps", 1, y.ball, btVector3(9, s(0.5), 0));
        b->setActivationState(DISABLE_DEACTIVATION);
        y.add("free and slow", 1, y.ball, btVector3(12, 20, 0))->setGravity(btVector3(0, 0, 0));
      },
      [](auto& y, int step) {
        if (step == 150) {
          EXPECT_EQ(y["ball"]->getActivationState(), ISLAND_SLEEPING);
          y["ball"]->activate(true);
        }
        if (step == 155) y["free and slow"]->setActivationState(WANTS_DEACTIVATION);
      },
      170, 5);
}

// A sleeping ball is woken by another that runs into it. Stock wakes it when the boxes in its broadphase
// meet, which reach a little ahead of the body: a step earlier, so that in the step of the impact its sleeper
// has weight, and ours not yet. That is mu * g * dt = 0.25 * 10 / 60 of velocity by friction.
TEST(WriteBack, WokenByAnother) {
  Yard<btGpuDynamicsWorld> gpu;
  Yard<btDiscreteDynamicsWorld> stock;
  const auto run = [](auto& y) {
    y.add("sleeper", 1, y.ball, btVector3(0, s(0.5), 0))->forceActivationState(ISLAND_SLEEPING);
    y.add("runner", 1, y.ball, btVector3(-3, s(0.5), 0))->setLinearVelocity(btVector3(5, 0, 0));
    y.w.run(20);
    EXPECT_EQ(y["sleeper"]->getActivationState(), ISLAND_SLEEPING);
    y.w.run(20);
  };
  run(gpu);
  run(stock);
  const double velocity = 0.25 * 10 / 60, position = velocity * 20 / 60;
  for (const char* name : {"sleeper", "runner"}) {
    const BodyState a = stateOf(*gpu[name]), b = stateOf(*stock[name]);
    EXPECT_LE(distance(a.transform.getOrigin(), b.transform.getOrigin()), position) << name;
    EXPECT_LE(distance(a.linear, b.linear), velocity) << name;
    EXPECT_EQ(a.activation, b.activation) << name;
  }
  EXPECT_GT(double(gpu["sleeper"]->getLinearVelocity().x()), 1);
  expectAllOnDevice(gpu.w.world);
}

struct MovingState : btMotionState {
  btTransform transform = btTransform::getIdentity();
  void getWorldTransform(btTransform& t) const override { t = transform; }
  void setWorldTransform(const btTransform&) override { ADD_FAILURE() << "a kinematic body is not written to"; }
};

// Kinematic bodies: the velocity comes from saveKinematicState, with and without a motion state.
TEST(WriteBack, KinematicBodies) {
  MovingState states[2];
  int world = 0;
  compare(
      [&](auto& y) {
        for (const char* name : {"by hand", "by motion state", "that stands still"}) {
          btRigidBody* b = y.add(name, 0, y.box, btVector3(s(4.0 * double(y.bodies.size())), 3, 0));
          y.w.world.removeRigidBody(b);
          b->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
          b->setActivationState(DISABLE_DEACTIVATION);
          y.w.world.addRigidBody(b);
        }
        states[world].transform = y["by motion state"]->getWorldTransform();
        y["by motion state"]->setMotionState(&states[world]);
        ++world;
        y.add("carried", 1, y.ball, y["by hand"]->getWorldTransform().getOrigin() + btVector3(0, s(0.9), 0))
            ->setFriction(1);
      },
      [&](auto& y, int step) {
        const btQuaternion turn(btVector3(0, 1, 0), s(0.01 * step));
        btTransform t(turn, y["by hand"]->getWorldTransform().getOrigin() + btVector3(s(0.001), 0, 0));
        y["by hand"]->setWorldTransform(t);
        MovingState& state = y["by motion state"]->getMotionState() == &states[0] ? states[0] : states[1];
        state.transform.getOrigin() += btVector3(0, s(0.02), s(0.01));
      },
      60, 20);
}

// Applications move static bodies although they should not; contacts follow.
TEST(WriteBack, StaticBodyMovedByTheApplication) {
  compare(
      [](auto& y) {
        y.w.world.removeRigidBody(y["ground"]);
        y.add("table", 0, y.w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 2, 0));
        y.add("ball", 1, y.ball, btVector3(0, s(2.5), 0));
        y.bodies.erase(y.bodies.begin());
      },
      [](auto& y, int step) {
        btTransform t = y["table"]->getWorldTransform();
        t.getOrigin() -= btVector3(0, s(step < 30 ? 0.001 : 0.3), 0);
        y["table"]->setWorldTransform(t);
      },
      60, 5);
}

// addCollisionObject with a rigid body: the solver sees it, nobody integrates it.
TEST(WriteBack, RigidBodyAddedAsCollisionObject) {
  compare(
      [](auto& y) {
        btRigidBody* b = y.add("plain", 1, y.ball, btVector3(0, s(0.5), 0));
        y.w.world.removeRigidBody(b);
        y.w.world.addCollisionObject(b);
        y.add("falls on it", 1, y.ball, btVector3(0, s(1.59), 0));
        b = y.add("static", 0, y.ball, btVector3(5, s(0.5), 0));
        y.w.world.removeRigidBody(b);
        y.w.world.addCollisionObject(b, btBroadphaseProxy::StaticFilter, btBroadphaseProxy::AllFilter);
        y.add("falls on the static one", 1, y.ball, btVector3(5, s(1.59), 0));
      },
      nothing, 30, 5);
}

// A plain btCollisionObject is an obstacle.
TEST(WriteBack, CollisionObject) {
  btCollisionObject objects[2];
  {
    Yard<btGpuDynamicsWorld> gpu;
    Yard<btDiscreteDynamicsWorld> stock;
    const auto run = [](auto& y, btCollisionObject& object) {
      object.setCollisionShape(y.ball);
      object.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 1, 0)));
      y.w.world.addCollisionObject(&object);
      y.add("ball", 1, y.ball, btVector3(0, s(2.09), 0));
      y.w.run(30);
      y.w.world.removeCollisionObject(&object);
    };
    run(gpu, objects[0]);
    run(stock, objects[1]);
    EXPECT_GT(double(stock["ball"]->getWorldTransform().getOrigin().y()), 1.9);
    expectNear(stateOf(*gpu["ball"]), stateOf(*stock["ball"]), floatNoise(30, 5) + contactNoise(5), "ball");
    expectAllOnDevice(gpu.w.world);
  }
  EXPECT_EQ(objects[0].getActivationState(), objects[1].getActivationState());
  EXPECT_EQ(objects[0].getDeactivationTime(), objects[1].getDeactivationTime());
  EXPECT_EQ(objects[0].getHitFraction(), objects[1].getHitFraction());
}

// Flags that applications keep for themselves, user pointers and indices are left alone.
TEST(WriteBack, LeavesTheRestAlone) {
  GpuWorld w;
  w.world.setGravity(btVector3(0, -10, 0));
  btRigidBody* body = w.objects.add(1, w.objects.sphere(1), btVector3(0, 10, 0));
  const int ownFlag = 1 << 20;
  body->setCollisionFlags(body->getCollisionFlags() | ownFlag);
  body->setUserPointer(&w);
  body->setUserIndex(7);
  body->setUserIndex2(8);
  body->setUserIndex3(9);
  btRigidBody* still = w.objects.add(0, w.objects.sphere(1), btVector3(0, -10, 0));
  still->setHitFraction(s(0.25));
  still->setDeactivationTime(s(0.1));
  w.run(5);
  EXPECT_TRUE(body->getCollisionFlags() & ownFlag);
  EXPECT_EQ(body->getUserPointer(), &w);
  EXPECT_EQ(body->getUserIndex(), 7);
  EXPECT_EQ(body->getUserIndex2(), 8);
  EXPECT_EQ(body->getUserIndex3(), 9);
  EXPECT_EQ(still->getHitFraction(), s(0.25)) << "stock does not touch a static body";
  EXPECT_EQ(still->getDeactivationTime(), s(0.1));
  expectAllOnDevice(w.world);
}

// What stock keeps in the world itself for others to read.
TEST(WriteBack, StepInfo) {
  GpuWorld w;
  StockWorld stock;
  w.run(1, 1.0 / 100);
  stock.run(1, 1.0 / 100);
  EXPECT_EQ(w.world.getSolverInfo().m_timeStep, stock.world.getSolverInfo().m_timeStep);
  EXPECT_EQ(w.world.getDispatchInfo().m_timeStep, stock.world.getDispatchInfo().m_timeStep);
  EXPECT_EQ(w.world.getDispatchInfo().m_stepCount, stock.world.getDispatchInfo().m_stepCount);
}

}  // namespace
}  // namespace btgpu::test
