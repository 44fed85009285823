// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The oracle in an application that knows nothing of it (startup_app.cpp), turned on from outside.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/subprocess.h"

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

std::vector<nlohmann::json> jsonLines(const std::string& path) {
  std::vector<nlohmann::json> lines;
  std::istringstream in(readFile(path));
  for (std::string line; std::getline(in, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
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
    EXPECT_EQ(step.at("checks").size(), 7u);
    EXPECT_TRUE(step.at("body").contains("index"));
  }
  EXPECT_EQ(lines[32].at("checkedSteps"), 30);
  EXPECT_EQ(lines[32].at("failedSteps"), 0);
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

// A device that forgets gravity on the way.
TEST(CrossCheckApp, FirstFailureOfAWorldIsSaidOnce) {
  const TemporaryFolder folder;
  fs::copy(fs::path(BTGPU_SOURCE_DIR) / "kernels", folder.path() / "kernels", fs::copy_options::recursive);
  const fs::path kernel = folder.path() / "kernels/stages/10_apply_forces.cl";
  std::string text = readFile(kernel);
  const std::string factor = "(inverseMass * timeStep)";
  ASSERT_TRUE(contains(text, factor));
  writeFile(kernel, text.replace(text.find(factor), factor.size(), "(0.9f * inverseMass * timeStep)"));
  const Finished finished = runApp({"BTGPU_CROSSCHECK=1", "BTGPU_KERNEL_DIR=" + folder.path().string()});
  const std::vector<std::string> said = finished.errLines();
  ASSERT_EQ(said.size(), 4u) << finished.err;
  EXPECT_TRUE(contains(said[0], "world 1, step 1, failed; solver.free_velocity ")) << said[0];
  EXPECT_TRUE(contains(said[0], "most in body ")) << said[0];
  EXPECT_TRUE(contains(said[3], "30 failed; the whole run is NOT in agreement: ")) << said[3];
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
