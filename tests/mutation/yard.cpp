// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// An application linked with btgpu that knows nothing of its checks, with something in it for each of the planted
// faults (tests/mutation/run.sh) to spoil: materials that differ, free spin under torque, damping, gravity of its own,
// filters, deep overlaps, sleeping stacks that are hit, a kinematic pusher, compounds, a mesh and a height field with
// all sorts of shapes on them, curved shapes, bodies that go and others that take their place.
//   mutation_yard STEPS
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "compat/btGpuDynamicsWorld.h"
#include "tests/support/world_of.h"

namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 v(double x, double y, double z) { return btVector3(s(x), s(y), s(z)); }

class Yard {
 public:
  Yard() {
    m_objects.world().setGravity(v(0, -10, 0));
    m_objects.add(0, m_objects.box(v(200, 1, 200)), v(0, -1, 0))->setFriction(s(0.6));
    addStacks();
    addSliders();
    addBouncers();
    addSpinners();
    addOddOnes();
    addSleepers();
    addRound();
    addPusher();
    addCompounds();
    addLand();
    addCurved();
  }

  void step(int number) {
    for (btRigidBody* body : m_spinners) body->applyTorque(v(3, -2, 1));
    btTransform at = m_pusher->getWorldTransform();
    at.setOrigin(at.getOrigin() + v(0.02, 0, 0));
    m_pusher->setWorldTransform(at);
    if (number % 10 == 5) exchange(number / 10);
    m_world.world.stepSimulation(s(1.0 / 60), 0);
  }

  btGpuStatistics statistics() const { return m_world.world.statistics(); }

 private:
  btRigidBody* add(double mass, btCollisionShape* shape, const btVector3& at) {
    return m_objects.add(s(mass), shape, at);
  }

  // Enough pairs that one in 64 is some, and enough bodies that the last work-group is not full.
  void addStacks() {
    btBoxShape* crate = m_objects.box(v(0.5, 0.5, 0.5));
    for (int x = 0; x < 4; ++x) {
      for (int y = 0; y < 5; ++y) {
        for (int z = 0; z < 4; ++z) add(1 + y, crate, v(-12 + 1.05 * x + 0.02 * y, 0.5 + 1.02 * y, -8 + 1.1 * z));
      }
    }
    // One inside the other, for the split impulse.
    for (int k = 0; k < 3; ++k) {
      add(1, crate, v(-4 + 3 * k, 0.4, -14));
      add(1, crate, v(-3.9 + 3 * k, 1.1, -14));
    }
  }

  void addSliders() {
    btBoxShape* plate = m_objects.box(v(0.5, 0.2, 0.8));
    for (int k = 0; k < 6; ++k) {
      btRigidBody* body = add(1 + k, plate, v(2.5 * k, 0.2, 4));
      body->setFriction(s(0.1 + 0.3 * k));
      body->setLinearVelocity(v(0.5, 0, 2 + k));
      body->setAngularVelocity(v(0, 0.5, 0));
    }
  }

  void addBouncers() {
    btSphereShape* ball = m_objects.sphere(s(0.3));
    for (int k = 0; k < 8; ++k) {
      btRigidBody* body = add(0.5, ball, v(-10 + 1.5 * k, 0.3 + 0.001 * k * k + (k > 4 ? 0.3 * k : 0), 8));
      body->setRestitution(s(0.9));
      body->setLinearVelocity(v(0.3, -0.15, 0));  // slower than the threshold
    }
    m_objects.bodies()[0]->setRestitution(s(0.9));
  }

