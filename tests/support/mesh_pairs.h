// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of convex shapes and meshes for the stages that collide these.
#pragma once

#include "gpu_engine/stages/40_cull_triangles.h"
#include "gpu_engine/stages/40_cull_triangles_reference.h"
#include "tests/support/convex_pairs.h"

namespace btgpu {

// Triangles of all sizes within a few units of the origin; every eighth has no area.
inline std::vector<float4> triangleSoup(std::mt19937& random, size_t triangles) {
  std::vector<float4> corners;
  for (size_t i = 0; i < triangles; ++i) {
    const float4 at = uniform3(random, -2, 2);
    const float size = uniform(random, 0.1f, 1.5f);
    const float4 a = at + uniform3(random, -size, size), b = at + uniform3(random, -size, size);
    const float4 flat[] = {a, (a + b) * 0.5f};
    corners.insert(corners.end(), {a, b, i % 8 == 7 ? flat[i / 8 % 2] : at + uniform3(random, -size, size)});
  }
  return corners;
}

// `count` bodies of every convex kind around and in meshes of so many triangles.
inline PairWorld randomMeshPairs(std::mt19937& random, size_t count, size_t triangles, float margin = 0) {
  PairWorld p;
  const int meshes[] = {p.world.mesh(triangleSoup(random, triangles), margin), p.world.mesh(triangleSoup(random, 3))};
  for (size_t i = 0; i < count; ++i) {
    const float4 half = uniform3(random, 0.2f, 0.7f), at = {30, -20, 10, 0};
    int shape = p.world.sphere(half.x);
    if (i % 4 == 1) shape = p.world.box(half);
    if (i % 4 == 2) shape = p.world.capsule(static_cast<int>(random() % 3), half.x / 2, half.y);
    if (i % 4 == 3) shape = p.world.hull(pointsOnEllipsoid(random, 5 + random() % 12, half));
    p.add(shape, {at + uniform3(random, -2.5f, 2.5f), randomTurn(random)}, meshes[i % 5 == 4],
          {at, randomTurn(random)});
    if (i % 3 == 0) p.addOldManifold(uniform(random, 0.005f, 0.05f));
  }
  return p;
}

inline TriangleInput triangleInputOf(const PairWorld& p) { return {arraysOf(p), p.world.meshes()}; }

inline StageBench benchForTriangles(Queue& queue, const PairWorld& p, size_t room) {
  Capacities wanted;
  wanted.pairs = std::max<size_t>(1, p.pairs.size());
  wanted.triangleHits = room;
  StageBench bench(queue, p.world.finish(), {}, wanted);
  bench.setPairs(p.pairs);
  bench.setOldManifolds(p.oldManifolds);
  return bench;
}

// What stage 40 left.
inline TriangleHits hitsOf(StageBench& bench, const PairWorld& p) {
  DeviceWorld& w = bench.world();
  TriangleHits hits{w.triangleGroups, {}, {}, {}};
  hits.found = bench.read(w.triangleFound, p.pairs.size() * hits.groups);
  hits.first = bench.read(w.triangleFirst, p.pairs.size() * hits.groups);
  hits.hits = bench.read(w.triangleHits, bench.counters().triangleHits);
  return hits;
}

}  // namespace btgpu
