// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Runs `btgpu bench` (BTGPU_TOOL) as a user or a script does.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/subprocess.h"

namespace btgpu::test {

using Arguments = std::vector<std::string>;
using nlohmann::json;

inline Finished bench(Arguments arguments, const RunOptions& options = {}, const std::string& tool = BTGPU_TOOL) {
  arguments.insert(arguments.begin(), {tool, "bench"});
  return runProgram(arguments, options);
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

inline void expectOneLine(const Finished& run, int exitCode, const std::vector<std::string>& parts) {
  EXPECT_EQ(run.exitCode, exitCode) << run.err;
  EXPECT_EQ(run.out, "") << "nothing that could be taken for a result";
  ASSERT_EQ(run.errLines().size(), 1u) << run.err;
  EXPECT_EQ(run.err.rfind("btgpu: ", 0), 0u) << run.err;
  for (const auto& part : parts) EXPECT_TRUE(contains(run.err, part)) << part << " is not in: " << run.err;
}

// The whole file of --json.
inline json fileOf(const Arguments& arguments, const RunOptions& options = {}) {
  const TemporaryFolder folder;
  const std::string path = folder.file("bench.json");
  Arguments all = arguments;
  all.insert(all.end(), {"--json", path});
  const Finished run = bench(all, options);
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.err, "") << "no terminal: no progress bar, and nothing else to say";
  return json::parse(readFile(path));
}

// Of one scene at one size.
inline json resultOf(const Arguments& arguments, const RunOptions& options = {}) {
  const json runs = fileOf(arguments, options).at("runs");
  EXPECT_EQ(runs.size(), 1u);
  return runs.at(0);
}

}  // namespace btgpu::test
