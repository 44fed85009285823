// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bodies of many shapes on a rolling landscape: triangles, or a height field.
#include "landscape.h"

namespace scenes {
namespace {

void addBodies(Objects& o, Size n) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2), size(0.3, 0.6);
  std::vector<btCollisionShape*> shapes;
  for (int i = 0; i < 16; ++i) {
    const double a = size(random), b = size(random), c = size(random);
    shapes.push_back(o.box(btVector3(s(a), s(b), s(c))));
    shapes.push_back(o.sphere(s(a)));
    shapes.push_back(o.capsule(s(a / 2), s(b)));
    shapes.push_back(o.hull(randomHull(random, 12, btVector3(s(a), s(b), s(c)))));
  }
  std::size_t next = 0;
  for (int y = 0; y < n.y; ++y) {
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        const btVector3 at(s(2.0 * (x - n.x / 2) + jitter(random)), s(2.5 + 1.6 * y),
                           s(2.0 * (z - n.z / 2) + jitter(random)));
        btRigidBody* body = o.add(1, shapes[next++ % shapes.size()], btTransform(randomRotation(random), at));
        body->setFriction(s(0.6));
        body->setRollingFriction(s(0.1));
        body->setSpinningFriction(s(0.1));
      }
    }
  }
}

void buildMesh(Objects& o, Size n) {
  addMeshGround(o, n);
  addBodies(o, n);
}

void buildHeightField(Objects& o, Size n) {
  addHeightFieldGround(o, n);
  addBodies(o, n);
}

// Four layers of bodies.
Size layers(int bodies) { return {root(bodies / 4.0, 2), 4, root(bodies / 4.0, 2)}; }

}  // namespace

std::vector<Scene> terrainScenes() {
  // Bodies come to rest in other hollows than stock's after a while: the mean of N = 128 heights, spread by 0.3 m over
  // hollows and slopes, differs by 0.3 sqrt(2 / N) = 0.04 m between two right runs, in three of four less than 15 % of
  // a mean height of 0.3 m.
  constexpr double kHollows = 0.15;
  return {
      {"mesh",
       "boxes, spheres, capsules and hulls rained on a rolling landscape of triangles",
       {8, 2, 8},
       400,
       kStep,
       {20, kLowestGround, Rest::AsStock, kHollows},
       buildMesh,
       {{28, 4, 28}, 240, layers}},
      {"heightfield",
       "the same on a height field",
       {8, 2, 8},
       400,
       kStep,
       {20, kLowestGround, Rest::AsStock, kHollows},
       buildHeightField,
       {{28, 4, 28}, 240, layers}},
  };
}

}  // namespace scenes
