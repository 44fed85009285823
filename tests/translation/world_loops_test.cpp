// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet's loops on several threads against Bullet's own, bit for bit.
#include "translation/world_loops.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

#include <cstring>
#include <functional>
#include <random>
#include <utility>

#include "tests/translation/reader_world.h"

namespace btgpu::test {
namespace {

class OwnSphere : public btSphereShape {
 public:
  using btSphereShape::btSphereShape;
};

// More bodies than one thread takes at a time: of several shapes, moving, asleep, static and kinematic, one of them far
// too fast.
class Loops : public testing::Test {
 protected:
  void build(ReaderWorld& w) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-5, 5);
    const auto vector = [&] {
      const double x = uniform(random), y = uniform(random), z = uniform(random);
      return btVector3(s(x), s(y), s(z));
    };
    auto* hull = w.shape<btConvexHullShape>();
    for (int i = 0; i < 6; ++i) hull->addPoint(vector());
    auto* compound = w.shape<btCompoundShape>();
    auto* box = w.shape<btBoxShape>(btVector3(1, 2, s(0.5)));
    compound->addChildShape(btTransform(btQuaternion(s(0.1), s(0.2), s(0.3), 1), btVector3(1, 1, 0)), box);
    btCollisionShape* shapes[] = {box,      w.shape<btSphereShape>(s(0.7)), w.shape<btCapsuleShape>(s(0.3), 1), hull,
                                  compound, w.shape<OwnSphere>(1)};
    for (int i = 0; i < 5000; ++i) {
      btRigidBody* body = w.add(i % 7 ? 1 : 0, shapes[i % 6], vector() * 20);
      body->setLinearVelocity(vector());
      body->setAngularVelocity(vector());
      body->applyCentralForce(vector());
      if (i % 5 == 0) body->forceActivationState(ISLAND_SLEEPING);
      if (i % 11 == 0) body->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
      if (i % 13 == 0) body->forceActivationState(DISABLE_DEACTIVATION);
      if (i == 1234) body->setLinearVelocity(btVector3(s(1e9), 0, 0));
      body->setInterpolationLinearVelocity(body->getLinearVelocity());
    }
  }
  Loops() {
    build(ours);
    build(stock);
  }
  template <typename Get>
  void expectSame(const Get& get) {
    for (int i = 0; i < ours.world.getNumCollisionObjects(); ++i) {
      const auto a = get(*ours.world.getCollisionObjectArray()[i]), b = get(*stock.world.getCollisionObjectArray()[i]);
      ASSERT_EQ(a, b) << i;
    }
  }
  ReaderWorld ours, stock;
};

TEST_F(Loops, Gravity) {
  ours.world.setGravity(btVector3(0, -10, 0));
  stock.world.setGravity(btVector3(0, -10, 0));
  applyGravityTo(ours.world.getNonStaticRigidBodies());
  stock.world.applyGravity();
  expectSame([](const btCollisionObject& o) { return btRigidBody::upcast(&o)->getTotalForce(); });
  clearForcesOf(ours.world.getNonStaticRigidBodies());
  stock.world.clearForces();
  expectSame([](const btCollisionObject& o) { return btRigidBody::upcast(&o)->getTotalForce(); });
}

TEST_F(Loops, AabbsOfTheBroadphase) {
  for (const bool all : {true, false}) {
    for (ReaderWorld* w : {&ours, &stock}) {
      w->world.setForceUpdateAllAabbs(all);
      for (int i = 0; i < w->world.getNumCollisionObjects(); ++i) {
        btRigidBody& body = *btRigidBody::upcast(w->world.getCollisionObjectArray()[i]);
        if (!body.isStaticObject()) body.translate(btVector3(s(0.25), 0, 0));
      }
    }
    predictTransforms(ours.world.getNonStaticRigidBodies(), s(1.0 / 60));
    for (int i = 0; i < stock.world.getNonStaticRigidBodies().size(); ++i) {
      btRigidBody& body = *stock.world.getNonStaticRigidBodies()[i];
      if (!body.isStaticOrKinematicObject())
        body.predictIntegratedTransform(s(1.0 / 60), body.getInterpolationWorldTransform());
    }
    AabbUpdater updater;
    updater.update(ours.world);
    stock.world.updateAabbs();
    expectSame([](const btCollisionObject& o) { return o.getBroadphaseHandle()->m_aabbMin; });
    expectSame([](const btCollisionObject& o) { return o.getBroadphaseHandle()->m_aabbMax; });
    expectSame([](const btCollisionObject& o) { return o.getActivationState(); });
    EXPECT_EQ(ours.world.getCollisionObjectArray()[1234]->getActivationState(), DISABLE_SIMULATION);
  }
}

TEST_F(Loops, KinematicBodiesInTheOrderOfTheWorld) {
  std::vector<int> expected;
  for (int i = 0; i < 5000; ++i) {
    const btCollisionObject& o = *ours.world.getCollisionObjectArray()[i];
    if (o.isKinematicObject() && o.getActivationState() != ISLAND_SLEEPING) expected.push_back(i);
  }
  EXPECT_GT(expected.size(), 100u);
  EXPECT_EQ(awakeKinematicBodies(ours.world.getCollisionObjectArray()), expected);
}

