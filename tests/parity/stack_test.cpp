// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The reference scene at the size at which a pile's averages mean something: 4,096 boxes fall, and after five seconds
// btgpu's pile has to be as high, as calm and as little interpenetrated as stock's. `btgpu compare` itself allows
// what stock differs from itself after a change of 1e-6 in the start, which in small piles is much more; here the
// limits are absolute.
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/support/subprocess.h"

namespace btgpu::test {
namespace {

TEST(Stack, AsHighCalmAndTightAsStock) {
  const TemporaryFolder folder;
  RunOptions options;
  options.seconds = 850;
  const Finished finished = runProgram(
      {BTGPU_TOOL, "compare", "stack", "--size", "16,16,16", "--steps", "300", "--json", folder.file("stack.json")},
      options);
  ASSERT_EQ(finished.exitCode, 0) << finished.out << finished.err;
  std::printf("%s", finished.out.c_str());
  const auto json = nlohmann::json::parse(readFile(folder.file("stack.json")));
  EXPECT_TRUE(json["pass"]);
  EXPECT_EQ(json["deviceSteps"], 300);
  EXPECT_TRUE(json["fallbacks"].empty());
  const auto &gpu = json["gpu"], &stock = json["cpu"];
  const auto of = [](const nlohmann::json& world, const char* name) { return world[name].get<double>(); };
  EXPECT_EQ(gpu["belowGround"], 0);
  EXPECT_NEAR(of(gpu, "meanHeight"), of(stock, "meanHeight"), 0.005 * of(stock, "meanHeight"));
  EXPECT_LE(of(gpu, "restingEnergy"), 1.1 * of(stock, "restingEnergy") + 1e-4) << "J a body, mean of the last 60 steps";
  EXPECT_LE(of(gpu, "penetration99"), 1.2 * of(stock, "penetration99")) << "99th percentile of depths";
}

}  // namespace
}  // namespace btgpu::test
