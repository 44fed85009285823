// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include "bullet_file.h"
#include "commands.h"
#include "compat/engine_loader.h"

namespace btgpu::tool {
namespace {

struct ReplayArguments {
  std::string file;
  ReplayOptions options;
};

// Another device rounds in other ways: its figures are for people to judge.
int runReplay(const ReplayArguments& arguments) {
  ReplayReport report;
  std::string error;
  const Status status = replayCapture(arguments.file, arguments.options, report, error);
  if (status == Status::BadInput) throw InputError(error);
  if (status == Status::NoDevice && !arguments.options.device.empty()) throw InputError("--device: " + error);
  if (status != Status::Ok) {
    fmt::print(stderr, "btgpu: {}\n", error);
    return kFailed;
  }
  fmt::print("{}", report.text);
  return report.differentArrays == 0 || !report.sameDevice ? kAgreed : kFailed;
}

}  // namespace

Command addReplayCommand(CLI::App& tool) {
  const auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* replay = tool.add_subcommand(
      "replay",
      "run a captured stage again and compare with what came out then. Capture one with BTGPU_CAPTURE=44@120: stage "
      "44 of step 120, from 0 (docs/capture.md). Exit status: 0 if all is identical, or on another device than the "
      "one of the capture; 1 if anything differs, or breaks the contract of --host; 2 for a file that is no capture");
  replay->add_option("file", arguments->file, "the capture")->required();
  auto* device =
      replay->add_option("--device", arguments->options.device, "OpenCL device: index, gpu, cpu or part of its name");
  auto* time = replay
                   ->add_option("--time", arguments->options.timedRuns,
                                "run it so many more times, each from the same arrays, and print what they take")
                   ->check(CLI::Range(1, 1'000'000));
  replay
      ->add_flag("--host", arguments->options.onHost,
                 "run the stage's reference instead, and tell the first value that was captured and is off by more "
                 "than the stage's contract allows; needs no device")
      ->excludes(device)
      ->excludes(time);
  return {replay, [arguments] { return runReplay(*arguments); }};
}

}  // namespace btgpu::tool
