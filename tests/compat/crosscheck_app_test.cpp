// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The oracle in an application that knows nothing of it (startup_app.cpp), turned on from outside.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "scene_app_run.h"

namespace btgpu::test {
namespace {

namespace fs = std::filesystem;

Finished runApp(std::vector<std::string> environment) {
  RunOptions options;
  options.environment = std::move(environment);
  Finished finished = runProgram({BTGPU_STARTUP_APP}, options);
  EXPECT_EQ(finished.exitCode, 0) << "signal " << finished.signal << "\n" << finished.err;
  return finished;
}

// What the application says of its own world, without the times.
std::string resultsOf(const Finished& finished) {
  std::string text;
  for (const std::string& line : finished.outLines()) {
    if (line.rfind("firstStepSeconds", 0) != 0) text += line + "\n";
  }
  return text;
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(CrossCheckApp, SaysNothingUnlessAsked) {
  EXPECT_EQ(runApp({"BTGPU_CROSSCHECK"}).err, "");
  EXPECT_EQ(runApp({"BTGPU_CROSSCHECK=0"}).err, "");
}

TEST(CrossCheckApp, EveryStepOfEveryWorld) {
  const TemporaryFolder folder;
  const Finished plain = runApp({"BTGPU_CROSSCHECK"});
  const Finished checked = runApp({"BTGPU_CROSSCHECK=1", "BTGPU_CROSSCHECK_FILE=" + folder.file("steps.json")});
  EXPECT_EQ(resultsOf(checked), resultsOf(plain)) << "the application is not changed";
  // Its worlds die in the reverse order: the second one made one step, the first 30.
  const std::vector<std::string> said = checked.errLines();
  ASSERT_EQ(said.size(), 2u) << checked.err;
  EXPECT_TRUE(contains(said[0], "world 2: 1 of 1 steps compared with stock, 0 failed")) << said[0];
  EXPECT_TRUE(contains(said[1], "world 1: 30 of 30 steps compared with stock, 0 failed")) << said[1];
  EXPECT_TRUE(contains(said[1], "the whole run is in agreement")) << said[1];

  const std::vector<nlohmann::json> lines = jsonLines(folder.file("steps.json"));
  ASSERT_EQ(lines.size(), 33u) << "31 steps, two summaries";
  for (int i = 0; i < 30; ++i) {
    const nlohmann::json& step = lines[size_t(i)];
    EXPECT_EQ(step.at("world"), 1);
    EXPECT_EQ(step.at("step"), i + 1);
    EXPECT_EQ(step.at("failed"), false);
    EXPECT_EQ(step.at("checks").size(), 8u);
    EXPECT_TRUE(step.at("body").contains("index"));
  }
  EXPECT_EQ(lines[32].at("checkedSteps"), 30);
  EXPECT_EQ(lines[32].at("failedSteps"), 0);
  EXPECT_EQ(lines[32].at("agreed"), true);
}

TEST(CrossCheckApp, EveryTenthStep) {
  const std::vector<std::string> said = runApp({"BTGPU_CROSSCHECK=10"}).errLines();
  ASSERT_EQ(said.size(), 2u);
  EXPECT_TRUE(contains(said[1], "world 1: 3 of 30 steps compared")) << said[1];
}

TEST(CrossCheckApp, SaysWhatItDoesNotUnderstand) {
  const Finished finished = runApp({"BTGPU_CROSSCHECK=often"});
  ASSERT_EQ(finished.errLines().size(), 1u) << finished.err;
  EXPECT_TRUE(contains(finished.err, "BTGPU_CROSSCHECK=often")) << finished.err;
}

TEST(CrossCheckApp, FileThatCantBeWritten) {
  const Finished finished = runApp({"BTGPU_CROSSCHECK=1", "BTGPU_CROSSCHECK_FILE=/no/such/folder/x"});
  ASSERT_EQ(finished.errLines().size(), 4u) << finished.err;
  EXPECT_TRUE(contains(finished.errLines()[0], "can't write /no/such/folder/x"));
}

// Kernels that forget a tenth of the forces. Only bodies without contact have a limit on it: at first they all touch.
std::string forgetfulKernels(const TemporaryFolder& folder) {
  fs::copy(fs::path(BTGPU_SOURCE_DIR) / "kernels", folder.path() / "kernels", fs::copy_options::recursive);
  const fs::path kernel = folder.path() / "kernels/stages/10_apply_forces.cl";
  std::string text = readFile(kernel);
  const std::string factor = "(inverseMass * timeStep)";
  EXPECT_TRUE(contains(text, factor));
  writeFile(kernel, text.replace(text.find(factor), factor.size(), "(0.9f * inverseMass * timeStep)"));
  return "BTGPU_KERNEL_DIR=" + folder.path().string();
}

TEST(CrossCheckApp, FirstFailureOfAWorldIsSaidOnce) {
  const TemporaryFolder folder;
  const Finished finished = runApp({"BTGPU_CROSSCHECK=1", forgetfulKernels(folder)});
  const std::vector<std::string> said = finished.errLines();
  ASSERT_EQ(said.size(), 3u) << finished.err;
  EXPECT_TRUE(contains(said[0], ", failed; solver.free_velocity ")) << said[0];
  EXPECT_TRUE(contains(said[0], "most in body ")) << said[0];
  EXPECT_TRUE(contains(said[1], "world 2: 1 of 1 steps")) << said[1];
  EXPECT_TRUE(contains(said[2], " failed; the whole run is NOT in agreement: ")) << said[2];
}

// The command tells by its exit status.
int runCommand(const std::vector<std::string>& arguments, std::vector<std::string> environment = {}) {
  std::vector<std::string> command = {BTGPU_TOOL, "crosscheck"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  RunOptions options;
  options.environment = std::move(environment);
  return runProgram(command, options).exitCode;
}

TEST(CrossCheckCommand, ExitStatus) {
  const TemporaryFolder folder;
  EXPECT_EQ(runCommand({"stack", "--size", "3,3,3", "--steps", "60"}), 0);
  EXPECT_EQ(runCommand({"vehicle", "--size", "1,2,2", "--steps", "60", "--every", "7"}), 0);
  EXPECT_EQ(runCommand({"stack", "--size", "3,3,3", "--steps", "60"}, {forgetfulKernels(folder)}), 1);
  EXPECT_EQ(runCommand({"stack", "--size", "3,3,3", "--steps", "60"}, {"BTGPU_ENGINE=/no/such/engine.so"}), 1);
  EXPECT_EQ(runCommand({"no_such_scene"}), 2);
  EXPECT_EQ(runCommand({"stack", "--steps", "5", "--every", "6"}), 2);
}

// A slice of crosscheck_long_test.cpp.
TEST(CrossCheckApp, ScenesInAnUnawareApplication) {
  for (const char* scene : {"stack", "mixed", "domino"}) expectSceneAgrees(scene, 100);
}

// Without a device nothing is compared, and the check says so.
TEST(CrossCheckApp, OnTheStockPath) {
  const Finished finished = runApp({"BTGPU_CROSSCHECK=1", "BTGPU_ENGINE=/no/such/engine.so"});
  const std::vector<std::string> said = finished.errLines();
  ASSERT_EQ(said.size(), 3u) << finished.err;
  EXPECT_TRUE(contains(said[2], "0 of 30 steps compared with stock, 30 ran on the stock path: nothing was checked"))
      << said[2];
}

}  // namespace
}  // namespace btgpu::test
