// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Compounds that hold meshes, height fields and planes, as levels are built of them: contacts, what contacts are called
// and whole runs, held against stock.
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 v(double x, double y, double z) { return {s(x), s(y), s(z)}; }
btTransform at(double x, double y, double z) { return btTransform(btQuaternion::getIdentity(), v(x, y, z)); }
btTransform turned(double x, double y, double z, double degrees) {
  return btTransform(btQuaternion(v(0.2, 1, 0.1).normalized(), s(degrees * M_PI / 180)), v(x, y, z));
}

double hill(double x, double z) { return 0.3 * std::sin(0.9 * x) * std::cos(0.7 * z); }

// n by n cells of a metre around the origin.
btTriangleMesh* landscape(scenes::Objects& o, int n) {
  auto* mesh = o.keep(std::make_unique<btTriangleMesh>());
  const auto point = [n](int i, int j) { return v(i - n / 2, hill(i, j), j - n / 2); };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      mesh->addTriangle(point(i, j), point(i, j + 1), point(i + 1, j));
      mesh->addTriangle(point(i + 1, j), point(i, j + 1), point(i + 1, j + 1));
    }
  }
  return mesh;
}

constexpr int kField = 7;  // heights along a side, a metre apart

btCollisionShape* field(scenes::Objects& o) {
  auto* heights = o.keep(std::make_unique<std::array<float, kField * kField>>());
  for (int j = 0; j < kField; ++j) {
    for (int i = 0; i < kField; ++i) (*heights)[std::size_t(j * kField + i)] = float(hill(i, j));
  }
  return o.own(std::make_unique<btHeightfieldTerrainShape>(kField, kField, heights->data(), s(-1), s(1), 1, false));
}

// Places 7 m apart along x: a mesh, a scaled one, one of several materials, a height field; and at the end a plane that
// leans away, which ends the level there.
btCompoundShape* level(scenes::Objects& o) {
  auto* shape = o.shape<btCompoundShape>();
  auto* mesh = o.shape<btBvhTriangleMeshShape>(landscape(o, 6), true);
  shape->addChildShape(turned(-10, 0, 0, 10), mesh);
  shape->addChildShape(turned(-3, 0.1, 0, -15),
                       o.own(std::make_unique<btScaledBvhTriangleMeshShape>(mesh, v(1, 0.7, 1.2))));
  shape->addChildShape(at(4, 0, 0), o.own(std::make_unique<btMultimaterialTriangleMeshShape>(landscape(o, 6), true)));
  shape->addChildShape(turned(11, 0, 0, 5), field(o));
  shape->addChildShape(at(16, 0, 0), o.plane(v(-1, 1, 0).normalized(), 0));
  shape->addChildShape(at(-14, 0.4, 0), o.box(v(0.5, 1, 3)));
  return shape;
}

std::vector<btCollisionShape*> things(scenes::Objects& o) {
  auto* dumbbell = o.shape<btCompoundShape>();
  dumbbell->addChildShape(at(-0.4, 0, 0), o.sphere(s(0.25)));
  dumbbell->addChildShape(turned(0.3, 0, 0, 20), o.box(v(0.2, 0.3, 0.2)));
  auto* nested = o.shape<btCompoundShape>();
  nested->addChildShape(at(0, 0.1, 0), dumbbell);
  nested->addChildShape(at(0, -0.2, 0.3), o.capsule(s(0.2), s(0.3)));
  return {o.sphere(s(0.4)),
          o.box(v(0.3, 0.4, 0.25)),
          dumbbell,
          o.capsule(s(0.25), s(0.5)),
          o.hull(scenes::prism(6, 0.4, 0.3)),
          nested,
          o.hull(scenes::prism(4, 0.3, 0.4))};
}

btGpuSettings onDevice() {
  btGpuSettings settings;
  settings.m_smallWorld = 0;
  return settings;
}

btGpuSettings checked() {
  btGpuSettings settings = onDevice();
  settings.m_crosscheckEvery = 1;
  return settings;
}

std::string failures(const btGpuCrosscheckSummary& summary) {
  std::string text = "first in step " + std::to_string(summary.m_first.m_step) + ": ";
  for (const auto* checks : {&summary.m_first.m_checks, &summary.m_checks}) {
    for (const btGpuCheck& c : *checks) {
      if (c.m_failed)
        text += std::string(c.m_name) + " " + std::to_string(c.m_value) + " > " + std::to_string(c.m_limit) + "; ";
    }
  }
  return text;
}

void expectAgreement(const btGpuDynamicsWorld& world, unsigned steps) {
  expectAllOnDevice(world);
  EXPECT_EQ(world.crosscheck().m_checkedSteps, steps);
  EXPECT_TRUE(world.crosscheck().agreed()) << failures(world.crosscheck());
}

