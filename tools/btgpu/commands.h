// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The subcommands of the tool, one file each. A function adds its command with its options to the command line and
// returns what to run if that command was chosen; its exit status is one of those below, InputError means kBadInput.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace btgpu::tool {

constexpr int kAgreed = 0, kFailed = 1, kBadInput = 2;

struct Command {
  CLI::App* app;
  std::function<int()> run;
};

Command addInfoCommand(CLI::App& tool);
Command addScenesCommand(CLI::App& tool);
Command addCompareCommand(CLI::App& tool);
Command addCrosscheckCommand(CLI::App& tool);
Command addBenchCommand(CLI::App& tool);
Command addConvergenceCommand(CLI::App& tool);
Command addReplayCommand(CLI::App& tool);
Command addProfileCommand(CLI::App& tool);
Command addQualityCommand(CLI::App& tool);
Command addRaysCommand(CLI::App& tool);

// An empty value would be taken for none: a script's variable that is not set.
inline const CLI::Validator kNotEmpty(
    [](const std::string& value) { return std::string(value.empty() ? "is empty" : ""); }, "");

}  // namespace btgpu::tool
