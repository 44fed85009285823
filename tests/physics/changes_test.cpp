// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Filters, and bodies that are added, removed, moved or changed between steps: the same calls on both worlds.
#include <functional>

#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

// A floor with four boxes and four spheres that come to rest on it, 3 units apart.
template <typename World>
struct Yard {
  WorldOf<World> w;
  btRigidBody* ground;
  std::vector<btRigidBody*> bodies;

  Yard() {
    w.world.setGravity(btVector3(0, -10, 0));
    ground = w.objects.add(0, w.objects.box(btVector3(50, 5, 50)), btVector3(0, -5, 0));
    btCollisionShape* shapes[] = {w.objects.box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5))),
                                  w.objects.sphere(btScalar(0.5))};
    for (int i = 0; i < 8; ++i)
      bodies.push_back(w.objects.add(1, shapes[i % 2], btVector3(btScalar(3 * i), btScalar(0.6), 0)));
  }
};

void expectSame(Yard<btGpuDynamicsWorld>& gpu, Yard<btDiscreteDynamicsWorld>& stock, double tolerance) {
  for (size_t i = 0; i < gpu.bodies.size(); ++i) {
    const btVector3 a = gpu.bodies[i]->getWorldTransform().getOrigin(),
                    b = stock.bodies[i]->getWorldTransform().getOrigin();
    EXPECT_LT(length(a - b), tolerance) << "body " << i << " at " << a.x() << " " << a.y() << " " << a.z()
                                        << ", stock at " << b.x() << " " << b.y() << " " << b.z();
    EXPECT_EQ(gpu.bodies[i]->isActive(), stock.bodies[i]->isActive()) << "body " << i;
  }
  expectAllOnDevice(gpu.w.world);
}

// Runs `first` steps, makes the change in both worlds, runs `then` steps and compares.
template <typename Change>
void compareAfter(int first, const Change& change, int then, double tolerance) {
  Yard<btGpuDynamicsWorld> gpu;
  Yard<btDiscreteDynamicsWorld> stock;
  gpu.w.run(first);
  stock.w.run(first);
  change(gpu);
  change(stock);
  gpu.w.run(then);
  stock.w.run(then);
  expectSame(gpu, stock, tolerance);
}

TEST(Changes, GravityOff) {
  compareAfter(
      30, [](auto& y) { y.w.world.setGravity(btVector3(1, 2, 0)); }, 60, 1e-3);
}

TEST(Changes, BodyTeleportedAndPushed) {
  compareAfter(
      30,
      [](auto& y) {
        btTransform t = y.bodies[0]->getWorldTransform();
        t.setOrigin(btVector3(1, 4, 5));
        y.bodies[0]->setWorldTransform(t);
        y.bodies[0]->activate();
        y.bodies[3]->applyCentralImpulse(btVector3(0, 3, 1));
        y.bodies[3]->activate();
      },
      90, 0.02);
}

TEST(Changes, BodyRemovedFromUnderAnother) {
  Yard<btGpuDynamicsWorld> gpu;
  Yard<btDiscreteDynamicsWorld> stock;
  const auto run = [](auto& y) {
    y.bodies.push_back(y.w.objects.add(1, y.bodies[0]->getCollisionShape(), btVector3(0, btScalar(1.6), 0)));
    y.w.run(60);
    y.w.world.removeRigidBody(y.bodies[0]);
    y.bodies.back()->activate();
    y.w.run(60);
    y.w.world.addRigidBody(y.bodies[0]);  // back where it was: the other one has fallen there
    y.w.world.removeRigidBody(y.bodies[0]);
  };
  run(gpu);
  run(stock);
  EXPECT_NEAR(double(gpu.bodies.back()->getWorldTransform().getOrigin().y()), 0.5, 0.02);
  expectSame(gpu, stock, 0.02);
}

TEST(Changes, RemovedAndAddedInAnotherOrder) {
  compareAfter(
      30,
      [](auto& y) {
        for (const size_t i : {2u, 5u, 1u}) y.w.world.removeRigidBody(y.bodies[i]);
        y.w.run(10);
        for (const size_t i : {1u, 2u, 5u}) y.w.world.addRigidBody(y.bodies[i]);
        for (btRigidBody* b : y.bodies) b->activate();
      },
      60, 0.01);
}

TEST(Changes, MassAndInertia) {
  compareAfter(
      30,
      [](auto& y) {
        btVector3 inertia;
        y.bodies[0]->getCollisionShape()->calculateLocalInertia(10, inertia);
        y.bodies[0]->setMassProps(10, inertia);
        y.bodies[0]->updateInertiaTensor();
        for (btRigidBody* b : y.bodies) {
          b->applyImpulse(btVector3(1, 1, 0), btVector3(0, btScalar(0.2), 0));
          b->activate();
        }
      },
      40, 0.02);
}