// Two of each thing over each part of the level, a little in it or above it.
void rain(scenes::Objects& o, double height) {
  const auto all = things(o);
  for (int place = 0; place < 4; ++place) {
    for (int i = 0; i < 14; ++i) {
      const double x = 7 * place - 12 + 1.1 * (i % 5), z = 1.4 * (i / 5) - 1.5;
      btRigidBody* body =
          o.add(1, all[std::size_t(i) % all.size()], turned(x, height + 0.6 * (i % 2), z, 25 * i + place));
      body->setRollingFriction(s(0.05));
    }
  }
  for (int i = 0; i < 4; ++i) o.add(1, all[std::size_t(i)], at(15 + 0.5 * i, 1.5, 1.2 * i - 2));  // and the plane
}

// ---- contacts and their names
struct Named {
  int body0, body1, part0, index0, part1, index1;
  double distance;
  btVector3 normal;
};

// Of each manifold with points the deepest one, by the bodies' numbers in the world.
std::vector<Named> contactsOf(const btDispatcher& dispatcher) {
  std::vector<Named> out;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& m = *const_cast<btDispatcher&>(dispatcher).getManifoldByIndexInternal(i);
    const btManifoldPoint* deepest = nullptr;
    for (int k = 0; k < m.getNumContacts(); ++k) {
      const btManifoldPoint& p = m.getContactPoint(k);
      if (!deepest || p.getDistance() < deepest->getDistance()) deepest = &p;
    }
    if (!deepest) continue;
    out.push_back({m.getBody0()->getWorldArrayIndex(), m.getBody1()->getWorldArrayIndex(), deepest->m_partId0,
                   deepest->m_index0, deepest->m_partId1, deepest->m_index1, double(deepest->getDistance()),
                   deepest->m_normalWorldOnB});
  }
  const auto key = [](const Named& n) {
    return std::make_tuple(n.body0, n.body1, n.part0, n.index0, n.part1, n.index1);
  };
  std::sort(out.begin(), out.end(), [&](const Named& a, const Named& b) { return key(a) < key(b); });
  return out;
}

// One step of balls that lie on each part of the level, where the deepest triangle is one for certain.
template <typename World>
std::vector<Named> namesOf(WorldOf<World>& w, bool nested) {
  auto& o = w.objects;
  w.world.setGravity(v(0, 0, 0));
  btCompoundShape* shape = level(o);
  if (nested) {
    auto* around = o.template shape<btCompoundShape>();
    around->addChildShape(at(0, -5, 0), o.box(v(1, 1, 1)));
    around->addChildShape(at(0, 0, 0), shape);
    shape = around;
  }
  o.add(0, shape, at(0, 0, 0));
  auto* pair = o.template shape<btCompoundShape>();
  pair->addChildShape(at(0, 5, 0), o.sphere(s(0.1)));
  pair->addChildShape(at(0, 0, 0), o.sphere(s(0.4)));
  for (int i = 0; i < 8; ++i) {
    const double x = -12.2 + 3.45 * i;
    o.add(1, o.sphere(s(0.4)), at(x, 0.2, 0.3));
    o.add(1, pair, at(x, 0.2, 1.7));
  }
  o.add(1, pair, at(15.5, 0.1, 0));
  w.run(1);
  return contactsOf(w.dispatcher);
}

TEST(CompoundLevels, ContactsAreStocksAndNamedAsInStock) {
  for (const bool nested : {false, true}) {
    SCOPED_TRACE(nested ? "nested" : "not nested");
    WorldOf<btGpuDynamicsWorld> gpu(onDevice());
    WorldOf<btDiscreteDynamicsWorld> stock;
    const std::vector<Named> ours = namesOf(gpu, nested), theirs = namesOf(stock, nested);
    expectAllOnDevice(gpu.world);
    ASSERT_EQ(ours.size(), theirs.size());
    EXPECT_GE(ours.size(), 14u) << "else the test says nothing";
    int triangles = 0, shapes = 0;
    for (size_t i = 0; i < ours.size(); ++i) {
      const Named &a = ours[i], &b = theirs[i];
      EXPECT_EQ(std::make_tuple(a.body0, a.body1, a.part0, a.index0, a.part1, a.index1),
                std::make_tuple(b.body0, b.body1, b.part0, b.index0, b.part1, b.index1))
          << "contact " << i;
      EXPECT_NEAR(a.distance, b.distance, 1e-4) << i;
      EXPECT_GT(double(a.normal.dot(b.normal)), 0.9999) << i;
      triangles += a.part1 >= 0;
      shapes += a.part1 < 0 && a.index1 >= 0;
    }
    EXPECT_GE(triangles, 12) << "on meshes and the field";
    EXPECT_GE(shapes, 1) << "on the plane";
  }
}

// ---- whole runs
TEST(CompoundLevels, ThingsRainOnOne) {
  WorldOf<btGpuDynamicsWorld> w(checked());
  w.world.setGravity(v(0, -10, 0));
  w.objects.add(0, level(w.objects), at(0, 0, 0));
  rain(w.objects, 0.9);
  w.run(90);
  expectAgreement(w.world, 90);
}

