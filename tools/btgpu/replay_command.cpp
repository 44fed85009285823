// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include "bullet_file.h"
#include "commands.h"
#include "compat/engine_loader.h"

namespace btgpu::tool {
namespace {

struct ReplayArguments {
  std::string file, device;
  bool onHost = false;
};

// Another device rounds in other ways: its figures are for people to judge.
int runReplay(const ReplayArguments& arguments) {
  ReplayReport report;
  std::string error;
  const Status status = replayCapture(arguments.file, arguments.onHost ? nullptr : &arguments.device, report, error);
  if (status == Status::BadInput) throw InputError(error);
  if (status == Status::NoDevice && !arguments.device.empty()) throw InputError("--device: " + error);
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
      replay->add_option("--device", arguments->device, "OpenCL device: index, gpu, cpu or part of its name");
  replay
      ->add_flag("--host", arguments->onHost,
                 "run the stage's reference instead, and tell the first value that was captured and is off by more "
                 "than the stage's contract allows; needs no device")
      ->excludes(device);
  return {replay, [arguments] { return runReplay(*arguments); }};
}

}  // namespace btgpu::tool
