// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet's loops on several threads against Bullet's own, bit for bit.
#include "translation/world_loops.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

#include <cstring>
#include <random>

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

}  // namespace
}  // namespace btgpu::test