TEST(Changes, DynamicBecomesStaticAndBack) {
  compareAfter(
      5,
      [](auto& y) {
        y.w.world.removeRigidBody(y.bodies[0]);
        y.bodies[0]->setMassProps(0, btVector3(0, 0, 0));
        y.bodies[0]->setLinearVelocity(btVector3(0, 0, 0));
        y.w.world.addRigidBody(y.bodies[0]);
        y.w.run(20);
        y.w.world.removeRigidBody(y.bodies[0]);
        btVector3 inertia;
        y.bodies[0]->getCollisionShape()->calculateLocalInertia(1, inertia);
        y.bodies[0]->setMassProps(1, inertia);
        y.bodies[0]->forceActivationState(ACTIVE_TAG);
        y.w.world.addRigidBody(y.bodies[0]);
      },
      60, 0.01);
}

TEST(Changes, ShapeReplacedAndScaled) {
  compareAfter(
      30,
      [](auto& y) {
        y.w.world.removeRigidBody(y.bodies[0]);
        y.bodies[0]->setCollisionShape(y.w.objects.sphere(btScalar(0.8)));
        y.w.world.addRigidBody(y.bodies[0]);
        auto* own = y.w.objects.box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
        y.w.world.removeRigidBody(y.bodies[2]);
        y.bodies[2]->setCollisionShape(own);
        own->setLocalScaling(btVector3(1, 2, 1));
        y.w.world.addRigidBody(y.bodies[2]);
        for (btRigidBody* b : y.bodies) b->activate();
      },
      60, 0.02);
}

TEST(Changes, FactorsAndDamping) {
  compareAfter(
      30,
      [](auto& y) {
        y.bodies[0]->setLinearFactor(btVector3(1, 1, 0));
        y.bodies[1]->setAngularFactor(btVector3(0, 1, 0));
        y.bodies[2]->setDamping(btScalar(0.5), btScalar(0.5));
        y.bodies[3]->setGravity(btVector3(0, 5, 0));
        for (btRigidBody* b : y.bodies) {
          b->setLinearVelocity(btVector3(1, 2, 1));
          b->setAngularVelocity(btVector3(1, 1, 1));
          b->activate();
        }
      },
      30, 2e-3);
}

// Spheres only bounce as in stock: a box that lands on four corners spins by the order in which they are
// solved.
TEST(Changes, FrictionAndRestitution) {
  compareAfter(
      30,
      [](auto& y) {
        for (size_t i = 0; i < y.bodies.size(); ++i) {
          y.bodies[i]->setFriction(btScalar(0.1));
          if (i % 2) y.bodies[i]->setRestitution(btScalar(0.5));
          y.bodies[i]->setLinearVelocity(btVector3(0, btScalar(i % 2 ? -1 : 0), 2));
          y.bodies[i]->activate();
        }
        y.ground->setRestitution(1);
      },
      20, 0.01);  // of 0.64 units travelled; boxes tip on their leading edge, row by row
}

// Group and mask as arguments, and edited in the proxy later, as eleven of the surveyed applications do.
// Without setForceUpdateAllAabbs, whoever moves a static body tells the world by updateSingleAabb.
TEST(KeptAabbs, StaticBodyMoved) {
  compareAfter(
      30,
      [](auto& y) {
        y.w.world.setForceUpdateAllAabbs(false);
        y.w.run(3);
        const btVector3 down(0, -30, 0);  // far below its old AABB, and what lies on it too
        y.ground->setWorldTransform(btTransform(btQuaternion::getIdentity(), down + btVector3(0, -5, 0)));
        y.w.world.updateSingleAabb(y.ground);
        for (btRigidBody* body : y.bodies) {
          body->setWorldTransform(
              btTransform(body->getWorldTransform().getRotation(), body->getWorldTransform().getOrigin() + down));
          body->activate();
        }
      },
      60, 0.02);
}

TEST(KeptAabbs, StaticBodyScaled) {
  compareAfter(
      30,
      [](auto& y) {
        y.w.world.setForceUpdateAllAabbs(false);
        y.w.run(3);
        y.ground->getCollisionShape()->setLocalScaling(btVector3(1, btScalar(0.5), 1));
        y.w.world.updateSingleAabb(y.ground);
        for (btRigidBody* body : y.bodies) body->activate();
      },
      120, 0.02);
}

