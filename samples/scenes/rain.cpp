// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bodies of many shapes that fall on a plane.
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>

#include "parts.h"

namespace scenes {
namespace {

void addRolling(Objects& o, btCollisionShape* shape, const btTransform& at) {
  btRigidBody* body = o.add(1, shape, at);
  body->setFriction(s(0.6));
  // Without it spheres roll for ever on a plane, in stock too.
  body->setRollingFriction(s(0.1));
  body->setSpinningFriction(s(0.1));
}

// On a plane: make(random, number) for each place of a grid over it.
template <typename Make>
void rain(Objects& o, Size n, const Make& make) {
  addPlane(o);
  scatter(n, 1.5, [&](std::mt19937& random, int number, const btTransform& at) {
    btCollisionShape* shape = make(random, number);
    addRolling(o, shape, at);
  });
}

void buildMixed(Objects& o, Size n) {
  std::uniform_real_distribution<double> size(0.4, 0.8);
  rain(o, n, [&o, &size](std::mt19937& random, int place) -> btCollisionShape* {
    const double a = size(random), b = size(random), c = size(random);
    switch (place % 4) {
      case 0:
        return o.box(btVector3(s(a), s(b), s(c)));
      case 1:
        return o.sphere(s(a));
      case 2:
        return o.capsule(s(a / 2), s(b));
      default:
        return o.hull(randomHull(random, 12, btVector3(s(a), s(b), s(c))));
    }
  });
}

void buildHulls(Objects& o, Size n) {
  std::uniform_real_distribution<double> size(0.4, 0.8);
  std::uniform_int_distribution<int> vertices(8, 32), sides(3, 12);
  rain(o, n, [&](std::mt19937& random, int place) {
    const double a = size(random), b = size(random), c = size(random);
    if (place % 3 == 0) return o.hull(prism(sides(random), a, b));
    return o.hull(randomHull(random, vertices(random), btVector3(s(a), s(b), s(c))));
  });
}

// One of each convex kind in turn.
btCollisionShape* anyPrimitive(Objects& o, std::mt19937& random, int place) {
  std::uniform_real_distribution<double> size(0.4, 0.8);
  const btScalar a = s(size(random)), b = s(size(random)), c = s(size(random));
  switch (place % 9) {
    case 0:
      return o.shape<btCylinderShape>(btVector3(a, b, a));
    case 1:
      return o.shape<btConeShape>(a, 2 * b);
    case 2: {
      const btVector3 at[] = {btVector3(-a / 2, 0, 0), btVector3(a / 2, 0, 0), btVector3(0, 0, b / 2)};
      const btScalar radii[] = {a / 2, b / 2, c / 2};
      return o.shape<btMultiSphereShape>(at, radii, 3);
    }
    case 3:
      return o.shape<btCylinderShapeX>(btVector3(b, a, a));
    case 4:
      return o.shape<btConeShapeZ>(a, b);
    case 5:
      return o.shape<btUniformScalingShape>(o.box(btVector3(a, b, c) / 2), btScalar(1.5));
    case 6: {
      const auto points = randomHull(random, 4, btVector3(1, 1, 1));
      return o.shape<btBU_Simplex1to4>(points[0] * a, points[1] * a, points[2] * a, points[3] * a);
    }
    case 7:
      // Not a 2D box: stock's GJK sees two of them along z, whatever their pose.
      return o.shape<btUniformScalingShape>(o.capsule(a / 2, b / 2), s(1.25));
    default:
      return o.shape<btUniformScalingShape>(o.shape<btCylinderShapeZ>(btVector3(a, a, b) / 2), btScalar(1.5));
  }
}

void buildPrimitives(Objects& o, Size n) {
  rain(o, n, [&o](std::mt19937& random, int place) { return anyPrimitive(o, random, place); });
}

// The same on boxes, a quarter of them turned on edge.
void buildPrimitivesOnBoxes(Objects& o, Size n) {
  addFloor(o);
  btBoxShape* step = o.box(btVector3(2, s(0.5), 2));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  for (int x = 0; x < n.x; ++x) {
    for (int z = 0; z < n.z; ++z) {
      const double atX = 2.0 * (x - n.x / 2), atZ = 2.0 * (z - n.z / 2);
      if (x % 2 == 0 && z % 2 == 0) {
        const btQuaternion turn(btVector3(0, 0, 1), s((x + z) % 8 ? 0 : 0.785));
        o.add(0, step, btTransform(turn, btVector3(s(atX), 0, s(atZ))));
      }
      for (int y = 0; y < n.y; ++y) {
        const btQuaternion rotation = randomRotation(random);
        const double offX = jitter(random), offZ = jitter(random);
        btCollisionShape* shape = anyPrimitive(o, random, x + 3 * y + z);
        addRolling(o, shape, btTransform(rotation, btVector3(s(atX + offX), s(2.5 + 2.0 * y), s(atZ + offZ))));
      }
    }
  }
}

void buildBounce(Objects& o, Size n) {
  addPlane(o);
  o.bodies().front()->setRestitution(1);
  btSphereShape* ball = o.sphere(s(0.5));
  btBoxShape* box = o.box(btVector3(s(0.4), s(0.4), s(0.4)));
  for (int x = 0; x < n.x; ++x) {
    const btScalar restitution = s(0.9 * x / btMax(1, n.x - 1));
    for (int z = 0; z < n.z; ++z) {
      btCollisionShape* shape = z % 2 ? static_cast<btCollisionShape*>(box) : ball;
      o.add(1, shape, btVector3(s(2.0 * x), s(3.0 + 0.5 * z), s(2.0 * z)))->setRestitution(restitution);
    }
  }
}

}  // namespace

std::vector<Scene> rainScenes() {
  return {
      // Stock finds one corner of a box on a plane a step, btgpu all of them: boxes that land tumble less, and a pile
      // rained on a plane stands 3.8 +- 1.7 % higher (the same rain on a box: 1.0 +- 1.3 %).
      {"mixed",
       "boxes, spheres, capsules and hulls of many sizes rained on a plane",
       {8, 8, 8},
       600,
       kStep,
       {20, 0, Rest::Yes, 0.05},
       buildMixed,
       {{16, 16, 16}, 240, cube}},
      {"hulls",
       "convex hulls of 8 to 32 vertices and prisms rained on a plane",
       {6, 6, 6},
       600,
       kStep,
       {20, 0, Rest::Yes, 0.05},
       buildHulls,
       {{12, 12, 12}, 240, cube}},
      {"primitives",
       "cylinders, cones, multi-spheres, simplices and scaled shapes rained on a plane",
       {6, 6, 6},
       600,
       kStep,
       {20, 0, Rest::Yes, 0.05},
       buildPrimitives,
       {{14, 14, 14}, 240, cube}},
      {"primitives_on_boxes",
       "the same rained on boxes",
       {6, 4, 6},
       600,
       kStep,
       {20, -2, Rest::Yes, 0.05},
       buildPrimitivesOnBoxes,
       {{14, 14, 14}, 240, cube}},
      {"bounce",
       "balls and boxes with restitution from 0 to 0.9 dropped on a plane",
       {10, 1, 6},
       300,
       kStep,
       {40, 0, Rest::No},
       buildBounce,
       {{64, 1, 64}, 120, square}},
  };
}

}  // namespace scenes
