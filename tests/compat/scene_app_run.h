// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Runs scene_app, which knows nothing of the cross-check, without and with it.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/subprocess.h"

namespace btgpu::test {

inline std::vector<nlohmann::json> jsonLines(const std::string& path) {
  std::vector<nlohmann::json> lines;
  std::istringstream in(readFile(path));
  for (std::string line; std::getline(in, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

// A line for each of `steps`, all compared and none failed, and the verdict of the run.
inline void expectAgreedLines(const std::string& path, int steps) {
  const std::vector<nlohmann::json> lines = jsonLines(path);
  ASSERT_EQ(lines.size(), size_t(steps) + 1);
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(lines[size_t(i)].at("failed"), false) << lines[size_t(i)];
    EXPECT_TRUE(lines[size_t(i)].at("unchecked").empty()) << lines[size_t(i)];
  }
  EXPECT_EQ(lines.back().at("checkedSteps"), steps);
  EXPECT_EQ(lines.back().at("agreed"), true) << lines.back();
}

inline void expectSceneAgrees(const std::string& scene, int steps) {
  const TemporaryFolder folder;
  const std::vector<std::string> command = {BTGPU_SCENE_APP, scene, std::to_string(steps)};
  RunOptions plain, checked;
  plain.environment = {"BTGPU_CROSSCHECK"};
  checked.environment = {"BTGPU_CROSSCHECK=1", "BTGPU_CROSSCHECK_FILE=" + folder.file("steps.json")};
  plain.seconds = checked.seconds = 400;
  const Finished without = runProgram(command, plain), with = runProgram(command, checked);
  ASSERT_EQ(without.exitCode, 0) << without.err;
  ASSERT_EQ(with.exitCode, 0) << with.err;
  EXPECT_EQ(with.out, without.out) << "positions to the last bit, steps on the device";
  EXPECT_EQ(with.outLines()[0], "deviceSteps " + std::to_string(steps));
  expectAgreedLines(folder.file("steps.json"), steps);
}

}  // namespace btgpu::test