TEST(CompoundLevels, ANestedOneThatTheApplicationMoves) {
  WorldOf<btGpuDynamicsWorld> w(checked());
  w.world.setGravity(v(0, -10, 0));
  auto* around = w.objects.shape<btCompoundShape>();
  auto* inner = level(w.objects);
  inner->removeChildShapeByIndex(4);  // a body with a plane in it has no bounds, and is static
  around->addChildShape(turned(0, -0.5, 0, 3), inner);
  around->addChildShape(at(0, 0, 4), w.objects.box(v(14, 1, 0.5)));
  btRigidBody* lift = w.objects.add(0, around, at(0, 0, 0));
  lift->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  lift->setActivationState(DISABLE_DEACTIVATION);
  rain(w.objects, 0.6);
  for (int i = 1; i <= 60; ++i) {
    lift->setWorldTransform(turned(0.002 * i, 0.005 * i, 0, 0.05 * i));
    w.run(1);
  }
  expectAgreement(w.world, 60);
}

// A mesh that moves, as Bullet has it: it touches what is convex and no other mesh.
TEST(CompoundLevels, AMovingBodyWithAMeshInIt) {
  WorldOf<btGpuDynamicsWorld> w(checked());
  auto& o = w.objects;
  w.world.setGravity(v(0, -10, 0));
  o.add(0, o.box(v(20, 1, 20)), at(0, -1, 0));
  o.add(0, o.shape<btBvhTriangleMeshShape>(landscape(o, 6), true), at(0, 0.1, 0));
  auto* sled = o.shape<btCompoundShape>();
  sled->addChildShape(at(0, 0.3, 0), o.shape<btBvhTriangleMeshShape>(landscape(o, 4), true));
  sled->addChildShape(at(0, 0.2, 0), o.box(v(1.5, 0.1, 1.5)));
  for (int i = 0; i < 3; ++i) {
    btRigidBody* body = o.add(5, sled, at(5 * i - 5, 0.6 + 0.3 * i, 0));
    body->setLinearVelocity(v(1 - i, 0, 0));
  }
  const auto all = things(o);
  for (size_t i = 0; i < all.size(); ++i) o.add(1, all[i], turned(1.5 * double(i) - 5, 1.8, 0.1, 30 * double(i)));
  w.run(60);
  expectAgreement(w.world, 60);
}

// Bullet's planes have no bounds, and bodies that move without bounds are disabled: on the stock path, as planes are.
TEST(CompoundLevels, WithPlanesTheyAreStatic) {
  GpuWorld w;
  auto* shape = w.objects.shape<btCompoundShape>();
  shape->addChildShape(at(0, 0, 0), w.objects.plane(v(0, 1, 0), 0));
  btRigidBody* body = w.objects.add(0, shape, at(0, 0, 0));
  w.run(1);
  expectAllOnDevice(w.world);
  w.world.removeRigidBody(body);
  body->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  w.world.addRigidBody(body);
  w.run(1);
  EXPECT_TRUE(reported(w.world, "plane on a body that moves").m_wholeStep) << reportText(w.world);
}

// The highest speed of boxes at rest on two meshes, of one body or of one each, while the world goes to the stock path
// and back.
double stirred(bool ofOneBody, bool contacts) {
  btGpuSettings settings = onDevice();
  settings.m_contacts = contacts;
  WorldOf<btGpuDynamicsWorld> w(settings);
  auto& o = w.objects;
  w.world.setGravity(v(0, -10, 0));
  auto* floor = o.keep(std::make_unique<btTriangleMesh>());
  floor->addTriangle(v(-5, 0, -5), v(-5, 0, 5), v(5, 0, -5));
  floor->addTriangle(v(5, 0, -5), v(-5, 0, 5), v(5, 0, 5));
  auto* mesh = o.shape<btBvhTriangleMeshShape>(floor, true);
  auto* shape = o.shape<btCompoundShape>();
  for (const double x : {-6.0, 6.0}) {
    shape->addChildShape(at(x, 0, 0), mesh);
    if (!ofOneBody) o.add(0, mesh, at(x, 0, 0));
  }
  if (ofOneBody) o.add(0, shape, at(0, 0, 0));
  std::vector<btRigidBody*> boxes;
  for (const double x : {-7.5, -4.5, 4.5, 7.5}) boxes.push_back(o.add(1, o.box(v(0.4, 0.4, 0.4)), at(x, 0.41, 0.2)));
  for (btRigidBody* box : boxes) box->setSleepingThresholds(0, 0);
  w.run(120);
  double speed = 0;
  for (int i = 0; i < 12; ++i) {
    w.world.getSolverInfo().m_leastSquaresResidualThreshold = s(i % 6 < 3 ? 1e-30 : 0);  // not on the device
    w.run(1);
    for (btRigidBody* box : boxes) speed = std::max(speed, length(box->getLinearVelocity()));
  }
  EXPECT_EQ(w.world.statistics().m_stockSteps, 6u);
  return speed;
}

// Points and impulses go along, as where the meshes are bodies. What stirs the boxes is stock, which finds one point a
// step; without points and impulses they get half of what gravity adds in a step.
TEST(CompoundLevels, ContactsGoToTheStockPathAndBack) {
  for (const bool contacts : {true, false})
    EXPECT_LT(stirred(true, contacts), 2 * stirred(false, contacts)) << contacts;
}

}  // namespace
}  // namespace btgpu::test
