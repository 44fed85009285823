// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btgpu compare --stage-hashes: the same in each process, and after a change in a kernel other first in its stage.
// BTGPU_TOOL is the path of the binary.
#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "tests/support/changed_kernels.h"

namespace btgpu::test {
namespace {

// "world step stage hash-of-inputs hash-of-outputs"
struct Line {
  int world = 0, step = -1;
  std::string stage, inputs, outputs;

  bool operator==(const Line& o) const {
    return world == o.world && step == o.step && stage == o.stage && inputs == o.inputs && outputs == o.outputs;
  }
};

std::vector<Line> linesOf(const std::string& text) {
  std::vector<Line> lines;
  std::istringstream in(text);
  for (Line l; in >> l.world >> l.step >> l.stage >> l.inputs >> l.outputs;) lines.push_back(l);
  return lines;
}

class StageHashesTest : public testing::TestWithParam<const char*> {
 protected:
  Finished compare(const std::string& file, const std::string& scene, const std::string& size,
                   std::vector<std::string> environment = {}) const {
    environment.push_back(std::string("BTGPU_KERNEL_SHAPE=") + GetParam());
    return runProgram({BTGPU_TOOL, "compare", scene, "--size", size, "--steps", "6", "--stage-hashes", file},
                      {environment});
  }
  std::vector<Line> hashes(const std::string& scene, const std::string& size,
                           const std::vector<std::string>& environment = {}) const {
    const std::string file = m_folder.file("hashes.txt");
    const Finished run = compare(file, scene, size, environment);
    EXPECT_EQ(run.signal, 0) << run.err;
    EXPECT_NE(run.exitCode, 2) << run.err;
    return linesOf(readFile(file));
  }

  TemporaryFolder m_folder;
};

// Large enough for several work groups.
TEST_P(StageHashesTest, TheSameInEachProcess) {
  const auto first = hashes("stack", "6,6,6"), second = hashes("stack", "6,6,6");
  ASSERT_GE(first.size(), 6u * 15);
  ASSERT_EQ(first.size(), second.size());
  for (size_t i = 0; i < first.size(); ++i) {
    ASSERT_TRUE(first[i] == second[i]) << "step " << first[i].step << ", " << first[i].stage;
  }
  std::set<std::string> outputs;
  for (const Line& l : first) outputs.insert(l.outputs);
  EXPECT_GT(outputs.size(), first.size() / 2) << "hashes of nothing";
  EXPECT_EQ(first.front().world, 1);
  EXPECT_EQ(first.front().step, 0);
  EXPECT_EQ(first.front().stage, "10_apply_forces");
  EXPECT_EQ(first.back().step, 5);
}

// The lowest bit of one number of one body.
TEST_P(StageHashesTest, AOneBitChangeShowsInItsStage) {
  const std::string kernels = std::string("BTGPU_KERNEL_DIR=") + BTGPU_SOURCE_DIR;
  const auto good = hashes("stack", "2,2,2", {kernels});
  const std::string store = "solverMasses[i] = makeSolverMass(steps[i], masses[i]);";
  const ChangedKernels changed(
      "stages/65_prepare_contacts.cl", store,
      store + " if (i == 3) solverMasses[i].row1.y = as_float(as_uint(solverMasses[i].row1.y) ^ 1u);");
  const auto bad = hashes("stack", "2,2,2", {"BTGPU_KERNEL_DIR=" + changed.path()});
  ASSERT_GE(good.size(), 6u * 15);
  ASSERT_EQ(good.size(), bad.size());
  size_t i = 0;
  while (i < good.size() && good[i] == bad[i]) ++i;
  ASSERT_LT(i, good.size()) << "not seen at all";
  EXPECT_EQ(good[i].stage, "65_prepare_contacts");
  EXPECT_EQ(good[i].inputs, bad[i].inputs);
  EXPECT_NE(good[i].outputs, bad[i].outputs);
}

TEST_P(StageHashesTest, FilesThatCanNotBeWritten) {
  const Finished run = compare(m_folder.file("no/such/file"), "stack", "2,2,2");
  EXPECT_EQ(run.exitCode, 2);
  ASSERT_EQ(run.errLines().size(), 1u) << run.err;
  EXPECT_NE(run.err.find("no/such/file"), std::string::npos) << run.err;
}

INSTANTIATE_TEST_SUITE_P(Shapes, StageHashesTest, testing::Values("cpu", "gpu"),
                         [](const auto& shape) { return std::string(shape.param); });

}  // namespace
}  // namespace btgpu::test
