// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bodies made of several shapes.
#include "parts.h"

namespace scenes {
namespace {

btTransform turned(const btVector3& axis) {
  return btTransform(btQuaternion(axis, s(SIMD_HALF_PI)), btVector3(0, 0, 0));
}

}  // namespace

btCollisionShape* dumbbell(Objects& o) {
  btCompoundShape* shape = o.shape<btCompoundShape>();
  btSphereShape* ball = o.sphere(s(0.3));
  shape->addChildShape(placedAt(0, 0.5, 0), ball);
  shape->addChildShape(placedAt(0, -0.5, 0), ball);
  shape->addChildShape(placedAt(0, 0, 0), o.capsule(s(0.1), s(1)));
  return shape;
}

btCollisionShape* jack(Objects& o) {
  btCompoundShape* shape = o.shape<btCompoundShape>();
  btCapsuleShape* bar = o.capsule(s(0.15), s(0.9));
  shape->addChildShape(placedAt(0, 0, 0), bar);
  shape->addChildShape(turned(btVector3(1, 0, 0)), bar);
  shape->addChildShape(turned(btVector3(0, 0, 1)), bar);
  return shape;
}

btCollisionShape* angle(Objects& o) {
  btCompoundShape* shape = o.shape<btCompoundShape>();
  shape->addChildShape(placedAt(-0.25, 0.25, 0), o.box(btVector3(s(0.2), s(0.6), s(0.3))));
  shape->addChildShape(placedAt(0.25, -0.25, 0), o.box(btVector3(s(0.3), s(0.2), s(0.3))));
  return shape;
}

btCollisionShape* table(Objects& o) {
  btCompoundShape* legs = o.shape<btCompoundShape>();
  btBoxShape* leg = o.box(btVector3(s(0.08), s(0.35), s(0.08)));
  for (const double x : {-0.4, 0.4}) {
    for (const double z : {-0.4, 0.4}) legs->addChildShape(placedAt(x, 0, z), leg);
  }
  btCompoundShape* shape = o.shape<btCompoundShape>();
  shape->addChildShape(placedAt(0, 0.2, 0), o.hull(prism(6, 0.6, 0.06)));
  shape->addChildShape(placedAt(0, -0.2, 0), legs);
  return shape;
}

namespace {

// They fall on stairs, which are one static compound.
void addStairs(Objects& o, double half) {
  btCompoundShape* stairs = o.shape<btCompoundShape>();
  constexpr int kSteps = 8;
  for (int k = 0; k < kSteps; ++k) {
    const double depth = half / kSteps;
    stairs->addChildShape(placedAt(0, -0.5 + 0.15 * k, -half + depth * (2 * k + 1)),
                          o.box(btVector3(s(half), s(0.5), s(depth))));
  }
  o.add(0, stairs, btVector3(0, 0, 0))->setFriction(s(0.6));
}

void buildCompound(Objects& o, Size n) {
  addStairs(o, 2.0 * btMax(n.x, n.z) + 4);
  btCollisionShape* shapes[] = {dumbbell(o), angle(o), table(o), jack(o)};
  scatter(n, 3.0, [&](std::mt19937&, int number, const btTransform& at) {
    btRigidBody* body = o.add(1, shapes[number % 4], at);
    body->setFriction(s(0.6));
    body->setRollingFriction(s(0.05));
  });
}

}  // namespace

std::vector<Scene> compoundScenes() {
  return {
      {"compound",
       "dumbbells, angles, tables and jacks of several shapes rained on stairs",
       {6, 4, 6},
       600,
       kStep,
       {20, -0.2, Rest::Yes},
       buildCompound,
       {{15, 14, 15}, 200, cube}},
  };
}

}  // namespace scenes
