// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/47_collide_triangles.h"

#include "gpu_engine/stages/47_collide_triangles_reference.h"
#include "tests/support/device_test.h"
#include "tests/support/mesh_pairs.h"

namespace btgpu {
namespace {

class CollideTrianglesTest : public DeviceTest {
 protected:
  struct Result {
    TriangleInput in;
    TriangleHits hits;
    std::vector<TriangleContacts> touches;
    std::vector<RawContacts> before, contacts;
  };
  Result device(const PairWorld& p) {
    StageBench bench = benchForTriangles(queue(), p, 100000);
    bench.run<CullTriangles>();
    bench.poison(bench.world().contacts);
    bench.poison(bench.world().triangleTouches);
    bench.run<CollideTriangles>(~0u);
    Result r{triangleInputOf(p), hitsOf(bench, p), {}, {}, {}};
    r.touches = bench.read(bench.world().triangleTouches, r.hits.hits.size());
    r.contacts = bench.read(bench.world().contacts, p.pairs.size());
    r.before.resize(p.pairs.size());
    std::memset(static_cast<void*>(r.before.data()), StageBench::kPoison, r.before.size() * sizeof(RawContacts));
    return r;
  }
  static std::string wrong(const Result& r) {
    Contract contract("47_collide_triangles");
    checkTriangleContacts(contract, r.in, r.hits, r.touches);
    checkPickedTouches(contract, r.in, r.hits, r.touches, r.before, r.contacts);
    return contract.text();
  }
};

TEST_F(CollideTrianglesTest, FewSmall) {
  std::mt19937 random(1);
  EXPECT_EQ(wrong(device(randomMeshPairs(random, 8, 24))), "");
}

TEST_F(CollideTrianglesTest, RandomOfAllCounts) {
  std::mt19937 random(2);
  for (const size_t pairs : {0u, 1u, 33u, 129u, 400u}) {
    SCOPED_TRACE(pairs);
    const Result r = device(randomMeshPairs(random, pairs, 60, pairs % 2 ? 0.04f : 0.0f));
    EXPECT_EQ(wrong(r), "");
    if (pairs < 400) continue;
    int touching = 0, full = 0;
    for (const RawContacts& raw : r.contacts) {
      touching += raw.count > 0;
      full += raw.count == MANIFOLD_POINTS;
    }
    EXPECT_GT(touching, 100);
    EXPECT_GT(full, 10);
  }
}

// What lies flat on triangles has all corners of the common region.
TEST_F(CollideTrianglesTest, FaceOnFaceSmall) {
  PairWorld p;
  const int floor =
      p.world.mesh({{-2, 0, -2, 0}, {-2, 0, 2, 0}, {2, 0, -2, 0}, {2, 0, -2, 0}, {-2, 0, 2, 0}, {2, 0, 2, 0}});
  p.add(p.world.box({0.5f, 0.5f, 0.5f, 0}), at(0, 0.49f, 0), floor, at(0, 0, 0));
  p.add(p.world.capsule(0, 0.3f, 0.6f), at(0.2f, 0.29f, -1), floor, at(0, 0, 0));
  const Result r = device(p);
  EXPECT_EQ(wrong(r), "");
  ASSERT_EQ(r.contacts[0].count, 4);
  EXPECT_EQ(r.contacts[1].count, 2);
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(std::fabs(r.contacts[0].points[k].x), 0.5f, 0.041f);
    EXPECT_NEAR(std::fabs(r.contacts[0].points[k].z), 0.5f, 0.041f);
    EXPECT_NEAR(r.contacts[0].points[k].w, -0.01f, 1e-5f);
    EXPECT_NEAR(r.contacts[0].points[MANIFOLD_POINTS + k].y, 1, 1e-6f);
  }
}

TEST_F(CollideTrianglesTest, TheContractFindsHarm) {
  std::mt19937 random(3);
  const Result right = device(randomMeshPairs(random, 40, 60));
  ASSERT_EQ(wrong(right), "");
  size_t hit = 0, pair = 0;
  while (right.touches[hit].normal.w == 0.0f) ++hit;
  while (right.contacts[pair].count < 2) ++pair;
  Result r = right;
  r.touches[hit].normal.x = -r.touches[hit].normal.x + 0.1f;
  EXPECT_NE(wrong(r), "");
  r = right;
  r.touches[hit].points[0].w -= 0.01f;
  EXPECT_NE(wrong(r), "");
  r = right;
  r.touches[hit].normal.w = 0;
  EXPECT_NE(wrong(r), "");
  r = right;
  r.contacts[pair].count -= 1;
  EXPECT_NE(wrong(r), "") << "the deepest left out";
  r = right;
  r.contacts[pair].points[MANIFOLD_POINTS].w += 1;
  EXPECT_NE(wrong(r), "") << "another triangle";
}

}  // namespace
}  // namespace btgpu