// Without that call, and without being active, it keeps the AABB that it had, and is found there only: what falls on
// the place where it is now falls through it. Near its old place it is met where it really is.
TEST(KeptAabbs, InactiveBodyMovedUntold) {
  for (const bool fixed : {false, true}) {
    const auto run = [fixed](auto& y) {
      y.w.world.setForceUpdateAllAabbs(false);
      btCollisionShape* shape = y.w.objects.box(btVector3(1, btScalar(0.5), 1));
      const auto place = [&](double x, double away) {
        btRigidBody* moved = y.w.objects.add(btScalar(fixed ? 0 : 1), shape, btVector3(btScalar(x), btScalar(0.5), 10));
        y.w.run(5);
        if (!fixed) moved->forceActivationState(DISABLE_SIMULATION);
        y.w.run(3);
        btTransform at = moved->getWorldTransform();
        at.getOrigin() += btVector3(btScalar(away), 0, 0);
        moved->setWorldTransform(at);
        return at.getOrigin();
      };
      const btVector3 far = place(0, 8), near = place(20, 0.5);
      for (const btVector3& at : {far, near}) {
        y.bodies.push_back(y.w.objects.add(1, y.bodies[1]->getCollisionShape(), at + btVector3(0, btScalar(1.5), 0)));
        y.bodies.back()->setActivationState(DISABLE_DEACTIVATION);
      }
      y.w.run(60);
    };
    Yard<btGpuDynamicsWorld> gpu;
    Yard<btDiscreteDynamicsWorld> stock;
    btGpuSettings settings;
    settings.m_crosscheckEvery = 1;
    btGpuDynamicsWorld::configure(&gpu.w.world, settings);
    run(gpu);
    run(stock);
    const auto heightOf = [](const btRigidBody* body) { return double(body->getWorldTransform().getOrigin().y()); };
    const size_t last = stock.bodies.size() - 1;
    EXPECT_NEAR(heightOf(stock.bodies[last - 1]), 0.5, 0.05) << "it lies on the ground";
    EXPECT_GT(heightOf(stock.bodies[last]), 1.2) << "it lies on the body";
    expectSame(gpu, stock, 0.02);
    EXPECT_EQ(gpu.w.world.crosscheck().m_failedSteps, 0u) << fixed;
  }
}

// A sleeping body that moved while the world was on the stock path.
TEST(KeptAabbs, MovedOnTheStockPath) {
  const auto run = [](auto& y, const std::function<void(bool)>& stockOnly) {
    y.w.world.setForceUpdateAllAabbs(false);
    y.bodies[0]->setAngularFactor(0);
    y.w.run(5);
    stockOnly(true);
    y.bodies[0]->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(-10, btScalar(0.5), 0)));
    y.bodies[0]->activate();
    y.w.run(1);
    y.bodies[0]->forceActivationState(ISLAND_SLEEPING);
    y.w.run(1);
    stockOnly(false);
    y.bodies.push_back(y.w.objects.add(1, y.bodies[0]->getCollisionShape(), btVector3(-10, 3, 0)));
    y.w.run(120);
  };
  Yard<btGpuDynamicsWorld> gpu;
  Yard<btDiscreteDynamicsWorld> stock;
  run(gpu, [&](bool on) {
    btGpuSettings settings;
    settings.m_stockOnly = on;
    btGpuDynamicsWorld::configure(&gpu.w.world, settings);
  });
  run(stock, [](bool) {});
  EXPECT_EQ(gpu.w.world.statistics().m_stockSteps, 2u);
  for (size_t i = 0; i < gpu.bodies.size(); ++i) {
    const btVector3 a = gpu.bodies[i]->getWorldTransform().getOrigin(),
                    b = stock.bodies[i]->getWorldTransform().getOrigin();
    EXPECT_LT(length(a - b), 0.02) << "body " << i;
  }
  EXPECT_NEAR(double(gpu.bodies.back()->getWorldTransform().getOrigin().y()), 1.5, 0.05) << "it lies on the moved body";
}

TEST(Filters, GroupsAndMasks) {
  Yard<btGpuDynamicsWorld> gpu;
  Yard<btDiscreteDynamicsWorld> stock;
  const auto run = [](auto& y) {
    y.w.world.removeRigidBody(y.bodies[0]);
    y.w.world.addRigidBody(y.bodies[0], 64, 64);  // meets nothing: falls through the ground
    y.bodies[3]->getBroadphaseProxy()->m_collisionFilterMask = 0;
    y.bodies[3]->activate();
    y.bodies[5]->getBroadphaseProxy()->m_collisionFilterGroup = 0;
    y.bodies[5]->activate();
    for (const size_t i : {3u, 5u}) {  // stock looks at filters when a pair is found, so the pair must be found anew
      y.w.world.getPairCache()->removeOverlappingPairsContainingProxy(y.bodies[i]->getBroadphaseProxy(),
                                                                      &y.w.dispatcher);
    }
    y.w.run(60);
  };
  run(gpu);
  run(stock);
  for (const size_t i : {0u, 3u, 5u}) EXPECT_LT(double(gpu.bodies[i]->getWorldTransform().getOrigin().y()), -1) << i;
  expectSame(gpu, stock, 0.01);
}

TEST(Filters, NoContactResponse) {
  compareAfter(
      0,
      [](auto& y) {
        y.bodies[1]->setCollisionFlags(y.bodies[1]->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
      },
      60, 1e-3);
}

}  // namespace
}  // namespace btgpu::test
