// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// `btgpu bench` with Bullet3's OpenCL pipeline. Long: it takes half a minute to build its kernels.
#include "bench_run.h"

namespace btgpu::test {
namespace {

TEST(BenchBullet3, Bullet3RunsBesideTheOthers) {
  const RunOptions patient{{}, 280};
  const json result = resultOf({"--size", "2,2,2", "--steps", "60", "--worlds", "bullet3,cpu"}, patient);
  const json& bullet3 = result.at("rows")[0];
  EXPECT_EQ(bullet3.at("world"), "bullet3");
  EXPECT_EQ(bullet3.at("bodies"), 9);
  EXPECT_GT(bullet3.at("msMedian"), 0.0);
  EXPECT_TRUE(bullet3.at("deviceMs").is_null());
  // After a second both stacks stand: four boxes on the ground at least, and no more than every face that can touch.
  for (const json& row : result.at("rows")) {
    EXPECT_GE(row.at("manifolds"), 4) << row.at("world");
    EXPECT_LE(row.at("manifolds"), 4 + 16) << row.at("world");
    EXPECT_GE(row.at("contacts"), row.at("manifolds")) << row.at("world");
  }
}

// A plane becomes a large box whose top lies where the plane is. What Bullet3 saves of its programs goes to btgpu's own
// folder: left to itself it makes one in the current folder.
TEST(BenchBullet3, StandsOnPlanesAndSavesWhereItShould) {
  const TemporaryFolder caches;
  const RunOptions patient{{"BTGPU_CACHE_DIR=" + caches.path().string()}, 280};
  const json result =
      resultOf({"--scene", "domino", "--size", "1,1,3", "--steps", "4", "--worlds", "bullet3"}, patient);
  EXPECT_EQ(result.at("rows")[0].at("manifolds"), 3);
  ASSERT_TRUE(std::filesystem::exists(caches.path() / "bullet3"));
  EXPECT_FALSE(std::filesystem::is_empty(caches.path() / "bullet3"));
}

}  // namespace
}  // namespace btgpu::test
