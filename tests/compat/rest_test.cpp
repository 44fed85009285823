// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Sleeping worlds, whose steps are not done: bit for bit they are what they would be if all steps were done, whatever
// the application does to them and whenever it does. Each case runs in a world that may rest, and in one that is looked
// at and so does every step.
#include <functional>
#include <map>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 vec(double x, double y, double z) { return {s(x), s(y), s(z)}; }

constexpr double kStep = 1.0 / 60;

btGpuSettings resting(bool watchSleepers = true) {
  btGpuSettings settings;
  settings.m_watchSleepers = watchSleepers;
  return settings;
}
btGpuSettings stepping() {
  btGpuSettings settings;
  settings.m_keepContacts = true;
  return settings;
}

// A pile, linked balls, a compound, a ball alone, one in the air that can't move; all of them asleep soon.
struct Bedroom : GpuWorld {
  explicit Bedroom(const btGpuSettings& settings) : WorldOf(settings) {
    world.setGravity(vec(0, -10, 0));
    objects.add(0, objects.plane(vec(0, 1, 0), 0), vec(0, 0, 0));
    for (int i = 0; i < 3; ++i) pile[i] = objects.add(1, box, vec(0, 0.5 + i, 0));
    for (int i = 0; i < 2; ++i) linked[i] = objects.add(1, ball, vec(5 + 1.2 * i, 0.4, 0));
    joint = objects.joint<btPoint2PointConstraint>(false, *linked[0], *linked[1], vec(0.6, 0, 0), vec(-0.6, 0, 0));
    compound = objects.shape<btCompoundShape>();
    compound->addChildShape(btTransform::getIdentity(), box);
    compound->addChildShape(btTransform(btQuaternion::getIdentity(), vec(1, 0, 0)), box);
    table = objects.add(2, compound, vec(10, 0.5, 0));
    alone = objects.add(1, ball, vec(15, 0.4, 0));
    kinematic = objects.addKinematic(box, btTransform(btQuaternion::getIdentity(), vec(20, 3, 0)));
    kinematic->forceActivationState(ISLAND_SLEEPING);
  }

  btBoxShape* box = objects.box(vec(0.5, 0.5, 0.5));
  btSphereShape* ball = objects.sphere(s(0.4));
  btRigidBody *pile[3], *linked[2], *table, *alone, *kinematic;
  btCompoundShape* compound;
  btTypedConstraint* joint;
  std::function<void(Bedroom&)> inTick;
  std::unique_ptr<btActionInterface> action;

  unsigned long long rested() const { return world.statistics().m_restingSteps; }
};

// Contacts of all manifolds and what rays find, besides the bodies.
std::string seen(Bedroom& w) {
  std::string text;
  char line[200];
  for (int i = 0; i < w.dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& m = *w.dispatcher.getManifoldByIndexInternal(i);
    std::snprintf(line, sizeof line, "manifold %d %d:", m.getBody0()->getWorldArrayIndex(),
                  m.getBody1()->getWorldArrayIndex());
    text += line;
    for (int k = 0; k < m.getNumContacts(); ++k) {
      const btManifoldPoint& p = m.getContactPoint(k);
      std::snprintf(line, sizeof line, " %a %a %d", double(p.getDistance()), double(p.getAppliedImpulse()),
                    p.getLifeTime());
      text += line;
    }
    text += "\n";
  }
  for (double x = -1; x < 22; x += 0.5) {
    const btVector3 from = vec(x, 50, 0.1), to = vec(x, -50, 0.1);
    btCollisionWorld::ClosestRayResultCallback hit(from, to);
    w.world.rayTest(from, to, hit);
    const int what = hit.hasHit() ? hit.m_collisionObject->getWorldArrayIndex() : -1;
    std::snprintf(line, sizeof line, "ray %g: %d %a\n", x, what, double(hit.m_closestHitFraction));
    text += line;
  }
  std::snprintf(line, sizeof line, "pairs %d\n", w.world.getPairCache()->getNumOverlappingPairs());
  return text + line;
}

void expectSameWorlds(Bedroom& a, Bedroom& b, const std::string& when) {
  const auto &x = a.world.getCollisionObjectArray(), &y = b.world.getCollisionObjectArray();
  ASSERT_EQ(x.size(), y.size()) << when;
  for (int i = 0; i < x.size(); ++i) {
    expectSame(stateOf(*btRigidBody::upcast(x[i])), stateOf(*btRigidBody::upcast(y[i])),
               when + ", object " + std::to_string(i));
  }
  EXPECT_EQ(seen(a), seen(b)) << when;
}

struct Disturbance {
  const char* name;
  std::function<void(Bedroom&)> make;
  bool wakes = true;  // some body, in stock
};

