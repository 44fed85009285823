// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs for the stages that collide hulls, and what the reference says of each.
#pragma once

#include "gpu_engine/stages/44_find_closest_features_reference.h"
#include "tests/support/pair_world.h"
#include "tests/support/prism.h"

namespace btgpu {

inline std::vector<float4> pointsOnEllipsoid(std::mt19937& random, size_t count, float4 half) {
  std::vector<float4> points;
  while (points.size() < count) {
    const float4 p = uniform3(random, -1, 1);
    const float size = sizeOf(p);
    if (size > 0.1f && size < 1) points.push_back(p * half / size);
  }
  return points;
}

struct PairReference {
  Polytope a, b;  // world axes, from A's position
  reference::Matrix rotationA;
  ClosestCores closest;
  double size, limit;  // extent of the pair; separation of the cores within which it counts as near
};

inline PairReference referenceOf(const PairWorld& p, const WorldInput& in, size_t i) {
  const Pair& pair = p.pairs[i];
  const Shape &a = p.shapeOf(pair.bodyA), &b = p.shapeOf(pair.bodyB);
  PairReference r;
  r.rotationA = reference::rotationOf(p.world.pose(pair.bodyA).orientation);
  r.a = placed(polytopeOf(a, in.hulls), r.rotationA, {});
  r.b = placed(polytopeOf(b, in.hulls), reference::rotationOf(p.world.pose(pair.bodyB).orientation),
               reference::toVec(p.bFromA(pair)));
  r.closest = closestCoresReference(r.a, r.b);
  r.size = sizeOf(a.extents) + sizeOf(b.extents) + sizeOf(a.centre) + sizeOf(b.centre);
  const float threshold = pair.oldManifold != NO_INDEX ? p.oldManifolds[pair.oldManifold].breakingThreshold
                                                       : std::fmin(a.breakingThreshold, b.breakingThreshold);
  r.limit = double(a.margin) + b.margin + threshold;
  return r;
}

// Pairs of the convex buckets in the order in which stage 35 lists them.
inline std::vector<size_t> convexOrder(const PairWorld& p) {
  std::vector<size_t> order;
  for (uint bucket = BUCKET_FIRST_CONVEX; bucket <= BUCKET_LAST_CONVEX; ++bucket) {
    for (size_t i = 0; i < p.pairs.size(); ++i) {
      if (p.pairs[i].bucket == bucket) order.push_back(i);
    }
  }
  return order;
}

// Every convex bucket in turn, and now and then two boxes, which are another stage's; from deep in each other to
// apart by a few thresholds.
inline PairWorld randomConvexPairs(std::mt19937& random, size_t count) {
  PairWorld p;
  const auto shape = [&](int type) {
    const float4 half = uniform3(random, 0.3f, 0.8f);
    if (type == SHAPE_SPHERE) return p.world.sphere(half.x);
    if (type == SHAPE_BOX) return p.world.box(half);
    if (type == SHAPE_CAPSULE) return p.world.capsule(static_cast<int>(random() % 3), half.x / 2, half.y);
    if (random() % 3 == 0) return p.world.hull(prismPoints(3 + static_cast<int>(random() % 8), half.x, half.y));
    return p.world.hull(pointsOnEllipsoid(random, 5 + random() % 12, half));
  };
  const int types[][2] = {{SHAPE_HULL, SHAPE_HULL},    {SHAPE_SPHERE, SHAPE_HULL}, {SHAPE_BOX, SHAPE_HULL},
                          {SHAPE_CAPSULE, SHAPE_HULL}, {SHAPE_CAPSULE, SHAPE_BOX}, {SHAPE_BOX, SHAPE_BOX}};
  while (p.pairs.size() < count) {
    const auto& kind = types[p.pairs.size() % 6];
    const bool swapped = random() % 2;
    const int a = shape(kind[swapped]), b = shape(kind[1 - swapped]);
    const float4 away = uniform3(random, -1, 1);
    const float4 at = {100, -50, 20, 0};
    p.add(a, {at, randomTurn(random)}, b,
          {at + away * (uniform(random, 0.6f, 1.5f) / sizeOf(away)), randomTurn(random)});
  }
  return p;
}

// Cylinders, cones, spheres of several sizes and sums of these, of any and of none, against every shape; likewise.
// `plane`: on planes.
inline PairWorld randomCurvedPairs(std::mt19937& random, size_t count, bool plane = false) {
  PairWorld p;
  const auto curved = [&](size_t kind) {
    const float4 half = uniform3(random, 0.2f, 0.7f);
    const int axis = static_cast<int>(random() % 3);
    if (kind % 4 == 0) return p.world.cylinder(axis, half.x, half.y);
    if (kind % 4 == 1) return p.world.cone(axis, half.x, random() % 4 ? half.y : -half.y);
    std::vector<float4> spheres;
    for (size_t k = 0; k < 1 + random() % 4; ++k) {
      spheres.push_back(uniform3(random, -0.4f, 0.4f));
      spheres.back().w = uniform(random, 0, 0.3f);
    }
    if (kind % 4 == 3) {
      const int round = random() % 2 ? SHAPE_CYLINDER : SHAPE_CONE;
      return p.world.sum(spheres, round, randomTurn(random), axis, half.x / 2, half.y / 2, 0.1f);
    }
    return p.world.spheres(spheres, 0.1f, random() % 3 ? float4{1, 1, 1, 0} : float4{1.2f, 0.8f, 1, 0});
  };
  const auto other = [&](size_t kind) {
    const float4 half = uniform3(random, 0.3f, 0.8f);
    switch (kind % 5) {
      case 0:
        return p.world.sphere(half.x);
      case 1:
        return p.world.box(half);
      case 2:
        return p.world.capsule(static_cast<int>(random() % 3), half.x / 2, half.y);
      case 3:
        return p.world.hull(pointsOnEllipsoid(random, 5 + random() % 12, half));
      default:
        return curved(random());
    }
  };
  while (p.pairs.size() < count) {
    const size_t n = p.pairs.size();
    const bool swapped = !plane && random() % 2, square = random() % 3 == 0;
    const int a = curved(n), b = plane ? p.world.plane({0, 1, 0, 0}, 0) : other(n / 3);
    const float4 away = square ? float4{0, 1, 0, 0} : uniform3(random, -1, 1);
    const float4 at = {100, -50, 20, 0};
    // A third of them upright, flat on what is below.
    const float4 turn = square ? kNoTurn : randomTurn(random), turnB = square ? kNoTurn : randomTurn(random);
    const float4 there = at + away * (uniform(random, 0.2f, 1.4f) / sizeOf(away));
    if (plane) {
      p.add(a, {at + float4{0, uniform(random, -0.5f, 0.9f), 0, 0}, turn}, b, {at, kNoTurn});
    } else {
      p.add(swapped ? b : a, {at, turn}, swapped ? a : b, {there, turnB});
    }
  }
  return p;
}

}  // namespace btgpu
