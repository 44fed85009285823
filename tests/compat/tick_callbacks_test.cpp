// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Tick callbacks before and after each substep: their order, what they see, and what they may do. Each case
// runs on stock, on the device and on btgpu's stock path, and all three must tell the same story.
#include <functional>
#include <stdexcept>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

constexpr double kStep = 1.0 / 60;

enum class Way { Device, Fallback };

template <typename World>
struct WorldFor;
template <>
struct WorldFor<btDiscreteDynamicsWorld> : WorldOf<btDiscreteDynamicsWorld> {
  explicit WorldFor(Way) {}
};
template <>
struct WorldFor<btGpuDynamicsWorld> : WorldOf<btGpuDynamicsWorld> {
  explicit WorldFor(Way way) : WorldOf<btGpuDynamicsWorld>(settingsFor(way)) {}
  static btGpuSettings settingsFor(Way way) {
    btGpuSettings settings;
    settings.m_stockOnly = way == Way::Fallback;
    return settings;
  }
};

// One event: who was called, and what it saw of the first body.
struct Event {
  std::string who;
  btVector3 position, velocity;
};

class SceneBase : public btActionInterface, public btMotionState {
 public:
  std::vector<Event> events;
  std::vector<btRigidBody*> bodies;
  // What the test does inside the callbacks; `tick` counts substeps from 0.
  std::function<void(SceneBase&, int tick)> before, after;
  btDiscreteDynamicsWorld* world = nullptr;
  int ticks = 0;

  void note(const std::string& who) {
    events.push_back({who, bodies[0]->getWorldTransform().getOrigin(), bodies[0]->getLinearVelocity()});
  }
  static SceneBase& of(btDynamicsWorld* w) { return *static_cast<SceneBase*>(w->getWorldUserInfo()); }
  static void pre(btDynamicsWorld* w, btScalar timeStep) {
    SceneBase& scene = of(w);
    scene.note("pre " + std::to_string(double(timeStep)));
    if (scene.before) scene.before(scene, scene.ticks);
  }
  static void otherPre(btDynamicsWorld* w, btScalar) { of(w).note("other pre"); }
  static void otherPost(btDynamicsWorld* w, btScalar) { of(w).note("other post"); }
  static void post(btDynamicsWorld* w, btScalar timeStep) {
    SceneBase& scene = of(w);
    scene.note("post " + std::to_string(double(timeStep)));
    const int tick = scene.ticks++;
    if (scene.after) scene.after(scene, tick);
  }

  void updateAction(btCollisionWorld*, btScalar) override { note("action"); }
  void debugDraw(btIDebugDraw*) override {}
  void getWorldTransform(btTransform&) const override {}
  void setWorldTransform(const btTransform&) override { note("motion state"); }
};

// Six balls in the air, two of which meet a floor later, an action, and a motion state at the first ball.
template <typename World>
struct Scene : SceneBase {
  WorldFor<World> w;
  btSphereShape* ball;

  explicit Scene(Way way, bool withAction = true) : w(way) {
    world = &w.world;
    world->setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    ball = w.objects.sphere(btScalar(0.5));
    for (int i = 0; i < 6; ++i) bodies.push_back(newBall(btVector3(btScalar(2 * i), btScalar(i < 2 ? 0.7 : 10), 0)));
    bodies[0]->setMotionState(this);
    if (withAction) world->addAction(this);
    world->setInternalTickCallback(pre, static_cast<SceneBase*>(this), true);
    world->setInternalTickCallback(post, static_cast<SceneBase*>(this), false);
  }
  ~Scene() override {
    for (btRigidBody* body : bodies) {
      world->removeRigidBody(body);
      delete body;
    }
    world->removeAction(this);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  btRigidBody* newBall(const btVector3& at) {
    btRigidBody::btRigidBodyConstructionInfo info(1, nullptr, ball,
                                                  btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1)));
    info.m_startWorldTransform.setOrigin(at);
    auto* body = new btRigidBody(info);
    world->addRigidBody(body);
    return body;
  }
  int step() { return world->stepSimulation(btScalar(2 * kStep), 5, btScalar(kStep)); }
};

// Numbers within float noise on the device, exactly the same on the stock path.
double toleranceOf(Way way, int substeps) { return way == Way::Device ? floatNoise(substeps, 12) : 0; }

void expectSameStory(const SceneBase& ours, const SceneBase& stock, double tolerance) {
  ASSERT_EQ(ours.events.size(), stock.events.size());
  for (size_t i = 0; i < ours.events.size(); ++i) {
    ASSERT_EQ(ours.events[i].who, stock.events[i].who) << "event " << i;
    ASSERT_LE(distance(ours.events[i].position, stock.events[i].position), tolerance)
        << "event " << i << " " << ours.events[i].who;
    ASSERT_LE(distance(ours.events[i].velocity, stock.events[i].velocity), tolerance)
        << "event " << i << " " << ours.events[i].who;
  }
  ASSERT_EQ(ours.bodies.size(), stock.bodies.size());
  for (size_t i = 0; i < ours.bodies.size(); ++i) {
    expectNear(stateOf(*ours.bodies[i]), stateOf(*stock.bodies[i]), tolerance, "body " + std::to_string(i));
  }
}