struct Push : btActionInterface {
  explicit Push(btRigidBody* pushed) : body(pushed) {}
  void updateAction(btCollisionWorld*, btScalar) override {
    if (++calls == 3) {
      body->activate();
      body->applyCentralImpulse(vec(0, 2, 0));
    }
  }
  void debugDraw(btIDebugDraw*) override {}
  btRigidBody* body;
  int calls = 0;
};

// What falls on the bodies some steps later finds them as they are by then.
void dropOn(Bedroom& w, const btRigidBody& body) {
  w.objects.add(3, w.ball, body.getWorldTransform().getOrigin() + vec(0.1, 1.2, 0))->setLinearVelocity(vec(0, -3, 0));
}

void tick(btDynamicsWorld* world, btScalar) {
  auto& w = *static_cast<Bedroom*>(world->getWorldUserInfo());
  if (w.inTick) w.inTick(w);
}

std::vector<Disturbance> disturbances() {
  return {
      {"Nothing", [](Bedroom&) {}, false},
      {"Activated", [](Bedroom& w) { w.pile[1]->activate(); }},
      {"ForcedAwake", [](Bedroom& w) { w.alone->forceActivationState(DISABLE_DEACTIVATION); }},
      {"ForcedOut", [](Bedroom& w) { w.alone->forceActivationState(DISABLE_SIMULATION); }, false},
      {"VelocityOnly", [](Bedroom& w) { w.alone->setLinearVelocity(vec(1, 2, 3)); }, false},
      {"SpinOnly", [](Bedroom& w) { w.alone->setAngularVelocity(vec(1, 2, 3)); }, false},
      {"ForceOnly", [](Bedroom& w) { w.alone->applyCentralForce(vec(1, 2, 3)); }, false},
      {"TorqueOnly", [](Bedroom& w) { w.pile[2]->applyTorque(vec(1, 2, 3)); }, false},
      {"ImpulseAwake",
       [](Bedroom& w) {
         w.alone->activate();
         w.alone->applyImpulse(vec(1, 2, 3), vec(0, 0.1, 0));
       }},
      {"Moved", [](Bedroom& w) { w.alone->setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(17, 2, 0))); },
       false},
      {"Teleported",
       [](Bedroom& w) { w.alone->setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), vec(18, 2, 0))); },
       false},
      {"Interpolation",
       [](Bedroom& w) {
         w.alone->setInterpolationWorldTransform(btTransform(btQuaternion::getIdentity(), vec(17, 2, 0)));
       },
       false},
      {"StaticMoved",
       [](Bedroom& w) {
         w.world.getCollisionObjectArray()[0]->setWorldTransform(
             btTransform(btQuaternion(vec(0, 0, 1), s(0.1)), vec(0, -1, 0)));
       },
       false},
      {"KinematicMoved",
       [](Bedroom& w) {
         w.kinematic->setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(15, 0.9, 0)));
         w.kinematic->activate(true);
       }},
      {"NoResponse",
       [](Bedroom& w) {
         w.alone->setCollisionFlags(w.alone->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
       },
       false},
      {"OtherShape", [](Bedroom& w) { w.alone->setCollisionShape(w.box); }, false},
      {"ScaledShape", [](Bedroom& w) { w.box->setLocalScaling(vec(1, 2, 1)); }, false},
      {"CompoundChild",
       [](Bedroom& w) { w.compound->updateChildTransform(1, btTransform(btQuaternion::getIdentity(), vec(0, 2, 0))); },
       false},
      {"CompoundGrows",
       [](Bedroom& w) { w.compound->addChildShape(btTransform(btQuaternion::getIdentity(), vec(0, 2, 0)), w.ball); },
       false},
      {"Added", [](Bedroom& w) { w.objects.add(1, w.ball, vec(15.2, 3, 0)); }},
      {"AddedStatic", [](Bedroom& w) { w.objects.add(0, w.ball, vec(17, 3, 0)); }, false},
      {"Removed", [](Bedroom& w) { w.world.removeRigidBody(w.pile[1]); }, false},
      {"RemovedAndBack",
       [](Bedroom& w) {
         w.world.removeRigidBody(w.pile[1]);
         w.world.addRigidBody(w.pile[1]);
       },
       false},
      {"JointAdded",
       [](Bedroom& w) {
         w.objects.joint<btPoint2PointConstraint>(true, *w.alone, *w.table, vec(-2, 0, 0), vec(2, 0, 0));
         w.alone->activate();
       }},
      {"JointGone",
       [](Bedroom& w) {
         w.world.removeConstraint(w.joint);
         w.linked[0]->activate();
       }},
      {"JointDisabled",
       [](Bedroom& w) {
         w.joint->setEnabled(false);
         w.linked[0]->activate();
       }},
      {"Gravity",
       [](Bedroom& w) {
         w.world.setGravity(vec(3, -10, 0));
         w.pile[0]->setGravity(vec(0, 5, 0));
         w.pile[0]->activate();
       }},
      {"Friction",
       [](Bedroom& w) {
         w.pile[2]->setFriction(s(0.01));
         w.pile[2]->setRestitution(s(0.9));
         dropOn(w, *w.pile[2]);
       }},
      {"Mass",
       [](Bedroom& w) {
         w.alone->setMassProps(50, vec(5, 5, 5));
         dropOn(w, *w.alone);
       }},
      {"Filter",
       [](Bedroom& w) {
         w.alone->getBroadphaseProxy()->m_collisionFilterMask = btBroadphaseProxy::StaticFilter;
         dropOn(w, *w.alone);
       },
       false},
      {"Iterations",
       [](Bedroom& w) {
         w.world.getSolverInfo().m_numIterations = 3;
         dropOn(w, *w.pile[2]);
       }},
      {"PairCleaned",
       [](Bedroom& w) { w.world.getPairCache()->cleanProxyFromPairs(w.pile[1]->getBroadphaseProxy(), &w.dispatcher); },
       false},
      {"PileHit", [](Bedroom& w) { dropOn(w, *w.pile[2]); }},
      {"LinkedHit", [](Bedroom& w) { dropOn(w, *w.linked[1]); }},
      {"InTick", [](Bedroom& w) { w.inTick = [](Bedroom& x) { x.alone->setLinearVelocity(vec(0, 1, 0)); }; }, false},
      {"AwakeInTick",
       [](Bedroom& w) {
         w.inTick = [](Bedroom& x) {
           x.alone->activate();
           x.alone->setLinearVelocity(vec(0, 1, 0));
         };
       }},
      {"InPreTick",
       [](Bedroom& w) {
         w.world.setInternalTickCallback(tick, &w, true);
         w.inTick = [](Bedroom& x) {
           x.alone->activate();
           x.alone->setLinearVelocity(vec(0, 1, 0));
         };
       }},
      {"Action",
       [](Bedroom& w) {
         w.action = std::make_unique<Push>(w.alone);
         w.world.addAction(w.action.get());
       }},
      {"Deactivation", [](Bedroom&) { gDisableDeactivation = true; }},
  };
}

