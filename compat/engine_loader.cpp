// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "engine_loader.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

namespace btgpu {
namespace {

constexpr const char* kPluginName = "libbtgpu_engine.so";
constexpr const char* kCure = "; install ocl-icd-libopencl1 and a driver such as pocl-opencl-icd";
constexpr const char* kOtherVersion = "the engine plugin is of another version of btgpu; install both of one version";

struct Plugin {
  EngineFactory createEngine = nullptr;
  DeviceLister listDevices = nullptr;
  Replayer replay = nullptr;
  PairSearchFactory createPairSearch = nullptr;
  std::string error;  // why it could not be opened
};

std::filesystem::path ownDirectory() {
  Dl_info info;
  static const char anchor = 0;
  if (dladdr(&anchor, &info) == 0 || !info.dli_fname) return {};
  std::error_code error;
  const auto path = std::filesystem::canonical(info.dli_fname, error);
  return error ? std::filesystem::path() : path.parent_path();
}

void* openPlugin(std::string& error) {
  if (const char* path = std::getenv("BTGPU_ENGINE"); path && *path) {
    void* handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!handle) error = std::string(dlerror()) + "; correct or unset BTGPU_ENGINE, or install the engine it names";
    return handle;
  }
  const auto here = ownDirectory();
  for (const char* folder : {".", "btgpu", "../lib", "../lib/btgpu", BTGPU_PLUGIN_FROM_BIN}) {
    const auto candidate = here / folder / kPluginName;
    std::error_code ignored;
    if (here.empty() || !std::filesystem::exists(candidate, ignored)) continue;
    void* handle = dlopen(candidate.c_str(), RTLD_NOW | RTLD_LOCAL);
    // There, but something it needs is not: most likely libOpenCL.so.1.
    if (!handle) error = std::string(dlerror()) + kCure;
    return handle;
  }
  void* handle = dlopen(kPluginName, RTLD_NOW | RTLD_LOCAL);
  if (!handle) error = std::string(dlerror()) + "; install it beside libbtgpu, or name it in BTGPU_ENGINE";
  return handle;
}

Plugin loadPlugin() {
  Plugin plugin;
  std::string error;
  void* handle = openPlugin(error);
  if (!handle) {
    plugin.error = "no OpenCL engine: " + error;
    return plugin;
  }
  plugin.createEngine = reinterpret_cast<EngineFactory>(dlsym(handle, kEngineEntryPoint));
  plugin.listDevices = reinterpret_cast<DeviceLister>(dlsym(handle, kListDevicesEntryPoint));
  plugin.replay = reinterpret_cast<Replayer>(dlsym(handle, kReplayEntryPoint));
  plugin.createPairSearch = reinterpret_cast<PairSearchFactory>(dlsym(handle, kPairSearchEntryPoint));
  if (!plugin.createEngine || !plugin.listDevices || !plugin.replay || !plugin.createPairSearch) {
    plugin.error = kOtherVersion;
  }
  return plugin;
}

// Never closed: a world may outlive every static object of this library.
const Plugin& plugin() {
  static const Plugin* loaded = new Plugin(loadPlugin());
  return *loaded;
}

}  // namespace

std::unique_ptr<Engine> createEngine(const EngineSettings& settings, std::string& error, Status* why) {
  const Plugin& p = plugin();
  if (why) *why = Status::WrongAbi;
  if (!p.error.empty()) {
    error = p.error;
    return nullptr;
  }
  Status status = Status::InternalError;
  char message[1024] = "";
  std::unique_ptr<Engine> engine(p.createEngine(kEngineAbi, &settings, &status, message, sizeof message));
  if (status == Status::WrongAbi) {
    error = kOtherVersion;
  } else if (!engine) {
    error = message;
  }
  if (why) *why = status;
  return engine;
}

bool listDevices(std::vector<EngineInfo>& devices, std::string& error) {
  const Plugin& p = plugin();
  if (!p.error.empty()) {
    error = p.error;
    return false;
  }
  if (p.listDevices(kEngineAbi, &devices) != Status::Ok) {
    error = std::string("the OpenCL devices could not be listed") + kCure;
    return false;
  }
  return true;
}

Status replayCapture(const std::string& file, const ReplayOptions& options, ReplayReport& report, std::string& error) {
  const Plugin& p = plugin();
  if (!p.error.empty()) {
    error = p.error;
    return Status::InternalError;
  }
  const Status status = p.replay(kEngineAbi, &file, &options, &report, &error);
  if (status == Status::WrongAbi) error = kOtherVersion;
  return status;
}

std::unique_ptr<PairSearch> createPairSearch(const std::string& device, PairFinder finder, std::string& error) {
  const Plugin& p = plugin();
  if (!p.error.empty()) {
    error = p.error;
    return nullptr;
  }
  PairSearch* search = nullptr;
  if (p.createPairSearch(kEngineAbi, &device, finder, &search, &error) == Status::WrongAbi) error = kOtherVersion;
  return std::unique_ptr<PairSearch>(search);
}

}  // namespace btgpu
