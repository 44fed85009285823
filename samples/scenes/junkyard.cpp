// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A heap of scrap: irregular hulls, and compounds of hulls, boxes and cylinders.
#include "parts.h"

namespace scenes {
namespace {

// Compounds are as heavy to either side of their origin, which is their centre of mass.

// Two irregular hulls grown together.
btCollisionShape* lump(Objects& o, std::mt19937& random) {
  std::uniform_real_distribution<double> size(0.2, 0.35), apart(0.15, 0.3);
  btCompoundShape* shape = o.shape<btCompoundShape>();
  const double x = apart(random);
  for (const double side : {-x, x}) {
    const double a = size(random), b = size(random), c = size(random);
    const btQuaternion turn = randomRotation(random);
    shape->addChildShape(btTransform(turn, btVector3(s(side), 0, 0)),
                         o.hull(randomHull(random, 12, btVector3(s(a), s(b), s(c)))));
  }
  return shape;
}

// An H of boxes.
btCollisionShape* girder(Objects& o, std::mt19937& random) {
  std::uniform_real_distribution<double> half(0.35, 0.55), height(0.15, 0.3);
  btCompoundShape* shape = o.shape<btCompoundShape>();
  const double length = half(random), y = height(random);
  btBoxShape* flange = o.box(btVector3(s(length), s(0.06), s(0.2)));
  shape->addChildShape(placedAt(0, y, 0), flange);
  shape->addChildShape(placedAt(0, -y, 0), flange);
  shape->addChildShape(placedAt(0, 0, 0), o.box(btVector3(s(length), s(y), s(0.06))));
  return shape;
}

// Two wheels on an axle.
btCollisionShape* wheels(Objects& o, std::mt19937& random) {
  std::uniform_real_distribution<double> radius(0.2, 0.35), track(0.3, 0.45);
  btCompoundShape* shape = o.shape<btCompoundShape>();
  const double r = radius(random), x = track(random);
  btCylinderShape* wheel = o.shape<btCylinderShapeX>(btVector3(s(0.1), s(r), s(r)));
  shape->addChildShape(placedAt(x, 0, 0), wheel);
  shape->addChildShape(placedAt(-x, 0, 0), wheel);
  shape->addChildShape(placedAt(0, 0, 0), o.shape<btCylinderShapeX>(btVector3(s(x), s(0.08), s(0.08))));
  return shape;
}

// A block between a drum and a lump.
btCollisionShape* engine(Objects& o, std::mt19937& random) {
  std::uniform_real_distribution<double> size(0.2, 0.3);
  btCompoundShape* shape = o.shape<btCompoundShape>();
  const double a = size(random), b = size(random), y = size(random);
  shape->addChildShape(placedAt(0, 0, 0), o.box(btVector3(s(1.3 * a), s(y), s(a))));
  shape->addChildShape(placedAt(0, 1.3 * y, 0), o.shape<btCylinderShape>(btVector3(s(a), s(b), s(a))));
  shape->addChildShape(placedAt(0, -1.3 * y, 0), o.hull(randomHull(random, 10, btVector3(s(a), s(b), s(a)))));
  return shape;
}

// As many hulls as compounds.
std::vector<btCollisionShape*> scrap(Objects& o, std::mt19937& random) {
  btCollisionShape* (*const kCompounds[])(Objects&, std::mt19937&) = {lump, girder, wheels, engine};
  std::vector<btCollisionShape*> shapes;
  for (int i = 0; i < kShapes; ++i) shapes.push_back(i % 2 ? kCompounds[i / 2 % 4](o, random) : rock(o, random));
  return shapes;
}

void buildJunkyard(Objects& o, Size n) {
  constexpr double kPitch = 1.6;
  const double halfX = 0.55 * kPitch * n.x + 0.5, halfZ = 0.55 * kPitch * n.z + 0.5;
  addPlane(o);
  addWalls(o, halfX, halfZ, kPitch * n.y);
  std::mt19937 random(6);
  const auto shapes = scrap(o, random);
  pile(o, n, kPitch, 0.5, shapes, random);
}

}  // namespace

std::vector<Scene> junkyardScenes() {
  return {
      {"junkyard",
       "X by Y by Z irregular hulls and compounds of hulls, boxes and cylinders poured in a walled yard",
       {4, 4, 4},
       300,
       kStep,
       // At this size they lie side by side on the ground, each on one of its sides.
       {24, 0, Rest::Yes, 0, 0, {}, true},
       buildJunkyard,
       {{14, 16, 14}, 240, cube}},
  };
}

}  // namespace scenes
