// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Time from the making of a world to the end of its first step, in a process of its own. The limits are those that
// btgpu promises for PoCL on 2 cores (README).
#include <gtest/gtest.h>

#include "tests/support/subprocess.h"

namespace btgpu::test {
namespace {

double firstStepSeconds(const std::vector<std::string>& environment) {
  RunOptions options;
  options.environment = environment;
  const Finished finished = runProgram({BTGPU_STARTUP_APP}, options);
  EXPECT_EQ(finished.exitCode, 0) << finished.err;
  const std::string name = "firstStepSeconds ";
  for (const std::string& line : finished.outLines()) {
    if (line.rfind(name, 0) == 0) return std::stod(line.substr(name.size()));
  }
  ADD_FAILURE() << finished.out;
  return 1e9;
}

class StartupTime : public testing::TestWithParam<const char*> {};

TEST_P(StartupTime, ColdAndWarm) {
  const TemporaryFolder folder;
  const std::vector<std::string> environment = {"BTGPU_CACHE_DIR=" + folder.file("btgpu"),
                                                "POCL_CACHE_DIR=" + folder.file("pocl"),
                                                std::string("BTGPU_KERNEL_SHAPE=") + GetParam()};
  const double cold = firstStepSeconds(environment), warm = firstStepSeconds(environment);
  std::printf("%s shape: cold %.2f s, warm %.3f s\n", GetParam(), cold, warm);
  EXPECT_LE(cold, 15);
  EXPECT_LE(warm, 0.5);
}

INSTANTIATE_TEST_SUITE_P(Shapes, StartupTime, testing::Values("cpu", "gpu"));

}  // namespace
}  // namespace btgpu::test
