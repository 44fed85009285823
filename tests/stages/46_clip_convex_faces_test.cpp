// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/46_clip_convex_faces.h"

#include "gpu_engine/stages/44_find_closest_features.h"
#include "gpu_engine/stages/46_clip_convex_faces_reference.h"
#include "tests/support/convex_pairs.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"

namespace btgpu {
namespace {

class ClipConvexFacesTest : public DeviceTest {
 protected:
  // Stages 44 and 46 on the pairs; contacts by pair. What 44 found goes to `found`.
  std::vector<RawContacts> device(const PairWorld& p, ClosestPairs* found = nullptr, uint overflow = 0) {
    StageBench bench = benchForPairs(queue(), p, m_spare);
    bench.poison(bench.world().contacts);
    bench.run<FindClosestFeatures>();
    if (found) {
      found->closest = bench.read(bench.world().closest);
      found->near = bench.read(bench.world().nearPairs, bench.read(bench.world().nearCount, 1)[0]);
      m_before = bench.read(bench.world().contacts, p.pairs.size());
    }
    if (overflow) bench.poison(bench.world().contacts);
    bench.setOverflow(overflow);
    bench.run<ClipConvexFaces>();
    return bench.read(bench.world().contacts, p.pairs.size());
  }

  void expectAsReference(const PairWorld& p) {
    ClosestPairs found;
    const auto contacts = device(p, &found);
    Contract contract("46_clip_convex_faces");
    checkClippedConvexFaces(contract, arraysOf(p), found, m_before, contacts);
    EXPECT_TRUE(contract.ok()) << contract.text();
    m_touching = found.near.size();
    for (size_t i = 0; i < contacts.size(); ++i) {
      if (!StageBench::isPoison(contacts[i])) m_several += contacts[i].count > 1;
    }
  }

  std::vector<RawContacts> m_before;
  size_t m_spare = 0, m_touching = 0, m_several = 0;
};

TEST_F(ClipConvexFacesTest, RandomSmall) {
  std::mt19937 random(1);
  expectAsReference(randomConvexPairs(random, 18));
}

TEST_F(ClipConvexFacesTest, Random) {
  std::mt19937 random(2);
  m_spare = 3;
  expectAsReference(randomConvexPairs(random, 900));
  EXPECT_GT(m_touching, 300u);
  EXPECT_GT(m_several, 100u);
}

TEST_F(ClipConvexFacesTest, CurvedSmall) {
  std::mt19937 random(5);
  expectAsReference(randomCurvedPairs(random, 10));
}

TEST_F(ClipConvexFacesTest, Curved) {
  std::mt19937 random(6);
  expectAsReference(randomCurvedPairs(random, 1400));
  EXPECT_GT(m_touching, 300u);
  EXPECT_GT(m_several, 60u);
}

// What stands on a cap has four points, what lies along a line two.
TEST_F(ClipConvexFacesTest, CapsAndLinesSmall) {
  PairWorld p;
  const int drum = p.world.cylinder(1, 0.5f, 0.4f), hat = p.world.cone(1, 0.5f, 0.4f),
            box = p.world.box({2, 0.5f, 2, 0});
  const int cube = p.world.box({0.3f, 0.3f, 0.3f, 0});
  const float4 quarter = turnAbout({0, 0, 1, 0}, 1.5707963f);
  const size_t stands = p.add(drum, at(0, 0.935f, 0), box, at(0, 0, 0));
  const size_t lies = p.add(box, at(0, 0, 0), drum, at(0.1f, 1.035f, 0, quarter));
  const size_t onDrum = p.add(drum, at(0, 0.875f, 0), drum, at(0.2f, 0, 0));
  const size_t hatOnDrum = p.add(hat, at(0, 0.875f, 0), drum, at(0.2f, 0, 0));
  const size_t cubeOnDrum = p.add(drum, at(0, 0, 0), cube, at(0.05f, 0.735f, 0));
  const auto raw = device(p);
  expectAsReference(p);
  for (const size_t i : {stands, onDrum, hatOnDrum, cubeOnDrum}) {
    EXPECT_EQ(raw[i].count, 4) << i;
    for (int k = 0; k < raw[i].count; ++k) EXPECT_NEAR(raw[i].points[k].w, -0.005f, 5e-6f) << i;
  }
  EXPECT_EQ(raw[lies].count, 2);
}

// A face of 100 corners on another one, a box on it, a capsule along it.
TEST_F(ClipConvexFacesTest, FacesOnFacesSmall) {
  PairWorld p;
  const int drum = p.world.hull(prismPoints(100, 1, 0.5f)), disc = p.world.hull(prismPoints(64, 0.6f, 0.1f));
  const int box = p.world.box({0.3f, 0.3f, 0.3f, 0}), capsule = p.world.capsule(0, 0.2f, 0.4f);
  const size_t onDrum = p.add(drum, at(0, 0, 0), disc, at(0.2f, 0.675f, 0));
  const size_t boxOnDrum = p.add(drum, at(0, 0, 0), box, at(0.1f, 0.835f, 0.1f, turnAbout({0, 1, 0, 0}, 0.3f)));
  const size_t lying = p.add(drum, at(0, 0, 0), capsule, at(0, 0.735f, 0.1f));
  p.add(box, at(0, 0, 0), capsule, at(0.1f, 0.495f, 0));
  p.add(disc, at(0, 0, 0), drum, at(0.7f, 0.67f, 0.3f, turnAbout({1, 0, 0.3f, 0}, 0.01f)));
  const auto raw = device(p);
  expectAsReference(p);
  EXPECT_EQ(raw[onDrum].count, 4);
  EXPECT_EQ(raw[boxOnDrum].count, 4);
  EXPECT_EQ(raw[lying].count, 2);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(raw[onDrum].points[k].w, -0.005f, 2e-6f);
}

TEST_F(ClipConvexFacesTest, NothingAfterAnOverflowSmall) {
  std::mt19937 random(3);
  for (const RawContacts& raw : device(randomConvexPairs(random, 6), nullptr, OVERFLOW_PAIRS)) {
    EXPECT_TRUE(StageBench::isPoison(raw));
  }
}

}  // namespace
}  // namespace btgpu
