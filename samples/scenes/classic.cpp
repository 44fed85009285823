// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The seven scenes of Bullet's classic benchmark, rebuilt from their published description: what there is and how
// many, not where each body stands.
#include <algorithm>
#include <cmath>

#include "landscape.h"
#include "parts.h"

namespace scenes {
namespace {

constexpr double kTurn = 6.283185307179586;

// Calls place(x, y, z) for each body of X by Z columns of Y, whose layers grow wider upwards, so that they fall beside
// and onto each other.
template <typename Place>
void fall(Size n, double pitch, double lift, const Place& place) {
  for (int y = 0; y < n.y; ++y) {
    const double wider = pitch * (1 + 0.02 * y);
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        place(wider * (x - 0.5 * (n.x - 1)), lift + pitch * y, wider * (z - 0.5 * (n.z - 1)));
      }
    }
  }
}

void buildFallingBoxes(Objects& o, Size n) {
  addFloor(o, 3.0 * n.x + 2.0 * n.y, 3.0 * n.z + 2.0 * n.y);
  btBoxShape* box = o.box(btVector3(1, 1, 1));
  fall(n, 3, 2, [&](double x, double y, double z) { o.add(2, box, placedAt(x, y, z)); });
}

// ---- stacks

constexpr double kEdge = 1.0;  // of a box

void addSquarePyramid(Objects& o, btBoxShape* box, int base, double x, double z) {
  for (int row = 0; row < base; ++row) {
    const int side = base - row;
    for (int i = 0; i < side; ++i) {
      for (int k = 0; k < side; ++k) {
        o.add(1, box,
              placedAt(x + kEdge * (i - 0.5 * (side - 1)), kEdge * (row + 0.5), z + kEdge * (k - 0.5 * (side - 1))));
      }
    }
  }
}

// Each course by half a box beside the one below.
void addWall(Objects& o, btBoxShape* box, int size, double x, double z) {
  for (int row = 0; row < size; ++row) {
    for (int i = 0; i < size; ++i) {
      o.add(1, box, placedAt(x, kEdge * (row + 0.5), z + kEdge * (i - 0.5 * (size - 1) + (row % 2 ? 0.25 : -0.25))));
    }
  }
}

// Courses of boxes in a ring, with gaps over which the next course lies.
void addRoundTower(Objects& o, btBoxShape* box, int courses, double x, double z) {
  constexpr int kBoxes = 16;
  const double radius = 1.3 * kBoxes * kEdge / kTurn;
  for (int row = 0; row < courses; ++row) {
    for (int i = 0; i < kBoxes; ++i) {
      const double angle = kTurn * (i + 0.5 * (row % 2)) / kBoxes;
      const btVector3 at(s(x + radius * std::cos(angle)), s(kEdge * (row + 0.5)), s(z + radius * std::sin(angle)));
      o.add(1, box, btTransform(btQuaternion(btVector3(0, 1, 0), s(-angle)), at));
    }
  }
}

// Of a set: 986 boxes at a height of 12.
void buildStacks(Objects& o, Size n) {
  const double pitch = 2.0 * n.y + 16;
  addFloor(o, pitch * n.x / 2 + 20, pitch * n.z / 2 + 20);
  btBoxShape* box = o.box(btVector3(s(kEdge / 2), s(kEdge / 2), s(kEdge / 2)));
  for (int i = 0; i < n.x; ++i) {
    for (int k = 0; k < n.z; ++k) {
      const double x = pitch * (i - 0.5 * (n.x - 1)), z = pitch * (k - 0.5 * (n.z - 1));
      addSquarePyramid(o, box, n.y, x - 0.5 * n.y - 2, z);
      addWall(o, box, n.y, x, z);
      addRoundTower(o, box, n.y, x + 6.5, z);
    }
  }
}

// ---- ragdolls

// Flat pyramids of ragdolls of capsules, which lean a little: upright ones stand on the tips of their legs until
// rounding tips them over.
void buildRagdollPyramids(Objects& o, Size n) {
  constexpr double kPitch = 1.8, kStorey = 1.9;
  addFloor(o, kPitch * n.x / 2 + 20, 1.5 * n.z + 20);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> lean(-0.15, 0.15);
  for (int z = 0; z < n.z; ++z) {
    for (int row = 0; row < n.x; ++row) {
      for (int i = 0; i < n.x - row; ++i) {
        const double yaw = lean(random), pitch = lean(random), roll = lean(random);
        const btVector3 at(s(kPitch * (i - 0.5 * (n.x - row - 1))), s(0.3 + kStorey * row),
                           s(3.0 * (z - 0.5 * (n.z - 1))));
        addRagdoll(o, at, btQuaternion(s(yaw), s(pitch), s(roll)), Limbs::Capsules);
      }
    }
  }
}

// ---- hulls

// A barrel: two rings of corners, and a wider one between them.
std::vector<btVector3> barrel(double radius, double halfHeight) {
  constexpr int kSides = 12;
  std::vector<btVector3> points = prism(kSides, 0.8 * radius, halfHeight);
  for (int k = 0; k < kSides; ++k) {
    const double angle = kTurn * k / kSides;
    points.emplace_back(s(radius * std::cos(angle)), btScalar(0), s(radius * std::sin(angle)));
  }
  return points;
}

// Barrels that fall upright would stand on each other.
btTransform turned(std::mt19937& random, double x, double y, double z) {
  return btTransform(randomRotation(random), btVector3(s(x), s(y), s(z)));
}

void buildFallingHulls(Objects& o, Size n) {
  addFloor(o, 3.0 * n.x + 2.0 * n.y, 3.0 * n.z + 2.0 * n.y);
  btConvexHullShape* hull = o.hull(barrel(1, 1.2));
  std::mt19937 random(10);
  fall(n, 3, 2, [&](double x, double y, double z) { o.add(2, hull, turned(random, x, y, z)); });
}