  void addSpinners() {
    btBoxShape* rod = m_objects.box(v(0.2, 1.5, 0.4));
    for (int k = 0; k < 4; ++k) {
      btRigidBody* body = add(2, rod, v(-6 + 4 * k, 60, 14));
      body->setAngularVelocity(v(3 + k, 2, 5 - k));
      if (k % 2) body->setFlags(body->getFlags() | BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
      m_spinners.push_back(body);
    }
  }

  void addOddOnes() {
    btSphereShape* ball = m_objects.sphere(s(0.4));
    for (int k = 0; k < 4; ++k) {
      btRigidBody* damped = add(1, ball, v(10 + k, 20 + 2 * k, 0));
      damped->setDamping(s(0.3 + 0.1 * k), s(0.4));
      damped->setLinearVelocity(v(4, 1, -3));
      damped->setAngularVelocity(v(1, 2, 3));
      btRigidBody* floating = add(1, ball, v(16 + k, 5, 2 * k));
      floating->setGravity(v(0.5, 1.5 - k, 0));
    }
    // Two kinds that go through each other.
    for (int k = 0; k < 6; ++k) {
      btRigidBody* body = add(1, ball, v(20, 0.4 + 0.3 * k, -6));
      m_objects.world().removeRigidBody(body);
      m_objects.world().addRigidBody(body, 64 << (k % 2), 1 | (64 << (k % 2)));
    }
  }

  // Asleep until something falls on them.
  void addSleepers() {
    btBoxShape* crate = m_objects.box(v(0.4, 0.4, 0.4));
    for (int k = 0; k < 3; ++k) {
      for (int y = 0; y < 3; ++y) { add(1, crate, v(26, 0.4 + 0.8 * y, 4 * k))->forceActivationState(ISLAND_SLEEPING); }
      add(3, m_objects.sphere(s(0.3)), v(26.1, 3.5 + 2 * k, 4 * k))->setLinearVelocity(v(0, -4, 0));
    }
  }

  void addRound() {
    btCapsuleShape* capsule = m_objects.capsule(s(0.3), s(0.8));
    btConvexHullShape* drum = m_objects.hull(scenes::prism(8, 0.5, 0.4));
    for (int k = 0; k < 5; ++k) {
      const btTransform turned(btQuaternion(v(1, 0.2 * k, 0.5).normalized(), s(0.4 * k + 0.2)),
                               v(-20, 0.9 + k, 1.1 * k));
      m_objects.add(1, capsule, turned)->setRollingFriction(s(0.1));
      m_objects.add(1, drum, btTransform(turned.getRotation(), turned.getOrigin() + v(1.2, 0.1, 0)));
    }
  }

  void addPusher() {
    m_pusher = add(0, m_objects.box(v(0.5, 0.5, 2)), v(-2, 0.5, -4));
    m_pusher->setCollisionFlags(m_pusher->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    m_pusher->setActivationState(DISABLE_DEACTIVATION);
    for (int k = 0; k < 3; ++k) add(1, m_objects.box(v(0.4, 0.4, 0.4)), v(-1, 0.4, -5.5 + 1.2 * k));
  }

  // Tumbling ones, one on the other, and some asleep until they are hit.
  void addCompounds() {
    auto* dumbbell = m_objects.shape<btCompoundShape>();
    const auto at = [](double x, double y, double z) { return btTransform(btQuaternion::getIdentity(), v(x, y, z)); };
    dumbbell->addChildShape(at(0, 0, 0), m_objects.box(v(0.8, 0.15, 0.2)));
    dumbbell->addChildShape(btTransform(btQuaternion(v(1, 0, 0), s(0.6)), v(-0.8, 0, 0.1)),
                            m_objects.box(v(0.3, 0.4, 0.35)));
    dumbbell->addChildShape(at(0.8, 0, 0), m_objects.sphere(s(0.35)));
    for (int k = 0; k < 8; ++k) {
      btRigidBody* body = add(2, dumbbell, v(-30 + 0.9 * (k % 2), 0.6 + 0.9 * k, 10 + 0.1 * k));
      body->setAngularVelocity(v(0.5 * k, 1, 2));
    }
    for (int k = 0; k < 2; ++k) {
      add(2, dumbbell, v(-30, 0.5, 16 + 3 * k))->forceActivationState(ISLAND_SLEEPING);
      add(3, m_objects.sphere(s(0.3)), v(-29.9, 3 + 2 * k, 16 + 3 * k))->setLinearVelocity(v(0, -5, 0));
    }
  }

  // A mesh and a height field, both with the same bodies on them.
  void addLand() {
    constexpr int kCorners = 13;
    const auto height = [](int i, int j) { return 1.5 + 0.5 * std::sin(0.9 * i) * std::cos(0.7 * j); };
    auto* triangles = m_objects.keep(std::make_unique<btTriangleMesh>());
    auto* heights = m_objects.keep(std::make_unique<std::vector<float>>());
    const auto corner = [&](int i, int j) { return v(i - 6, height(i, j), j - 6); };
    for (int j = 0; j < kCorners; ++j) {
      for (int i = 0; i < kCorners; ++i) heights->push_back(static_cast<float>(height(i, j)));
    }
    for (int i = 0; i + 1 < kCorners; ++i) {
      for (int j = 0; j + 1 < kCorners; ++j) {
        triangles->addTriangle(corner(i, j), corner(i, j + 1), corner(i + 1, j));
        triangles->addTriangle(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
      }
    }
    const btQuaternion turn(v(0, 1, 0), s(0.3));
    auto* mesh = m_objects.shape<btBvhTriangleMeshShape>(triangles, true);
    mesh->setMargin(s(0.008));
    m_objects.add(0, mesh, btTransform(turn, v(50, 0, 0)));
    addOnLand(50, 0);
    m_objects.add(0,
                  m_objects.own(std::make_unique<btHeightfieldTerrainShape>(kCorners, kCorners, heights->data(), s(1),
                                                                            s(2), 1, false)),
                  btTransform(turn, v(50, 1.5, 30)));
    addOnLand(50, 30);
  }

  void addOnLand(double x, double z) {
    btCollisionShape* shapes[] = {m_objects.box(v(0.5, 0.4, 0.3)), m_objects.sphere(s(0.45)),
                                  m_objects.capsule(s(0.3), s(0.6)), m_objects.hull(scenes::prism(6, 0.5, 0.3)),
                                  m_objects.shape<btCylinderShape>(v(0.4, 0.5, 0.4))};
    for (int k = 0; k < 10; ++k) {
      const btQuaternion turn(v(1, 0.3 * k, 0.4).normalized(), s(0.5 * k));
      m_objects.add(1, shapes[k % 5], btTransform(turn, v(x - 1 + 2 * (k / 5), 2.6 + 0.05 * k, z - 4 + 2 * (k % 5))))
          ->setRollingFriction(s(0.1));
    }
  }

  // On a platform of their own, some standing, some deep in each other.
  void addCurved() {
    add(0, m_objects.box(v(6, 0.5, 6)), v(-40, 0.5, -20));
    const btVector3 centres[] = {v(-0.3, 0, 0), v(0.3, 0.1, 0), v(0, 0.2, 0.3)};
    const btScalar radii[] = {s(0.3), s(0.4), s(0.25)};
    btCollisionShape* shapes[] = {m_objects.shape<btCylinderShape>(v(0.5, 0.4, 0.5)),
                                  m_objects.shape<btConeShape>(s(0.5), s(1)),
                                  m_objects.shape<btMultiSphereShape>(centres, radii, 3),
                                  m_objects.shape<btCylinderShapeX>(v(0.6, 0.3, 0.3)), m_objects.box(v(0.4, 0.4, 0.4))};
    for (int k = 0; k < 6; ++k) {
      const btQuaternion turn(v(1, 0.2 * k, 0.5).normalized(), s(k < 3 ? 0 : 0.6 * k));
      m_objects.add(1, shapes[k % 5], btTransform(turn, v(-42 + 0.7 * (k % 3) + 3 * (k / 3), 1.5, -20)));
    }
  }

  // A body of a stack goes, and in the same moment another one, rough and light, takes its place and its slot.
  void exchange(int which) {
    btRigidBody* gone = m_objects.bodies()[static_cast<size_t>(1 + 5 * which + 4)];
    if (!gone->isInWorld()) return;
    const btTransform at = gone->getWorldTransform();
    m_objects.world().removeRigidBody(gone);
    btRigidBody* come = m_objects.add(s(0.5), m_objects.box(v(0.5, 0.5, 0.5)), at);
    come->setFriction(s(1.5));
  }

  btgpu::test::WorldOf<btGpuDynamicsWorld> m_world;
  scenes::Objects& m_objects = m_world.objects;
  std::vector<btRigidBody*> m_spinners;
  btRigidBody* m_pusher = nullptr;
};

}  // namespace

int main(int argc, char** argv) {
  const int steps = argc == 2 ? std::atoi(argv[1]) : 0;
  if (steps < 1) {
    std::fprintf(stderr, "usage: mutation_yard STEPS\n");
    return 2;
  }
  Yard yard;
  for (int i = 0; i < steps; ++i) yard.step(i);
  const btGpuStatistics statistics = yard.statistics();
  std::printf("deviceSteps %llu\nstockSteps %llu\n", statistics.m_deviceSteps, statistics.m_stockSteps);
  return 0;
}