class Rest : public ::testing::TestWithParam<Disturbance> {
 protected:
  void SetUp() override { gDeactivationTime = s(0.2); }
  void TearDown() override {
    gDeactivationTime = s(2);
    gDisableDeactivation = false;
  }
};

TEST_P(Rest, IsAsIfAllStepsWereDone) {
  Bedroom may(resting()), may_not(stepping());
  for (Bedroom* w : {&may, &may_not}) w->world.setInternalTickCallback(tick, w);
  const auto runBoth = [&](int steps, const std::string& when) {
    for (int i = 0; i < steps; ++i) {
      for (Bedroom* w : {&may, &may_not}) w->run(1);
      expectSameWorlds(may, may_not, when + " " + std::to_string(i));
      if (HasFailure()) return;
    }
  };
  for (Bedroom* w : {&may, &may_not}) w->run(90);
  ASSERT_GT(may.rested(), 5u) << "the world never came to rest";
  runBoth(1, "before");
  for (Bedroom* w : {&may, &may_not}) GetParam().make(*w);
  const auto before = may.rested();
  bool woke = false;
  for (int i = 0; i < 40 && !HasFailure(); ++i) {
    runBoth(1, "step " + std::to_string(i));
    for (const btRigidBody* body : may.objects.bodies()) {
      const bool old = body->getWorldArrayIndex() >= 0 && body->getWorldArrayIndex() < 9;
      woke = woke || (old && body->isActive());
    }
  }
  EXPECT_EQ(woke, GetParam().wakes);
  if (std::string(GetParam().name) == "Nothing") { EXPECT_EQ(may.rested() - before, 40u); }
  for (Bedroom* w : {&may, &may_not}) {
    w->inTick = nullptr;
    if (w->action) w->world.removeAction(w->action.get());
    w->run(120);
  }
  runBoth(1, "after");
  EXPECT_EQ(may_not.rested(), 0u);
  expectAllOnDevice(may.world, {"joints", "actions"});
}

INSTANTIATE_TEST_SUITE_P(Disturbed, Rest, ::testing::ValuesIn(disturbances()),
                         [](const auto& p) { return std::string(p.param.name); });