// ---- a mesh, and rays

void rainOn(Objects& o, Size n, const std::vector<btCollisionShape*>& shapes) {
  o.world().setGravity(kGravity);
  addMesh(o, rollingLandscape({n.x + n.y / 2, 1, n.z + n.y / 2}));
  size_t next = 0;
  std::mt19937 random(11);
  fall(n, 2, 3, [&](double x, double y, double z) {
    btRigidBody* body = o.add(1, shapes[next++ % shapes.size()], turned(random, x, y, z));
    body->setFriction(s(0.8));
    body->setRollingFriction(s(0.1));
    body->setSpinningFriction(s(0.1));
  });
}

void buildPrimitivesOnMesh(Objects& o, Size n) {
  rainOn(o, n, {o.box(btVector3(s(0.5), s(0.5), s(0.5))), o.sphere(s(0.5)), o.capsule(s(0.4), s(0.6))});
}

void buildHullsOnMesh(Objects& o, Size n) { rainOn(o, n, {o.hull(barrel(0.5, 0.6))}); }

// A ray for two bodies, in a fan that turns about the y axis; how far each got is in Objects::seen().
void castRays(Objects& o, Size n) {
  const int count = std::max(1, n.x * n.y * n.z / 2);
  const double reach = 2.0 * std::max(n.x, n.z) + 10;
  o.beforeSubsteps([&o, count, reach, time = 0.0](btScalar timeStep) mutable {
    constexpr double kRounds = 0.25;  // a second
    time += double(timeStep);
    o.seen().clear();
    for (int i = 0; i < count; ++i) {
      const double angle = kTurn * (kRounds * time + double(i) / count);
      const btVector3 from(0, s(12 + 3 * std::sin(time)), 0);
      const btVector3 to(s(reach * std::cos(angle)), s(i % 5 - 3), s(reach * std::sin(angle)));
      btCollisionWorld::ClosestRayResultCallback hit(from, to);
      o.world().rayTest(from, to, hit);
      o.seen().push_back(hit.m_closestHitFraction);
    }
  });
}

void buildRays(Objects& o, Size n) {
  buildHullsOnMesh(o, n);
  castRays(o, n);
}

// Squares in so many layers, or fewer where there are few bodies.
std::function<Size(int)> layersOf(int most) {
  return [most](int n) {
    const int layers = std::min(most, std::max(1, n / 16)), side = root(double(n) / layers, 2);
    return Size{side, layers, side};
  };
}

// Sets as high as in the benchmark, or one that is lower.
Size stacksFor(int bodies) {
  const auto ofSet = [](int height) {
    return height * (height + 1) * (2 * height + 1) / 6 + height * height + 16 * height;
  };
  constexpr int kHeight = 12;
  int height = 1;
  while (height < kHeight && ofSet(height + 1) <= bodies) ++height;
  const int sets = root(double(bodies) / ofSet(height), 2);
  return {sets, height, sets};
}

}  // namespace

std::vector<Scene> classicScenes() {
  // As of the scenes on a landscape in terrain.cpp: N = 64 bodies or more come to rest in other hollows than stock's,
  // and their mean height differs by 0.3 sqrt(2 / N) = 0.05 m between two right runs, of a mean of 0.4 m or more.
  constexpr double kHollows = 0.15;
  return {
      {"bench1",
       "X by Y by Z boxes falling (Bullet's benchmark 1: 3,000)",
       {4, 12, 4},
       300,
       kStep,
       {20, 0, Rest::AsStock},
       buildFallingBoxes,
       {{8, 47, 8}, 240, layersOf(47)}},
      {"bench2",
       "X by Z sets of a square pyramid, a wall and a round tower of boxes, Y high (benchmark 2: 1,000 stacked)",
       {1, 6, 1},
       200,
       kStep,
       {10, 0, Rest::AsStock},
       buildStacks,
       {{1, 12, 1}, 120, stacksFor}},
      {"bench3",
       "Z flat pyramids of ragdolls of capsules, X at the base (benchmark 3: 136)",
       {4, 1, 1},
       240,
       kStep,
       {10, 0, Rest::AsStock, 0.05, 0.01, {"joints"}},
       buildRagdollPyramids,
       {{16, 1, 1},
        120,
        [](int n) {
          return n < 1000 ? Size{4, 1, std::max(1, n / 110)} : Size{16, 1, std::max(1, n / 1496)};
        }}},
      {"bench4",
       "X by Y by Z convex hulls of 36 points falling (benchmark 4: 1,000)",
       {3, 8, 3},
       300,
       kStep,
       {20, 0, Rest::AsStock},
       buildFallingHulls,
       {{8, 16, 8}, 240, layersOf(16)}},
      {"bench5",
       "X by Y by Z boxes, spheres and capsules on a mesh (benchmark 5)",
       {5, 4, 5},
       400,
       kStep,
       {20, -1.2, Rest::AsStock, kHollows},
       buildPrimitivesOnMesh,
       {{10, 10, 10}, 240, layersOf(10)}},
      {"bench6",
       "X by Y by Z convex hulls on a mesh (benchmark 6)",
       {4, 4, 4},
       400,
       kStep,
       {20, -1.2, Rest::AsStock, kHollows},
       buildHullsOnMesh,
       {{10, 10, 10}, 240, layersOf(10)}},
      {"bench7",
       "benchmark 6, and in each step a ray for two bodies (benchmark 7: 500)",
       {4, 4, 4},
       120,
       kStep,
       {20, -1.2, Rest::No},
       buildRays,
       {{10, 10, 10}, 240, layersOf(10)}},
  };
}

}  // namespace scenes
