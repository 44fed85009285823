// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the tests of stage 48 share.
#pragma once

#include <algorithm>

#include "gpu_engine/stages/48_reduce_and_match_contacts.h"
#include "gpu_engine/stages/48_reduce_and_match_contacts_reference.h"
#include "tests/support/device_test.h"
#include "tests/support/pair_world.h"
#include "tests/support/stage_bench.h"

namespace btgpu {

struct Stage48Input {
  PairWorld world;
  std::vector<RawContacts> contacts;  // one a pair
  bool unseen = false;                // the host was not sent the old manifolds
};

inline RawContacts candidates(float4 normal, std::vector<float4> points) {
  RawContacts raw{};
  raw.normal = normal;
  raw.count = static_cast<int>(points.size());
  std::copy(points.begin(), points.end(), raw.points);
  return raw;
}

// A box on a box, both without rotation, B half a unit below A; points are given on B, from A's centre.
inline Stage48Input boxOnBox() {
  Stage48Input in;
  const int upper = in.world.world.box({1, 0.25f, 1, 0}), lower = in.world.world.box({1, 0.25f, 1, 0});
  in.world.add(upper, at(0, 0, 0), lower, at(0, -0.5f, 0));
  in.contacts.push_back(candidates({0, 1, 0, 0}, {}));
  return in;
}
const float4 kUp = {0, 1, 0, 0};
inline float4 below(float x, float z, float distance) { return {x, -0.25f - distance, z, distance}; }

// Candidates around a circle of random depths: no two choices are equally good.
inline RawContacts randomCandidates(std::mt19937& random, int count, float radius) {
  const float4 v = uniform3(random, -1, 1), n = v / sizeOf(v);
  const float4 other = std::fabs(n.x) < 0.5f ? float4{1, 0, 0, 0} : kUp;
  float4 u = {n.y * other.z - n.z * other.y, n.z * other.x - n.x * other.z, n.x * other.y - n.y * other.x, 0};
  u = u / sizeOf(u);
  const float4 w = {n.y * u.z - n.z * u.y, n.z * u.x - n.x * u.z, n.x * u.y - n.y * u.x, 0};
  std::vector<float4> points;
  for (int k = 0; k < count; ++k) {
    const float a = 6.2831853f * (static_cast<float>(k) + uniform(random, 0, 0.8f)) / static_cast<float>(count);
    const float r = radius * uniform(random, 0.5f, 1), d = uniform(random, -0.1f, 0.018f);
    float4 p = u * (r * std::cos(a)) + w * (r * std::sin(a)) - n * d;
    p.w = d;
    points.push_back(p);
  }
  return candidates(n, points);
}

// Pairs of all buckets with random manifolds of the last step, or none, and random candidates near its
// points.
inline Stage48Input randomInput(std::mt19937& random, size_t count) {
  Stage48Input in;
  WorldBuilder& b = in.world.world;
  for (size_t i = 0; i < count; ++i) {
    in.world.add(b.box({1, 1, 1, 0}), {uniform3(random, -1, 1), randomTurn(random)}, b.box({1, 1, 1, 0}),
                 {uniform3(random, -1, 1), randomTurn(random)});
    in.contacts.push_back(randomCandidates(random, static_cast<int>(random() % 9), 1));
    in.world.pairs.back().bucket = BUCKET_BOX_BOX;
  }
  return in;
}

class MatchContactsTest : public DeviceTest {
 protected:
  std::vector<Manifold> device(const Stage48Input& in, uint overflow = 0, size_t spare = 5) {
    const size_t n = in.world.pairs.size();
    StageBench bench = benchForPairs(queue(), in.world, spare);
    DeviceWorld& w = bench.world();
    bench.write(w.contacts, in.contacts);
    bench.poison(w.manifolds);
    bench.setOverflow(overflow);
    StepParams params = bench.params();
    if (in.unseen) params.flags |= STEP_CONTACTS_UNSEEN;
    bench.setParams(params);
    bench.run<ReduceAndMatchContacts>();
    auto manifolds = bench.read(w.manifolds);
    for (size_t i = overflow ? 0 : n; i < manifolds.size(); ++i) EXPECT_TRUE(StageBench::isPoison(manifolds[i])) << i;
    // A step may be repeated, so the last one's manifolds must be untouched.
    const auto old = bench.read(w.oldManifolds, in.world.oldManifolds.size());
    EXPECT_TRUE(old.empty() ||
                std::memcmp(old.data(), in.world.oldManifolds.data(), old.size() * sizeof(Manifold)) == 0);
    manifolds.resize(n);
    return manifolds;
  }

  std::vector<Manifold> expectAsReference(const Stage48Input& in, size_t spare = 5) {
    const auto actual = device(in, 0, spare);
    const MatchInput match{arraysOf(in.world), in.contacts, in.world.world.finish().materials.values, in.unseen};
    Contract contract("48_reduce_and_match_contacts");
    checkMatchedContacts(contract, match, actual);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return actual;
  }

  // Makes the result of a step the old manifolds of the next one, with impulses as if a solver had run.
  static void nextStep(Stage48Input& in, std::vector<Manifold> manifolds) {
    float impulse = 1;
    for (uint i = 0; i < manifolds.size(); ++i) {
      in.world.pairs[i].oldManifold = i;
      for (int k = 0; k < manifolds[i].pointCount; ++k) {
        ContactPoint& p = manifolds[i].points[k];
        p.localPointB.w = impulse;
        p.normalWorldOnB.w = 0.25f * impulse;
        p.lateralFrictionDir1.w = -0.125f * impulse;
        impulse += 1;
      }
    }
    in.world.oldManifolds = std::move(manifolds);
  }
};

}  // namespace btgpu
