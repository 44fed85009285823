// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A stage captured in btgpu compare and run again with btgpu replay, as a user does it. BTGPU_TOOL is the path of the
// binary.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/changed_kernels.h"

namespace btgpu::test {
namespace {

const std::string kStage = "44_find_separating_axis";

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

class ReplayTest : public testing::Test {
 protected:
  static Finished tool(std::vector<std::string> arguments, const std::vector<std::string>& environment = {}) {
    arguments.insert(arguments.begin(), BTGPU_TOOL);
    return runProgram(arguments, {environment});
  }
  static Finished compare(const std::vector<std::string>& environment = {}) {
    return tool({"compare", "stack", "--size", "2,2,2", "--steps", "8", "--hash"}, environment);
  }
  void capture() {
    const Finished run = compare({"BTGPU_CAPTURE=44@5", "BTGPU_CAPTURE_FILE=" + m_file});
    ASSERT_TRUE(std::filesystem::exists(m_file)) << run.err;
  }
  // Status 2, nothing on stdout, and one line that names the file.
  void expectRefused(const std::string& bytes) {
    const std::string damaged = m_folder.file("damaged");
    writeFile(damaged, bytes);
    const Finished run = tool({"replay", damaged});
    EXPECT_EQ(run.exitCode, 2);
    EXPECT_EQ(run.signal, 0);
    EXPECT_EQ(run.out, "");
    ASSERT_EQ(run.errLines().size(), 1u) << run.err;
    EXPECT_EQ(run.err.rfind("btgpu: " + damaged, 0), 0u) << run.err;
  }

  TemporaryFolder m_folder;
  const std::string m_file = m_folder.file("axis.btgpucap");
};

TEST_F(ReplayTest, SameHashSameBits) {
  const Finished plain = compare(),
                 captured = compare({"BTGPU_CAPTURE=44@5,70@3", "BTGPU_CAPTURE_FILE=" + m_folder.path().string()});
  EXPECT_EQ(captured.exitCode, plain.exitCode);
  const std::string hash = plain.out.substr(plain.out.find("hash "));
  EXPECT_GE(hash.size(), 21u);
  EXPECT_TRUE(contains(captured.out, hash)) << captured.out;
  EXPECT_TRUE(contains(captured.err, "captured " + kStage + " of step 5 in ")) << captured.err;
  const std::string names[] = {"btgpu-" + kStage + "-5.btgpucap", "btgpu-70_solve_velocities-3.btgpucap"};
  for (const std::string& name : names) {
    const Finished replay = tool({"replay", m_folder.file(name)});
    EXPECT_EQ(replay.exitCode, 0) << replay.out << replay.err;
    EXPECT_EQ(replay.err, "");
    EXPECT_TRUE(contains(replay.out, "identical\n")) << replay.out;
    const Finished onHost = tool({"replay", m_folder.file(name), "--host"}, {"OCL_ICD_VENDORS=/nonexistent"});
    EXPECT_EQ(onHost.exitCode, 0) << onHost.out << onHost.err;
    EXPECT_TRUE(contains(onHost.out, "within the contract of the reference on the host\n")) << onHost.out;
  }
}

TEST_F(ReplayTest, TheHostFindsWhatWasWrongWithTheKernel) {
  const ChangedKernels kernels("lib/box_box_wide.h", "LaneMask behind = distance < 0.0f;",
                               "LaneMask behind = distance >= 0.0f;");
  compare({"BTGPU_CAPTURE=44@1", "BTGPU_CAPTURE_FILE=" + m_file, "BTGPU_KERNEL_DIR=" + kernels.path()});
  const Finished run = tool({"replay", m_file, "--host"});
  EXPECT_EQ(run.exitCode, 1) << run.out << run.err;
  EXPECT_TRUE(contains(run.out, kStage + ": pair ")) << run.out;
  EXPECT_EQ(tool({"replay", m_file, "--host", "--device", "0"}).exitCode, 2);
}

TEST_F(ReplayTest, AnotherKernelGivesOne) {
  capture();
  const ChangedKernels kernels("lib/box_box_wide.h", "LaneMask behind = distance < 0.0f;",
                               "LaneMask behind = distance >= 0.0f;");
  const std::string environment = "BTGPU_KERNEL_DIR=";
  EXPECT_EQ(tool({"replay", m_file}, {environment + BTGPU_SOURCE_DIR}).exitCode, 0);
  const Finished run = tool({"replay", m_file}, {environment + kernels.path()});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_TRUE(contains(run.out, "separating axes: ")) << run.out << run.err;
  EXPECT_TRUE(contains(run.out, "first: [")) << run.out;
  EXPECT_FALSE(contains(run.out, "identical"));
}

TEST_F(ReplayTest, NoCapture) {
  for (const char* bytes : {"", "btgpucap", "some text that is none at all, but as long as a header"}) {
    expectRefused(bytes);
  }
  EXPECT_EQ(tool({"replay", m_folder.file("missing")}).exitCode, 2);
  EXPECT_EQ(tool({"replay", m_folder.path().string()}).exitCode, 2);
  EXPECT_EQ(tool({"replay"}).exitCode, 2);
}

TEST_F(ReplayTest, DamagedCaptures) {
  capture();
  const std::string good = readFile(m_file);
  ASSERT_GT(good.size(), 1000u);
  std::mt19937 random(3);
  for (int i = 0; i < 10; ++i) {
    expectRefused(good.substr(0, random() % good.size()));
    std::string flipped = good;
    flipped[random() % flipped.size()] ^= static_cast<char>(1u << random() % 8);
    expectRefused(flipped);
  }
}

TEST_F(ReplayTest, Devices) {
  capture();
  const Finished run = tool({"replay", m_file, "--device", "nosuch"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_TRUE(contains(run.err, "--device") && contains(run.err, "nosuch")) << run.err;
  EXPECT_EQ(tool({"replay", m_file, "--device", "0"}).exitCode, 0);
  EXPECT_EQ(tool({"replay", m_file}, {"OCL_ICD_VENDORS=/nonexistent"}).exitCode, 1);
  EXPECT_EQ(tool({"replay", m_file}, {"BTGPU_ENGINE=/nonexistent"}).exitCode, 1);
  // The captured shape counts, whatever is wished for.
  for (const char* shape : {"cpu", "gpu"}) {
    EXPECT_EQ(tool({"replay", m_file}, {std::string("BTGPU_KERNEL_SHAPE=") + shape}).exitCode, 0) << shape;
  }
}

TEST_F(ReplayTest, Help) {
  const Finished run = tool({"replay", "--help"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_TRUE(contains(run.out, "BTGPU_CAPTURE")) << run.out;
}

}  // namespace
}  // namespace btgpu::test
