// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btgpu: the command line tool. Exit status: 0 in agreement, 1 when a check fails, 2 for bad usage or input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>

#include "btgpu_version.h"
#include "bullet_file.h"
#include "compare.h"
#include "compat/engine_loader.h"
#include "progress.h"

namespace {

using namespace btgpu::tool;

constexpr int kAgreed = 0, kFailed = 1, kBadInput = 2;

int runInfo() {
  fmt::print("btgpu {}, {} precision\n", BTGPU_VERSION, sizeof(btScalar) == sizeof(double) ? "double" : "single");
  std::vector<btgpu::EngineInfo> devices;
  std::string error;
  if (!btgpu::listDevices(devices, error)) {
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

scenes::Size parseSize(const std::string& text) {
  constexpr long kMost = 4'000'000;  // bodies; more fit no machine that this is built for
  long x = 0, y = 0, z = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%ld,%ld,%ld%c", &x, &y, &z, &rest) != 3 || x < 1 || y < 1 || z < 1) {
    throw InputError(fmt::format("--size {}: give three positive numbers, as in 8,8,8", text));
  }
  if (x > kMost || y > kMost || z > kMost || x * y > kMost || x * y * z > kMost) {
    throw InputError(fmt::format("--size {}: too large; the product may be {} at most", text, kMost));
  }
  return {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
}

const scenes::Scene& sceneNamed(const std::string& name) {
  const scenes::Scene* scene = scenes::find(name);
  if (!scene)
    throw InputError(fmt::format("no scene named {}: 'btgpu scenes' lists them, or give a .bullet file", name));
  return *scene;
}

int runScenes(const std::string& write, const std::string& file, const std::string& size) {
  if (!write.empty()) {
    const scenes::Scene& scene = sceneNamed(write);
    writeBulletFile(scene, size.empty() ? scene.size : parseSize(size), file);
    return kAgreed;
  }
  for (const auto& s : scenes::all()) {
    fmt::print("{:<10} {} (size {},{},{}; {} steps)\n", s.name, s.description, s.size.x, s.size.y, s.size.z, s.steps);
  }
  return kAgreed;
}

struct CompareArguments {
  std::string scene, size, device, json;
  int steps = 0;
  bool hash = false, profile = false;
};

void writeFile(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw InputError(fmt::format("{}: can't be written; check the path", path));
}

// A world that gets no device says so itself, on stderr.
bool worldNamedCause(const CompareResult& result) {
  return std::any_of(result.fallbacks.begin(), result.fallbacks.end(),
                     [](const btGpuFallback& f) { return f.m_what == "device"; });
}

int reportComparison(const CompareArguments& arguments, const CompareResult& result) {
  fmt::print("{}", toText(result));
  if (arguments.hash) fmt::print("hash {:016x}\n", result.hash);
  if (!arguments.json.empty()) writeFile(arguments.json, toJson(result));
  if (!result.compared && !worldNamedCause(result)) {
    fmt::print(stderr, "btgpu: not compared: no step ran on a device; the lines 'on the CPU' say why\n");
  }
  std::fflush(stdout);
  return result.pass() ? kAgreed : kFailed;
}

// A device that was asked for by name and is not to be had is bad usage; no device at all is "not compared".
void checkDevice(const std::string& wish) {
  std::vector<btgpu::EngineInfo> devices;
  std::string error;
  if (wish.empty() || !btgpu::listDevices(devices, error) || devices.empty()) return;
  btgpu::EngineSettings settings;
  settings.device = wish;
  if (!btgpu::createEngine(settings, error)) throw InputError(fmt::format("--device: {}", error));
}

int runComparison(const CompareArguments& arguments, const std::string& name, const Builder& build,
                  const scenes::Expectations& expectations, double timeStep, int defaultSteps) {
  checkDevice(arguments.device);
  CompareOptions options;
  options.timeStep = timeStep;
  options.steps = arguments.steps > 0 ? arguments.steps : defaultSteps;
  options.device = arguments.device;
  options.profile = arguments.profile;
  CompareResult result;
  {
    ProgressBar bar(name, options.steps);
    options.progress = [&bar](int done) { bar.show(done); };
    result = compare(name, build, expectations, options);
  }
  return reportComparison(arguments, result);
}

int compareBuiltIn(const CompareArguments& arguments) {
  const scenes::Scene& scene = sceneNamed(arguments.scene);
  const scenes::Size size = arguments.size.empty() ? scene.size : parseSize(arguments.size);
  return runComparison(arguments, scene.name, builderOf(scene, size), scene.expectations, scene.timeStep, scene.steps);
}

// Of a file nothing is known: whether it comes to rest is seen in stock.
scenes::Expectations unknownScene() {
  scenes::Expectations expectations;
  expectations.comesToRest = scenes::Rest::AsStock;
  return expectations;
}

int compareFile(const CompareArguments& arguments) {
  if (!arguments.size.empty()) throw InputError("--size does not go with a .bullet file: it has its own");
  constexpr int kSteps = 300;
  constexpr double kTimeStep = 1.0 / 60.0;
  return runGuarded(arguments.scene, [&](const std::function<void()>& fileWasRead) {
    try {
      const Builder build = builderOfFile(arguments.scene);
      { TestWorld<btDiscreteDynamicsWorld> probe(build); }
      fileWasRead();
      return runComparison(arguments, arguments.scene, build, unknownScene(), kTimeStep, kSteps);
    } catch (const InputError& e) {
      fmt::print(stderr, "btgpu: {}\n", e.what());
      return kBadInput;
    }
  });
}

}  // namespace

// An empty value would be taken for none: a script's variable that is not set.
const CLI::Validator kNotEmpty([](const std::string& value) { return std::string(value.empty() ? "is empty" : ""); },
                               "");

int main(int argc, char** argv) {
  CLI::App app{"btgpu steps Bullet worlds on OpenCL and holds them against stock Bullet"};
  app.set_version_flag("--version", BTGPU_VERSION);
  app.require_subcommand(1);

  CLI::App* info = app.add_subcommand("info", "OpenCL devices, in the order of their indices");
  CLI::App* list = app.add_subcommand("scenes", "built-in scenes");
  std::string writeScene, writePath, writeSize;
  CLI::Option* write = list->add_option("--write", writeScene, "write this scene as a .bullet file");
  list->add_option("--size", writeSize, "size of the scene, as X,Y,Z")->needs(write)->check(kNotEmpty);
  CLI::Option* path = list->add_option("file", writePath, "the file to write")->needs(write);
  write->needs(path);

  CompareArguments arguments;
  CLI::App* comparison = app.add_subcommand("compare", "run a scene on btgpu and on stock Bullet and compare");
  comparison->add_option("scene", arguments.scene, "built-in scene or .bullet file")->required();
  comparison->add_option("--size", arguments.size, "size of a built-in scene, as X,Y,Z")->check(kNotEmpty);
  comparison->add_option("--steps", arguments.steps, "steps to run")->check(CLI::Range(1, 10'000'000));
  comparison->add_option("--device", arguments.device, "OpenCL device: index, gpu, cpu or part of its name");
  comparison->add_option("--json", arguments.json, "write the result to this file")->check(kNotEmpty);
  comparison->add_flag("--profile", arguments.profile, "time each stage by device events; slows btgpu's steps");
  comparison->add_flag("--hash", arguments.hash, "print a hash of every pose and velocity bit at the end");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(e);
    fmt::print(stderr, "btgpu: {}; see 'btgpu --help'\n", e.what());
    return kBadInput;
  }
  try {
    if (*info) return runInfo();
    if (*list) return runScenes(writeScene, writePath, writeSize);
    return isBulletFile(arguments.scene) ? compareFile(arguments) : compareBuiltIn(arguments);
  } catch (const InputError& e) {
    fmt::print(stderr, "btgpu: {}\n", e.what());
    return kBadInput;
  } catch (const std::exception& e) {
    fmt::print(stderr, "btgpu: {}\n", e.what());
    return kFailed;
  }
}