void expectWay(const btGpuDynamicsWorld& world, Way way, int substeps) {
  EXPECT_EQ(world.statistics().m_deviceSteps, way == Way::Device ? unsigned(substeps) : 0u) << reportText(world);
  EXPECT_EQ(world.statistics().m_stockSteps, way == Way::Fallback ? unsigned(substeps) : 0u);
}

using Work = std::function<void(SceneBase&, int tick)>;

// `frames` times two substeps with `before` and `after` inside the callbacks.
void compare(Way way, int frames, const Work& before, const Work& after, bool withAction = true) {
  Scene<btGpuDynamicsWorld> gpu(way, withAction);
  Scene<btDiscreteDynamicsWorld> stock(way, withAction);
  for (SceneBase* scene : {static_cast<SceneBase*>(&gpu), static_cast<SceneBase*>(&stock)}) {
    scene->before = before;
    scene->after = after;
  }
  for (int i = 0; i < frames; ++i) ASSERT_EQ(gpu.step(), stock.step());
  EXPECT_GT(stock.events.size(), size_t(2 * frames)) << "callbacks should have been called";
  expectSameStory(gpu, stock, toleranceOf(way, 2 * frames));
  expectWay(gpu.w.world, way, 2 * frames);
}

class TickCallbacks : public testing::TestWithParam<Way> {};

TEST_P(TickCallbacks, OrderAndStateInside) { compare(GetParam(), 20, nullptr, nullptr); }

TEST_P(TickCallbacks, WithoutActions) { compare(GetParam(), 20, nullptr, nullptr, false); }

TEST_P(TickCallbacks, ChangeStatesOfBodies) {
  compare(
      GetParam(), 10, [](SceneBase& s, int tick) { s.bodies[2]->applyCentralForce(btVector3(btScalar(tick), 0, 3)); },
      [](SceneBase& s, int tick) {
        s.bodies[3]->setLinearVelocity(btVector3(btScalar(tick), 0, 1));
        btTransform t = s.bodies[4]->getWorldTransform();
        t.getOrigin() += btVector3(0, 1, 0);
        s.bodies[4]->setWorldTransform(t);
        if (tick == 5) s.bodies[5]->forceActivationState(DISABLE_SIMULATION);
      });
}

// A deleted body's memory is soon another body's: a ball that comes in the same callback takes it over.
void replaceBody(SceneBase& s, size_t which, const btVector3& at) {
  btRigidBody* old = s.bodies[which];
  btCollisionShape* shape = old->getCollisionShape();
  s.world->removeRigidBody(old);
  delete old;
  btRigidBody::btRigidBodyConstructionInfo info(2, nullptr, shape, btVector3(1, 1, 1));
  info.m_startWorldTransform.setOrigin(at);
  s.bodies[which] = new btRigidBody(info);
  s.world->addRigidBody(s.bodies[which]);
}

TEST_P(TickCallbacks, RemoveAndDeleteBodiesBefore) {
  compare(
      GetParam(), 15,
      [](SceneBase& s, int tick) {
        if (tick % 4 == 1) replaceBody(s, 1 + size_t(tick / 4) % 4, btVector3(btScalar(20 + tick), btScalar(0.6), 0));
      },
      nullptr);
}

TEST_P(TickCallbacks, RemoveAndDeleteBodiesAfter) {
  compare(GetParam(), 15, nullptr, [](SceneBase& s, int tick) {
    if (tick == 7) {
      s.world->removeRigidBody(s.bodies[4]);
      delete s.bodies[4];
      s.bodies.erase(s.bodies.begin() + 4);
    }
    if (tick % 4 == 1) replaceBody(s, 1 + size_t(tick / 8), btVector3(btScalar(20 + tick), btScalar(0.6), 0));
  });
}

TEST_P(TickCallbacks, SetAndClearCallbacksBefore) {
  compare(
      GetParam(), 12,
      [](SceneBase& s, int tick) {
        if (tick == 2) s.world->setInternalTickCallback(nullptr, &s, false);
        if (tick == 2 && s.events.size() > 40) s.world->setInternalTickCallback(SceneBase::otherPost, &s, false);
        if (s.events.size() > 60) s.world->setInternalTickCallback(SceneBase::otherPre, &s, true);
      },
      nullptr);
}

TEST_P(TickCallbacks, ClearOneself) {
  compare(
      GetParam(), 6,
      [](SceneBase& s, int tick) {
        if (tick == 3) s.world->setInternalTickCallback(nullptr, &s, true);
      },
      [](SceneBase& s, int tick) {
        if (tick == 7) s.world->setInternalTickCallback(nullptr, &s, false);
      });
}

