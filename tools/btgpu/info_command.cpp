// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include "btgpu_version.h"
#include "commands.h"
#include "compat/btGpuDynamicsWorld.h"
#include "compat/engine_loader.h"

namespace btgpu::tool {
namespace {

int runInfo() {
  fmt::print("btgpu {}, {} precision\n", BTGPU_VERSION, sizeof(btScalar) == sizeof(double) ? "double" : "single");
  std::vector<EngineInfo> devices;
  std::string error;
  if (!listDevices(devices, error)) {
    fmt::print(stderr, "btgpu: {}\n", error);
    return kFailed;
  }
  if (devices.empty()) {
    fmt::print(stderr, "btgpu: no OpenCL device: install a driver, for example the package pocl-opencl-icd\n");
    return kFailed;
  }
  for (const auto& d : devices) {
    fmt::print("{}: {} ({}, {} compute units, {} MiB)\n   {}, {}, driver {}\n", d.index, d.device, d.type,
               d.computeUnits, d.globalMemory >> 20, d.platform, d.version, d.driver);
  }
  return kAgreed;
}

}  // namespace

Command addInfoCommand(CLI::App& tool) {
  return {tool.add_subcommand("info", "OpenCL devices, in the order of their indices"), runInfo};
}

}  // namespace btgpu::tool
