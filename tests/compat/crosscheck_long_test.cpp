// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// 1,000 steps, each held against stock, of scenes that fall, collide and fall asleep: no step may fail, in the tool nor
// in an application that knows nothing of the check.
#include "scene_app_run.h"

namespace btgpu::test {
namespace {

constexpr int kSteps = 1000;

class CrossCheckLong : public ::testing::TestWithParam<const char*> {};

TEST_P(CrossCheckLong, InAnUnawareApplication) { expectSceneAgrees(GetParam(), kSteps); }

TEST_P(CrossCheckLong, ByTheCommand) {
  const TemporaryFolder folder;
  RunOptions options;
  options.seconds = 400;
  const Finished finished = runProgram(
      {BTGPU_TOOL, "crosscheck", GetParam(), "--steps", std::to_string(kSteps), "--lines", folder.file("f")}, options);
  EXPECT_EQ(finished.exitCode, 0) << finished.out << finished.err;
  expectAgreedLines(folder.file("f"), kSteps);
}

INSTANTIATE_TEST_SUITE_P(Scenes, CrossCheckLong, ::testing::Values("stack", "mixed", "domino"),
                         [](const auto& p) { return std::string(p.param); });

}  // namespace
}  // namespace btgpu::test
