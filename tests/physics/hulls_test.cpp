// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Capsules and convex hulls at rest, in stacks, under a sphere: all on the device, as in stock.
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

using scenes::prism;

btScalar s(double v) { return static_cast<btScalar>(v); }

// Every pair of shapes that rests in one place: on a plane, on a box, on each other.
template <typename World>
struct Rests {
  WorldOf<World> w;
  std::vector<btRigidBody*> bodies;

  Rests() {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    btConvexHullShape* drum = w.objects.hull(prism(8, 0.5, 0.4));
    btCapsuleShape* upright = w.objects.capsule(s(0.3), s(0.8));
    const btQuaternion lying(btVector3(0, 0, 1), s(1.5707963267948966));
    const auto put = [&](btCollisionShape* shape, double x, double y, const btQuaternion& turn) {
      bodies.push_back(w.objects.add(1, shape, btTransform(turn, btVector3(s(x), s(y), 0))));
    };
    const btQuaternion none = btQuaternion::getIdentity();
    put(drum, 0, 0.5, none);
    put(upright, 4, 0.35, lying);
    // A hull on a box, a capsule on a box, a box on a hull, a hull on a hull.
    for (const double x : {8.0, 12.0})
      w.objects.add(0, w.objects.box(btVector3(1, s(0.5), 1)), btVector3(s(x), s(0.5), 0));
    for (const double x : {16.0, 20.0}) w.objects.add(0, w.objects.hull(prism(8, 1, 0.5)), btVector3(s(x), s(0.5), 0));
    put(drum, 8, 1.5, none);
    put(upright, 12, 1.35, lying);
    put(w.objects.box(btVector3(s(0.4), s(0.4), s(0.4))), 16, 1.5, none);
    put(drum, 20, 1.5, none);
    w.objects.add(0, w.objects.hull(prism(8, 1, 0.5)), btVector3(24, s(0.5), 0));
    put(upright, 24, 1.4, lying);
  }
};

TEST(Hulls, RestWhereStockHasThem) {
  Rests<btGpuDynamicsWorld> gpu;
  Rests<btDiscreteDynamicsWorld> stock;
  gpu.w.run(300);
  stock.w.run(300);
  expectAllOnDevice(gpu.w.world);
  for (size_t i = 0; i < gpu.bodies.size(); ++i) {
    const btVector3 &ours = gpu.bodies[i]->getWorldTransform().getOrigin(),
                    &theirs = stock.bodies[i]->getWorldTransform().getOrigin();
    EXPECT_NEAR(double(ours.y()), double(theirs.y()), 1e-3) << "body " << i;
    EXPECT_FALSE(gpu.bodies[i]->isActive()) << "body " << i << " never slept";
    EXPECT_LT(length(gpu.bodies[i]->getLinearVelocity()), 1e-6);
  }
}

template <typename World>
struct Stack {
  WorldOf<World> w;
  std::vector<btRigidBody*> drums;

  Stack() {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.box(btVector3(50, 5, 50)), btVector3(0, -5, 0));
    btConvexHullShape* drum = w.objects.hull(prism(8, 0.6, 0.4));
    // Half heights 0.4 and margins of 0.04 around each.
    for (int i = 0; i < 8; ++i) drums.push_back(w.objects.add(1, drum, btVector3(0, s(0.44 + 0.88 * i), 0)));
  }
};

TEST(Hulls, StackStandsAndSleeps) {
  Stack<btGpuDynamicsWorld> gpu;
  Stack<btDiscreteDynamicsWorld> stock;
  gpu.w.run(400);
  stock.w.run(400);
  expectAllOnDevice(gpu.w.world);
  // Settling shifts the drums, in stock by 0.045; ours must not lean more than stock's.
  const auto driftOf = [](const btRigidBody* body) {
    const btVector3& p = body->getWorldTransform().getOrigin();
    return std::hypot(double(p.x()), double(p.z()));
  };
  double farthest = 0;
  for (const btRigidBody* drum : stock.drums) farthest = std::max(farthest, driftOf(drum));
  for (size_t i = 0; i < gpu.drums.size(); ++i) {
    const btTransform& t = gpu.drums[i]->getWorldTransform();
    EXPECT_NEAR(double(t.getOrigin().y()), 0.44 + 0.88 * double(i), 0.01 * double(i + 1)) << "drum " << i;
    EXPECT_LE(driftOf(gpu.drums[i]), farthest);
    EXPECT_GT(double(t.getBasis()[1][1]), 0.9999) << "it should stand upright";
    EXPECT_FALSE(gpu.drums[i]->isActive());
    EXPECT_FALSE(stock.drums[i]->isActive());
  }
}

template <typename World>
struct Carrier {
  WorldOf<World> w;
  btRigidBody* ball;

  explicit Carrier(const btQuaternion& turn) {
    w.world.setGravity(btVector3(0, -10, 0));
    const auto points = prism(8, 1, 0.5);
    w.objects.add(0, w.objects.hull(points), btTransform(turn, btVector3(0, 0, 0)));
    btVector3 top(0, -9, 0);
    for (const btVector3& p : points) {
      const btVector3 at = quatRotate(turn, p);
      if (at.y() > top.y()) top = at;
    }
    // Above the highest vertex, a little towards the middle, so that it lands on a face, an edge or the vertex.
    ball =
        w.objects.add(1, w.objects.sphere(s(0.1)), btVector3(top.x() * s(0.97), top.y() + s(0.25), top.z() * s(0.97)));
    ball->setFriction(0);
  }
};

// An octagonal prism carries a sphere in every orientation: Bullet3's pipeline lets it through the obtuse edges.
TEST(Hulls, PrismCarriesASphereInEveryOrientation) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  double deepest = 0;
  int held = 0;
  for (int n = 0; n < 40; ++n) {
    btQuaternion turn(s(unit(random)), s(unit(random)), s(unit(random)), s(unit(random)));
    turn.normalize();
    Carrier<btGpuDynamicsWorld> gpu(turn);
    Carrier<btDiscreteDynamicsWorld> stock(turn);
    for (int step = 0; step < 50; ++step) {
      gpu.w.run(1);
      stock.w.run(1);
      const btVector3 &ours = gpu.ball->getWorldTransform().getOrigin(),
                      &theirs = stock.ball->getWorldTransform().getOrigin();
      // The same slide until small differences have grown: one step's fall at 3 m / s is 0.05.
      ASSERT_NEAR(double((ours - theirs).length()), 0, 0.05) << "orientation " << n << ", step " << step;
      for (int i = 0; i < stock.w.dispatcher.getNumManifolds(); ++i) {
        const btPersistentManifold* m = stock.w.dispatcher.getManifoldByIndexInternal(i);
        for (int k = 0; k < m->getNumContacts(); ++k)
          deepest = std::min(deepest, double(m->getContactPoint(k).getDistance()));
        held += m->getNumContacts() > 0;
      }
    }
    expectAllOnDevice(gpu.w.world);
  }
  EXPECT_GT(held, 200) << "the sphere hardly touched the prism";
  EXPECT_GT(deepest, -0.1);
}

}  // namespace
}  // namespace btgpu::test