// All call patterns of stepSimulation, with what comes between the substeps.
TEST_F(Rest, InSubsteps) {
  Bedroom may(resting()), may_not(stepping());
  for (Bedroom* w : {&may, &may_not}) w->run(90);
  for (int i = 0; i < 12; ++i) {
    for (Bedroom* w : {&may, &may_not}) {
      if (i == 4) w->alone->applyCentralForce(vec(0, 5, 0));
      if (i == 6) w->alone->activate();
      if (i % 3 == 0) w->world.stepSimulation(s(4.5 * kStep), 10);
      if (i % 3 == 1) w->world.stepSimulation(s(0.3 * kStep), 10);
      if (i % 3 == 2) w->world.stepSimulation(s(20 * kStep), 3, s(kStep));
    }
    expectSameWorlds(may, may_not, "call " + std::to_string(i));
  }
  EXPECT_GT(may.rested(), 8u);
}

// With a new set of settings it does a step, and then rests again.
TEST_F(Rest, EndsWithSettings) {
  Bedroom w(resting());
  w.run(90);
  ASSERT_GT(w.rested(), 5u);
  btGpuDynamicsWorld::configure(&w.world, stepping());
  const auto before = w.rested();
  w.run(20);
  EXPECT_EQ(w.rested(), before);
  btGpuDynamicsWorld::configure(&w.world, resting());
  w.run(20);
  EXPECT_GT(w.rested(), before + 5);
}

// A class of the application's own may do anything between the parts of a stepSimulation.
struct Meddler : btGpuDynamicsWorld {
  using btGpuDynamicsWorld::btGpuDynamicsWorld;
  void applyGravity() override {
    btGpuDynamicsWorld::applyGravity();
    if (meddle) static_cast<btRigidBody*>(m_collisionObjects[1])->applyCentralForce(vec(0, 1, 0));
  }
  bool meddle = false;
};

TEST_F(Rest, OfADerivedWorld) {
  WorldOf<Meddler> w;
  w.world.setGravity(vec(0, -10, 0));
  w.objects.add(0, w.objects.plane(vec(0, 1, 0), 0), vec(0, 0, 0));
  btRigidBody* ball = w.objects.add(1, w.objects.sphere(s(0.4)), vec(0, 0.4, 0));
  w.run(60);
  ASSERT_GT(w.world.statistics().m_restingSteps, 5u);
  w.world.meddle = true;
  w.run(1);
  EXPECT_EQ(ball->getTotalForce(), vec(0, 0, 0)) << "forces last for one stepSimulation";
}

// ---- m_watchSleepers off

TEST_F(Rest, UnwatchedNoticesActivations) {
  Bedroom may(resting(false)), may_not(stepping());
  const auto runBoth = [&](int steps, const std::string& when) {
    for (int i = 0; i < steps; ++i) {
      for (Bedroom* w : {&may, &may_not}) w->run(1);
      expectSameWorlds(may, may_not, when + " " + std::to_string(i));
    }
  };
  for (Bedroom* w : {&may, &may_not}) w->run(90);
  runBoth(2, "asleep");
  for (Bedroom* w : {&may, &may_not}) w->pile[0]->activate();
  runBoth(20, "activated");
  for (Bedroom* w : {&may, &may_not}) w->run(90);
  for (Bedroom* w : {&may, &may_not}) {  // moved first, activated then
    w->alone->setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(17, 2, 0)));
    w->alone->setLinearVelocity(vec(0, 3, 0));
    w->alone->activate();
  }
  runBoth(20, "moved and activated");
  for (Bedroom* w : {&may, &may_not}) w->run(90);
  for (Bedroom* w : {&may, &may_not}) w->world.removeRigidBody(w->pile[1]);
  runBoth(20, "removed");
  for (Bedroom* w : {&may, &may_not}) w->objects.add(1, w->ball, vec(15.2, 3, 0));
  runBoth(20, "added");
  EXPECT_GT(may.rested(), 50u);
}

// What is changed without that waits until something is activated, and is all there then.
TEST_F(Rest, UnwatchedTakesChangesLater) {
  Bedroom w(resting(false));
  w.run(90);
  ASSERT_GT(w.rested(), 5u);
  w.alone->setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(17, 2, 0)));
  w.table->applyCentralForce(vec(0, 1, 0));
  const auto hits = [&w](double x) {
    btCollisionWorld::ClosestRayResultCallback hit(vec(x, 50, 0), vec(x, 1, 0));
    w.world.rayTest(vec(x, 50, 0), vec(x, 1, 0), hit);
    return hit.m_collisionObject;
  };
  auto before = w.rested();
  w.run(3);
  EXPECT_EQ(w.rested(), before + 3);
  EXPECT_EQ(hits(17), nullptr) << "its box is where it was";
  EXPECT_EQ(w.table->getTotalForce(), vec(0, 1, 0));
  w.linked[0]->activate();
  before = w.rested();
  w.run(1);
  EXPECT_EQ(w.rested(), before);
  EXPECT_EQ(hits(17), w.alone);
  EXPECT_EQ(w.table->getTotalForce(), vec(0, 0, 0));
}

}  // namespace
}  // namespace btgpu::test
