// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Piles for benchmarks: those of Box3D's, rebuilt from their description, and one whose pairs change in every step.
#include <algorithm>
#include <cmath>

#include "parts.h"

namespace scenes {
namespace {

// So many points, all of them corners, spread evenly over an ellipsoid but for some jitter.
std::vector<btVector3> evenHull(std::mt19937& random, int count, const btVector3& half) {
  constexpr double kGoldenAngle = 2.399963229728653;
  std::uniform_real_distribution<double> jitter(-0.25, 0.25);
  std::vector<btVector3> points;
  btVector3 mean(0, 0, 0);
  for (int k = 0; k < count; ++k) {
    const double y = 1 - 2 * (k + 0.5 + jitter(random)) / count;
    const double angle = kGoldenAngle * k + jitter(random), r = std::sqrt(1 - y * y);
    points.push_back(btVector3(s(r * std::cos(angle)), s(y), s(r * std::sin(angle))) * half);
    mean += points.back() / s(count);
  }
  for (btVector3& p : points) p -= mean;
  return points;
}

std::vector<btCollisionShape*> hullsOf(Objects& o, std::mt19937& random) {
  std::uniform_real_distribution<double> size(0.4, 0.5);
  std::vector<btCollisionShape*> hulls;
  for (int i = 0; i < kShapes; ++i) {
    const double a = size(random), b = size(random), c = size(random);
    hulls.push_back(o.hull(evenHull(random, 32, btVector3(s(a), s(b), s(c)))));
  }
  return hulls;
}

std::vector<btCollisionShape*> rocksOf(Objects& o, std::mt19937& random) {
  std::vector<btCollisionShape*> rocks;
  for (int i = 0; i < kShapes; ++i) rocks.push_back(rock(o, random));
  return rocks;
}

std::vector<btCollisionShape*> assortment(Objects& o, std::mt19937& random) {
  std::uniform_real_distribution<double> size(0.25, 0.4);
  std::vector<btCollisionShape*> shapes;
  for (int i = 0; i < kShapes; ++i) {
    const double a = size(random), b = size(random), c = size(random);
    if (i % 3 == 0) shapes.push_back(o.sphere(s(a)));
    if (i % 3 == 1) shapes.push_back(o.box(btVector3(s(a), s(b), s(c))));
    if (i % 3 == 2) shapes.push_back(o.hull(randomHull(random, 12, btVector3(s(a), s(b), s(c)))));
  }
  return shapes;
}

void buildConvexPile(Objects& o, Size n) {
  constexpr double kPitch = 1.3;
  addFloor(o, kPitch * n.x + n.y + 20, kPitch * n.z + n.y + 20);
  std::mt19937 random(3);
  const auto hulls = hullsOf(o, random);
  pile(o, n, kPitch, 0.1, hulls, random);
}

void buildRocks(Objects& o, Size n) {
  constexpr double kPitch = 1.5;
  const double halfX = 0.55 * kPitch * n.x + 0.5, halfZ = 0.55 * kPitch * n.z + 0.5;
  addFloor(o, halfX + 20, halfZ + 20);
  addWalls(o, halfX, halfZ, kPitch * n.y);
  std::mt19937 random(4);
  const auto rocks = rocksOf(o, random);
  pile(o, n, kPitch, 0.5, rocks, random);
}

struct Funnel {
  double top, outlet;  // half widths
  double height;       // of the outlet above the ground
  double rim() const { return height + (top - outlet); }
};

// Four slabs that slope by 45 degrees towards the outlet.
void addFunnel(Objects& o, const Funnel& f) {
  constexpr double kHalfThickness = 1, kSlope = 0.7853981633974483;
  const double run = f.top - f.outlet, middle = (f.top + f.outlet) / 2;
  const double down = kHalfThickness * std::sqrt(0.5);  // from the middle of a slab's upper face to its centre
  btBoxShape* slab = o.box(btVector3(s(run * std::sqrt(0.5)), s(kHalfThickness), s(f.top)));
  for (int i = 0; i < 4; ++i) {
    const btTransform around(btQuaternion(btVector3(0, 1, 0), s(2 * kSlope * i)), btVector3(0, 0, 0));
    const btTransform tilted(btQuaternion(btVector3(0, 0, 1), s(kSlope)),
                             btVector3(s(middle + down), s(f.height + run / 2 - down), 0));
    o.add(0, slab, around * tilted);
  }
}

void buildPour(Objects& o, Size n) {
  constexpr double kPitch = 1.6;
  const double half = 0.5 * kPitch * std::max(n.x, n.z);
  const Funnel funnel{half + 2, std::max(2.5, 0.3 * half), 4 + 0.5 * half};
  addFloor(o, 4 * half + 30, 4 * half + 30);
  addFunnel(o, funnel);
  std::mt19937 random(5);
  const auto shapes = assortment(o, random);
  // The lowest layer begins where the funnel is wide enough for it.
  pile(o, n, kPitch, funnel.rim() - 1, shapes, random);
}

}  // namespace

std::vector<Scene> bigPileScenes() {
  return {
      // Of 86 pairs of hulls with other depths, in 19,000, btgpu's was the exact one in 85 (Frank and Wolfe's method in
      // double precision): Bullet's GJK ends beside the closest features, and smooth hulls have many.
      {"convex_pile",
       "X by Y by Z convex hulls of 32 vertices dropped on the ground",
       {4, 4, 4},
       300,
       kStep,
       {10, 0, Rest::Yes, 0.05, 0.01},
       buildConvexPile,
       {{16, 20, 16}, 120, cube}},
      // As in convex_pile: 0.3 % of the pairs.
      {"rocks",
       "X by Y by Z irregular hulls poured in a box",
       {4, 4, 4},
       300,
       kStep,
       {10, 0, Rest::Yes, 0.05, 0.01},
       buildRocks,
       {{21, 24, 21}, 120, cube}},
      // All bodies tumble on the floor: boxes lose the deepest point as in ragdoll, of 216 bodies in 200 steps 2 % of
      // the
      // pairs. There the lowest corner tells the exact depth; of 229 boxes with other depths btgpu had it in 115 and
      // stock in 101, of 309 hulls btgpu in 272 and stock in 25.
      {"pour",
       "X by Y by Z spheres, boxes and hulls poured through a funnel",
       {6, 6, 6},
       200,
       kStep,
       {10, 0, Rest::No, 0.05, 0.03},
       buildPour,
       {{50, 40, 50}, 240, cube}},
  };
}

}  // namespace scenes
