// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// `btgpu bench --scene pairs`. The command itself fails where finders differ or Bullet lacks a pair.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/support/subprocess.h"

namespace btgpu::test {
namespace {

Finished benchPairs(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {BTGPU_TOOL, "bench", "--scene", "pairs"});
  return runProgram(arguments);
}

size_t linesWith(const std::string& text, const std::string& part) {
  std::istringstream lines(text);
  size_t count = 0;
  for (std::string line; std::getline(lines, line);) count += line.find(part) != std::string::npos;
  return count;
}

TEST(PairsBench, VariesOneCriterionAtATime) {
  const std::string csv = testing::TempDir() + "pairs_bench_test.csv";
  const Finished run = benchPairs({"--bodies", "50,400", "--steps", "4", "--moving", "1,0.2", "--spread", "2,50",
                                   "--churn", "0,0.05", "--csv", csv});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(linesWith(run.out, "pairs: 50 bodies"), 4u) << run.out;
  EXPECT_EQ(linesWith(run.out, "pairs: 400 bodies"), 4u);
  EXPECT_EQ(linesWith(run.out, "largest 50 times"), 2u);
  std::ifstream file(csv);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  EXPECT_EQ(linesWith(text, "400,1,0.05,2,0,"), 6u) << text;
  EXPECT_EQ(linesWith(text, "50,0.2,0.05,2,0,"), 6u);
  EXPECT_EQ(linesWith(text, "50,1,0.05,2,0.05,"), 6u);
  for (const char* world : {"bvh", "grid", "sweep", "incremental", "brute_force", "dbvt"}) {
    EXPECT_EQ(linesWith(text, std::string(",") + world + ","), 8u) << world;
  }
}

TEST(PairsBench, LeavesOutWhatIsTooLarge) {
  const Finished run = benchPairs({"--bodies", "200", "--steps", "2", "--worlds", "grid,brute_force:100"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(linesWith(run.out, "brute_force: left out, more than 100 bodies"), 1u) << run.out;
}

TEST(PairsBench, RefusesWhatItDoesNotKnow) {
  const auto expectRefused = [](const std::vector<std::string>& arguments, const std::string& why) {
    const Finished run = benchPairs(arguments);
    EXPECT_EQ(run.exitCode, 2) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err.find(why), std::string::npos) << run.err;
  };
  expectRefused({"--worlds", "grid,octree"}, "octree does not find pairs");
  expectRefused({"--worlds", "grid,grid"}, "grid twice");
  expectRefused({"--worlds", "dbvt:few"}, "most bodies behind the colon");
  expectRefused({"--scene", "stack"}, "goes alone");
  expectRefused({"--size", "2,2,2"}, "has --bodies");
  expectRefused({"--json", "pairs.json"}, "no --json");
  expectRefused({"--moving", "2"}, "--moving");
}

}  // namespace
}  // namespace btgpu::test