TEST_P(TickCallbacks, SetAndClearCallbacksAfter) {
  compare(GetParam(), 12, nullptr, [](SceneBase& s, int tick) {
    if (tick == 3) s.world->setInternalTickCallback(nullptr, &s, true);
    if (tick == 6) s.world->setInternalTickCallback(SceneBase::otherPre, &s, true);
    if (tick == 9) s.world->setInternalTickCallback(SceneBase::pre, &s, true);
    if (tick == 12) s.world->setInternalTickCallback(SceneBase::otherPost, &s, false);
  });
}

struct Thrown : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Steps both worlds; each throw must come out of both, and neither may be the worse for it.
void compareThrowing(Way way, const Work& before, const Work& after) {
  Scene<btGpuDynamicsWorld> gpu(way);
  Scene<btDiscreteDynamicsWorld> stock(way);
  int thrown = 0;
  for (SceneBase* scene : {static_cast<SceneBase*>(&gpu), static_cast<SceneBase*>(&stock)}) {
    scene->before = before;
    scene->after = after;
    for (int i = 0; i < 15; ++i) {
      try {
        scene->world->stepSimulation(btScalar(2 * kStep), 5, btScalar(kStep));
      } catch (const Thrown& e) {
        EXPECT_STREQ(e.what(), "of the application");
        ++thrown;
      }
    }
  }
  EXPECT_EQ(thrown, 4) << "two in each world";
  expectSameStory(gpu, stock, toleranceOf(way, 30));
}

TEST_P(TickCallbacks, ThrowBefore) {
  compareThrowing(
      GetParam(),
      [](SceneBase& s, int tick) {
        const bool again = s.events.size() > 1 && s.events[s.events.size() - 2].who == "motion state";
        if ((tick == 4 || tick == 9) && again) {
          s.ticks++;  // the substep is lost
          throw Thrown("of the application");
        }
      },
      nullptr);
}

TEST_P(TickCallbacks, ThrowAfter) {
  compareThrowing(GetParam(), nullptr, [](SceneBase&, int tick) {
    if (tick == 4 || tick == 9) throw Thrown("of the application");
  });
}

INSTANTIATE_TEST_SUITE_P(Ways, TickCallbacks, testing::Values(Way::Device, Way::Fallback),
                         [](const testing::TestParamInfo<Way>& test) {
                           return std::string(test.param == Way::Device ? "Device" : "Fallback");
                         });

// The broadphase is the application's as well, and runs while the device is at work on the step.
class ThrowingBroadphase : public btDbvtBroadphase {
 public:
  bool armed = false;
  void calculateOverlappingPairs(btDispatcher* dispatcher) override {
    if (armed) {
      armed = false;
      throw Thrown("of the application");
    }
    btDbvtBroadphase::calculateOverlappingPairs(dispatcher);
  }
};

// One substep is lost, as in stock, and nothing else: the device must not be a step ahead.
TEST(ThrowingInMidStep, LosesOneSubstep) {
  std::vector<BodyState> ends[2];
  const auto run = [](auto* world, ThrowingBroadphase& broadphase, std::vector<BodyState>& end) {
    int thrown = 0;
    {
      scenes::Objects objects(*world);
      btSphereShape* ball = objects.sphere(btScalar(0.5));
      for (int i = 0; i < 4; ++i)
        objects.add(1, ball, btVector3(btScalar(2 * i), 0, 0))->setLinearVelocity(btVector3(0, btScalar(i), 0));
      for (int i = 0; i < 30; ++i) {
        broadphase.armed = i == 10 || i == 11 || i == 20;
        try {
          world->stepSimulation(btScalar(kStep), 0);
        } catch (const Thrown&) {
          ++thrown;
          world->clearForces();  // the base class did not come to it
        }
      }
      for (const btRigidBody* body : objects.bodies()) end.push_back(stateOf(*body));
    }
    EXPECT_EQ(thrown, 3);
  };
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btSequentialImpulseConstraintSolver solver;
  ThrowingBroadphase broadphases[2];
  btGpuDynamicsWorld gpu(&dispatcher, &broadphases[0], &solver, &configuration);
  btDiscreteDynamicsWorld stock(&dispatcher, &broadphases[1], &solver, &configuration);
  run(&gpu, broadphases[0], ends[0]);
  run(&stock, broadphases[1], ends[1]);
  for (size_t i = 0; i < ends[1].size(); ++i)
    expectNear(ends[0][i], ends[1][i], floatNoise(30, 12), "body " + std::to_string(i));
  EXPECT_EQ(gpu.statistics().m_deviceSteps, 27u) << reportText(gpu);
  EXPECT_EQ(gpu.statistics().m_stockSteps, 0u) << reportText(gpu);
}

}  // namespace
}  // namespace btgpu::test
