// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btgpu: the command line tool. Exit status: 0 in agreement, 1 when a check fails, 2 for bad usage or input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
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
    fmt::print(stderr, "btgpu: {}: install ocl-icd-libopencl1 and a driver such as pocl-opencl-icd\n", error);
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
  scenes::Size size{};
  char rest = 0;
  if (std::sscanf(text.c_str(), "%d,%d,%d%c", &size.x, &size.y, &size.z, &rest) != 3 || size.x < 1 || size.y < 1 || size.z < 1) {
    throw InputError(fmt::format("--size {}: give three positive numbers, as in 8,8,8", text));
  }
  return size;
}

const scenes::Scene& sceneNamed(const std::string& name) {
  const scenes::Scene* scene = scenes::find(name);
  if (!scene) throw InputError(fmt::format("no scene named {}: 'btgpu scenes' lists them, or give a .bullet file", name));
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
  bool hash = false;
};

void writeFile(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw InputError(fmt::format("{}: can't be written; check the path", path));
}

int reportComparison(const CompareArguments& arguments, const CompareResult& result) {
  fmt::print("{}", toText(result));
  if (arguments.hash) fmt::print("hash {:016x}\n", result.hash);
  if (!arguments.json.empty()) writeFile(arguments.json, toJson(result));
  if (!result.compared) fmt::print(stderr, "btgpu: not compared: no step ran on a device; see 'btgpu info'\n");
  std::fflush(stdout);
  return result.pass() ? kAgreed : kFailed;
}

int compareBuiltIn(const CompareArguments& arguments) {
  const scenes::Scene& scene = sceneNamed(arguments.scene);
  const scenes::Size size = arguments.size.empty() ? scene.size : parseSize(arguments.size);
  const int steps = arguments.steps > 0 ? arguments.steps : scene.steps;
  ProgressBar bar(scene.name, steps);
  const CompareResult result = compare(scene.name, builderOf(scene, size), scene.expectations, scene.timeStep, steps,
                                       arguments.device, [&bar](int done) { bar.show(done); });
  return reportComparison(arguments, result);
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
      const int steps = arguments.steps > 0 ? arguments.steps : kSteps;
      ProgressBar bar(arguments.scene, steps);
      const CompareResult result = compare(arguments.scene, build, unknownScene(), kTimeStep, steps,
                                           arguments.device, [&bar](int done) { bar.show(done); });
      return reportComparison(arguments, result);
    } catch (const InputError& e) {
      fmt::print(stderr, "btgpu: {}\n", e.what());
      return kBadInput;
    }
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"btgpu steps Bullet worlds on OpenCL and holds them against stock Bullet"};
  app.set_version_flag("--version", BTGPU_VERSION);
  app.require_subcommand(1);

  CLI::App* info = app.add_subcommand("info", "OpenCL devices, in the order of their indices");
  CLI::App* list = app.add_subcommand("scenes", "built-in scenes");
  std::string writeScene, writePath, writeSize;
  CLI::Option* write = list->add_option("--write", writeScene, "write this scene as a .bullet file");
  list->add_option("--size", writeSize, "size of the scene, as X,Y,Z")->needs(write);
  CLI::Option* path = list->add_option("file", writePath, "the file to write")->needs(write);
  write->needs(path);

  CompareArguments arguments;
  CLI::App* comparison = app.add_subcommand("compare", "run a scene on btgpu and on stock Bullet and compare");
  comparison->add_option("scene", arguments.scene, "built-in scene or .bullet file")->required();
  comparison->add_option("--size", arguments.size, "size of a built-in scene, as X,Y,Z");
  comparison->add_option("--steps", arguments.steps, "steps to run")->check(CLI::PositiveNumber);
  comparison->add_option("--device", arguments.device, "OpenCL device: index, gpu, cpu or part of its name");
  comparison->add_option("--json", arguments.json, "write the result to this file");
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
