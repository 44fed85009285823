// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// 100,000 bodies: all ways of finding pairs against brute force on the device, which smaller tests hold against the
// reference.
#include <map>

#include "gpu_engine/pair_search.h"
#include "tests/support/aabb_world.h"

namespace btgpu {
namespace {

constexpr uint kBodies = 100000;

class PairFindersLongTest : public ::testing::Test {
 protected:
  std::vector<ulong> find(const AabbWorld& w, PairFinder finder) {
    auto& search = m_searches[finder];
    if (!search) search = std::make_unique<DevicePairSearch>("", finder);
    search->setBodies(w.world.finish().infos.values, w.aabbs);
    search->find();
    std::vector<ulong> keys;
    search->readKeys(keys);
    return keys;
  }
  void expectAllAlike(const AabbWorld& w) {
    const std::vector<ulong> expected = find(w, PairFinder::BruteForce);
    EXPECT_GT(expected.size(), size_t{w.count()} / 10);
    for (const PairFinder finder :
         {PairFinder::Bvh, PairFinder::Grid, PairFinder::Sweep, PairFinder::IncrementalSweep}) {
      EXPECT_TRUE(find(w, finder) == expected) << PairFinders::stageOf(finder);
    }
  }

  std::map<PairFinder, std::unique_ptr<DevicePairSearch>> m_searches;
};

TEST_F(PairFindersLongTest, AHundredThousand) {
  std::mt19937 random(41);
  AabbWorld w = randomAabbs(random, kBodies);
  w.addPlane();
  for (int step = 0; step < 3; ++step) {
    SCOPED_TRACE(step);
    expectAllAlike(w);
    for (uint i = 0; i < kBodies; ++i) {
      const float4 by = uniform3(random, -0.2f, 0.2f);
      w.aabbs[i] = {w.aabbs[i].lower + by, w.aabbs[i].upper + by};
      if (random() % 100 == 0) w.aabbs[i] = w.aabbs[random() % kBodies];
    }
  }
}

TEST_F(PairFindersLongTest, HugeAndTinyMixed) {
  std::mt19937 random(42);
  AabbWorld w;
  for (uint i = 0; i < kBodies; ++i) {
    w.add(uniform3(random, -300, 300), AabbWorld::cube(std::pow(10.0f, uniform(random, -3, 1.2f))));
  }
  expectAllAlike(w);
}

TEST_F(PairFindersLongTest, AllOnOneAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    AabbWorld w;
    for (uint i = 0; i < kBodies; ++i) {
      float4 centre{};
      (&centre.x)[axis] = static_cast<float>(uint64_t{i} * 7919 % kBodies);
      w.add(centre, AabbWorld::cube(1.25f));
    }
    expectAllAlike(w);
  }
}

// All in a few cells of a scene that two bodies make wide.
TEST_F(PairFindersLongTest, AllInOneCell) {
  std::mt19937 random(43);
  AabbWorld w;
  for (uint i = 0; i < kBodies / 5; ++i) w.add(uniform3(random, -1, 1), uniform3(random, 0, 0.05f));
  w.add(AabbWorld::cube(1e5f), AabbWorld::cube(1));
  w.add(AabbWorld::cube(-1e5f), AabbWorld::cube(1));
  expectAllAlike(w);
}

}  // namespace
}  // namespace btgpu
