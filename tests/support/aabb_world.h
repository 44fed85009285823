// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bodies with the AABBs that stage 20 would have found, for tests of stage 30.
#pragma once

#include <cmath>
#include <limits>

#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {

struct AabbWorld {
  WorldBuilder world;
  int shape = world.sphere(1);
  std::vector<Aabb> aabbs;

  uint add(float4 centre, float4 halfExtents, float mass = 1) {
    aabbs.push_back({centre - halfExtents, centre + halfExtents});
    return world.add(shape, {0, 0, 0, 0}, mass);
  }
  uint addPlane() { return add({}, cube(1e18f), 0); }
  uint addFree() {
    aabbs.push_back(noAabb());
    return world.addFree();
  }
  void remove(uint body) {
    world.info(body) = {};
    aabbs[body] = noAabb();
  }
  const BodyInfo& info(uint body) const { return world.info(body); }
  uint count() const { return world.bodyCount(); }

  static float4 cube(float halfExtent) { return {halfExtent, halfExtent, halfExtent, 0}; }
  static Aabb noAabb() {
    const float inf = std::numeric_limits<float>::infinity();
    return {{inf, inf, inf, 0}, {-inf, -inf, -inf, 0}};
  }
};

// Sizes and positions that give each body a handful of partners, whatever the count.
inline AabbWorld randomAabbs(std::mt19937& random, uint count, float staticShare = 0.2f) {
  AabbWorld w;
  const float extent = 0.8f * std::cbrt(static_cast<float>(count));
  for (uint i = 0; i < count; ++i) {
    const float mass = uniform(random, 0, 1) < staticShare ? 0.0f : 1.0f;
    const float4 centre = uniform3(random, -extent, extent);
    w.add(centre, uniform3(random, 0.2f, 0.9f), mass);
  }
  return w;
}

struct FoundPairs {
  std::vector<ulong> keys;
  StepCounters counters;
};

// The pairs that a finder (`enqueue`, of queue and world) finds with room for `capacity` of them; fails if anything
// behind that room is written.
template <typename Enqueue>
FoundPairs findPairs(Queue& queue, const AabbWorld& w, size_t capacity, const Enqueue& enqueue,
                     uint overflowBefore = 0) {
  constexpr size_t kSpare = 64;
  Capacities room;
  room.pairs = capacity;
  StageBench bench(queue, w.world.finish(), {}, room);
  DeviceWorld& world = bench.world();
  bench.write(world.aabbs, w.aabbs);
  world.keys.resize(queue, capacity + kSpare);
  bench.poison(world.keys);
  bench.poison(world.pairCount);
  if (overflowBefore) bench.setOverflow(overflowBefore);
  enqueue(queue, world);
  queue.finish();
  FoundPairs found{bench.read(world.keys, capacity + kSpare), bench.counters()};
  EXPECT_EQ(bench.read(world.pairCount, 1).front(), found.counters.pairCount);
  for (size_t k = capacity; k < capacity + kSpare; ++k) EXPECT_TRUE(StageBench::isPoison(found.keys[k])) << k;
  found.keys.resize(std::min<size_t>(capacity, found.counters.pairCount));
  return found;
}

}  // namespace btgpu