// Of the application: notes its calls.
class NotingState : public btMotionState {
 public:
  NotingState(int name, std::vector<std::pair<int, btTransform>>& calls) : m_name(name), m_calls(calls) {}
  void getWorldTransform(btTransform& transform) const override { transform.setIdentity(); }
  void setWorldTransform(const btTransform& transform) override {
    m_calls.emplace_back(m_name, transform);
    if (then) then();
  }
  std::function<void()> then;

 private:
  int m_name;
  std::vector<std::pair<int, btTransform>>& m_calls;
};

// Every body gets a motion state but each ninth: of the application's own each eighth, if `others`, else Bullet's.
struct MotionStates {
  MotionStates(ReaderWorld& w, bool others) {
    for (int i = 0; i < w.world.getNumCollisionObjects(); ++i) {
      if (i % 9 == 0) continue;
      btRigidBody& body = *btRigidBody::upcast(w.world.getCollisionObjectArray()[i]);
      const btTransform offset(btQuaternion(btVector3(0, 1, 0), s(0.01 * i)), btVector3(0, s(0.5), 0));
      if (others && i % 8 == 3) {
        own.push_back(std::make_unique<NotingState>(i, calls));
      } else {
        bullets.push_back(std::make_unique<btDefaultMotionState>(btTransform::getIdentity(), offset));
      }
      btMotionState* state = nullptr;
      if (others && i % 8 == 3) state = own.back().get();
      if (!state) state = bullets.back().get();
      const btTransform at = body.getWorldTransform();
      body.setMotionState(state);
      body.setWorldTransform(at);  // setMotionState took the state's
      body.setInterpolationWorldTransform(at);
      body.setHitFraction(s(0.5 + 0.0001 * i));
    }
    calls.clear();
  }
  std::vector<std::pair<int, btTransform>> calls;
  std::vector<std::unique_ptr<NotingState>> own;
  std::vector<std::unique_ptr<btDefaultMotionState>> bullets;
};

void expectSameCalls(const MotionStates& a, const MotionStates& b) {
  ASSERT_EQ(a.calls.size(), b.calls.size());
  for (size_t i = 0; i < a.calls.size(); ++i) {
    ASSERT_EQ(a.calls[i].first, b.calls[i].first) << i;
    ASSERT_TRUE(a.calls[i].second == b.calls[i].second) << i;
  }
}

void expectSameStates(const MotionStates& a, const MotionStates& b) {
  ASSERT_EQ(a.bullets.size(), b.bullets.size());
  for (size_t i = 0; i < a.bullets.size(); ++i) {
    ASSERT_TRUE(a.bullets[i]->m_graphicsWorldTrans == b.bullets[i]->m_graphicsWorldTrans) << i;
  }
  expectSameCalls(a, b);
}

TEST_F(Loops, MotionStates) {
  for (const bool others : {false, true}) {
    MotionStates a(ours, others), b(stock, others);
    for (int i = 0; i < 2; ++i) {
      MotionStateWriter writer;
      writer.write(ours.world, ours.world.getNonStaticRigidBodies());
      stock.world.synchronizeMotionStates();
    }
    expectSameStates(a, b);
    EXPECT_EQ(a.calls.size() > 300, others);
    int written = 0;
    for (const auto& state : a.bullets) written += !(state->m_graphicsWorldTrans == btTransform::getIdentity());
    EXPECT_GT(written, 2000);
    EXPECT_LT(written, 4000);  // those asleep are not
    for (ReaderWorld* w : {&ours, &stock}) {
      for (int i = 0; i < w->world.getNumCollisionObjects(); ++i)
        btRigidBody::upcast(w->world.getCollisionObjectArray()[i])->setMotionState(nullptr);
    }
  }
}

// The application takes bodies out of the world and puts one in, from within a motion state: who is called then, and in
// which order, is as in stock.
TEST_F(Loops, MotionStateThatChangesTheWorld) {
  MotionStates a(ours, true), b(stock, true);
  for (auto [w, states] : {std::pair(&ours, &a), std::pair(&stock, &b)}) {
    for (auto& state : states->own) {
      state->then = [w = w, states = states] {
        if (states->calls.size() != 50) return;
        const auto& bodies = w->world.getNonStaticRigidBodies();
        btRigidBody* first = bodies[0];
        w->world.removeRigidBody(first);
        for (int k = 0; k < 64; ++k) w->world.removeRigidBody(bodies[2000 + k]);
        w->world.addRigidBody(first);
      };
    }
  }
  MotionStateWriter writer;
  writer.write(ours.world, ours.world.getNonStaticRigidBodies());
  stock.world.synchronizeMotionStates();
  EXPECT_GT(a.calls.size(), 200u);
  EXPECT_EQ(ours.world.getNumCollisionObjects(), 4936);
  expectSameCalls(a, b);
  for (ReaderWorld* w : {&ours, &stock}) {
    for (int i = 0; i < w->world.getNumCollisionObjects(); ++i)
      btRigidBody::upcast(w->world.getCollisionObjectArray()[i])->setMotionState(nullptr);
  }
}

}  // namespace
}  // namespace btgpu::test
