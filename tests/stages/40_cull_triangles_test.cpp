// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/40_cull_triangles.h"

#include "tests/support/device_test.h"
#include "tests/support/mesh_pairs.h"
#include "translation/mesh_tree.h"

namespace btgpu {
namespace {

class CullTrianglesTest : public DeviceTest {
 protected:
  // Returns how many there are.
  size_t expectAsReference(const PairWorld& p) {
    StageBench bench = benchForTriangles(queue(), p, 400000);
    bench.run<CullTriangles>();
    EXPECT_EQ(bench.counters().overflow, 0u);
    const TriangleHits hits = hitsOf(bench, p);
    Contract contract("40_cull_triangles");
    checkTriangleHits(contract, triangleInputOf(p), hits, bench.counters().triangleHits);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return hits.hits.size();
  }
};

TEST_F(CullTrianglesTest, FewSmall) {
  std::mt19937 random(1);
  EXPECT_GT(expectAsReference(randomMeshPairs(random, 6, 40)), 10u);
}

TEST_F(CullTrianglesTest, AllCounts) {
  std::mt19937 random(2);
  for (const size_t triangles : {0u, 1u, 2u, 300u, 5000u}) {
    for (const size_t pairs : {0u, 1u, 33u, 300u}) {
      SCOPED_TRACE(std::to_string(triangles) + " triangles, " + std::to_string(pairs) + " pairs");
      const size_t found = expectAsReference(randomMeshPairs(random, pairs, triangles, 0.05f));
      if (triangles == 5000 && pairs == 300) {
        EXPECT_GT(found, 10000u);
        EXPECT_LT(found, triangles * pairs / 4);
      }
    }
  }
}

// One body that touches everything: many more than a search keeps, over all parts.
TEST_F(CullTrianglesTest, AllOfAMesh) {
  std::mt19937 random(3);
  PairWorld p;
  const int mesh = p.world.mesh(triangleSoup(random, 20000));
  p.add(p.world.sphere(10), at(0, 0, 0), mesh, at(0.5f, 0, 0));
  p.add(p.world.sphere(0.1f), at(1, 0, 0), mesh, at(0.5f, 0, 0));
  EXPECT_GE(expectAsReference(p), 20000u);
}

TEST_F(CullTrianglesTest, RoomExactlyAndOneLessSmall) {
  std::mt19937 random(4);
  const PairWorld p = randomMeshPairs(random, 5, 30);
  const auto all = static_cast<uint>(cullTrianglesReference(triangleInputOf(p)).hits.size());
  for (const uint less : {0u, 1u}) {
    StageBench bench = benchForTriangles(queue(), p, all - less);
    bench.poison(bench.world().triangleHits);
    bench.run<CullTriangles>();
    EXPECT_EQ(bench.counters().triangleHits, all);
    EXPECT_EQ(bench.counters().overflow, less ? OVERFLOW_TRIANGLES : 0u);
    if (less) { EXPECT_TRUE(StageBench::isPoison(bench.read(bench.world().triangleHits, 1)[0])); }
  }
}

TEST_F(CullTrianglesTest, NothingAfterAnOverflowSmall) {
  std::mt19937 random(5);
  const PairWorld p = randomMeshPairs(random, 4, 30);
  StageBench bench = benchForTriangles(queue(), p, 1000);
  bench.setOverflow(OVERFLOW_PAIRS);
  bench.run<CullTriangles>();
  EXPECT_EQ(bench.counters().triangleHits, 0u);
  EXPECT_EQ(bench.counters().overflow, OVERFLOW_PAIRS);
}

// A triangle left out, one too many, two in the wrong order: each is found.
TEST_F(CullTrianglesTest, TheContractFindsHarm) {
  std::mt19937 random(6);
  const PairWorld p = randomMeshPairs(random, 8, 60);
  const TriangleInput in = triangleInputOf(p);
  const TriangleHits right = cullTrianglesReference(in);
  size_t rich = 0;
  while (rich < right.found.size() && right.found[rich] < 2) ++rich;
  ASSERT_LT(rich, right.found.size());
  const auto holds = [&](const TriangleHits& hits) {
    Contract contract("40_cull_triangles");
    checkTriangleHits(contract, in, hits, static_cast<uint>(hits.hits.size()));
    return contract.ok();
  };
  EXPECT_TRUE(holds(right));
  TriangleHits wrong = right;
  wrong.hits.pop_back();
  EXPECT_FALSE(holds(wrong));
  wrong = right;
  std::swap(wrong.hits[right.first[rich]], wrong.hits[right.first[rich] + 1]);
  EXPECT_FALSE(holds(wrong));
  wrong = right;
  wrong.hits.push_back(wrong.hits.back());
  EXPECT_FALSE(holds(wrong));
}

// Boxes of nodes cover what is below them; parts have each leaf once; links lead behind the subtree.
TEST(MeshTree, BoxesAndParts) {
  std::mt19937 random(7);
  for (const size_t count : {0u, 1u, 2u, 3u, 700u, 30000u}) {
    std::vector<MeshTriangle> triangles;
    const auto corners = triangleSoup(random, count);
    for (size_t i = 0; i < count; ++i) {
      triangles.push_back({corners[3 * i], corners[3 * i + 1], corners[3 * i + 2], 0, static_cast<int>(i), {0, 0}});
    }
    const MeshTree tree = makeMeshTree(triangles);
    ASSERT_EQ(tree.nodes.size(), count == 0 ? 0 : 2 * count - 1);
    std::vector<int> seen(count, 0);
    for (const MeshTriangle& t : tree.triangles) ++seen[static_cast<size_t>(t.index)];
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(count));
    int leaf = 0;
    for (const MeshPart& part : tree.parts) {
      for (int i = part.firstNode; i < part.firstNode + part.nodeCount; ++i) {
        const MeshNode& n = tree.nodes[static_cast<size_t>(i)];
        if (n.link < 0) {
          EXPECT_LE(i - n.link, part.firstNode + part.nodeCount);
        } else {
          EXPECT_EQ(n.link, leaf++);
        }
      }
    }
    EXPECT_EQ(leaf, static_cast<int>(count));
    for (size_t i = 0; i < tree.nodes.size(); ++i) {
      const MeshNode& n = tree.nodes[i];
      if (n.link >= 0) {
        const MeshTriangle& t = tree.triangles[static_cast<size_t>(n.link)];
        for (const float4& c : {t.a, t.b, t.c}) {
          const double step = (double(c.x) - tree.mesh.lower.x) * tree.mesh.perStep.x;
          EXPECT_GE(step, double(n.x & 0xffff) - 0.02);
          EXPECT_LE(step, double(n.x >> 16) + 0.02);
        }
        continue;
      }
      for (size_t child = i + 1; child < i + static_cast<size_t>(-n.link); ++child) {
        EXPECT_LE(n.y & 0xffff, tree.nodes[child].y & 0xffff);
        EXPECT_GE(n.z >> 16, tree.nodes[child].z >> 16);
      }
      if (count > 1000) i += 37;  // not all of them against all below
    }
  }
}

}  // namespace
}  // namespace btgpu
