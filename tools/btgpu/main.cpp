// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btgpu: the command line tool. Exit status: 0 in agreement, 1 when a check fails, 2 for bad usage or input.
#include <fmt/format.h>

#include "btgpu_version.h"
#include "bullet_file.h"
#include "commands.h"

namespace {

using namespace btgpu::tool;

int run(const std::vector<Command>& commands) {
  for (const Command& command : commands) {
    if (*command.app) return command.run();
  }
  return kBadInput;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"btgpu steps Bullet worlds on OpenCL and holds them against stock Bullet"};
  app.set_version_flag("--version", BTGPU_VERSION);
  app.require_subcommand(1);
  const std::vector<Command> commands = {addInfoCommand(app),       addScenesCommand(app),      addCompareCommand(app),
                                         addCrosscheckCommand(app), addBenchCommand(app),       addReplayCommand(app),
                                         addProfileCommand(app),    addConvergenceCommand(app), addQualityCommand(app),
                                         addRaysCommand(app)};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(e);
    fmt::print(stderr, "btgpu: {}; see 'btgpu --help'\n", e.what());
    return kBadInput;
  }
  try {
    return run(commands);
  } catch (const InputError& e) {
    fmt::print(stderr, "btgpu: {}\n", e.what());
    return kBadInput;
  } catch (const std::exception& e) {
    fmt::print(stderr, "btgpu: {}\n", e.what());
    return kFailed;
  }
}
