// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "arguments.h"
#include "bench.h"
#include "bullet_file.h"
#include "commands.h"
#include "compat/engine_loader.h"
#include "progress.h"

namespace btgpu::tool {
namespace {

struct BenchArguments {
  std::string scene = "stack", size, csv, json;
  std::string contacts = "on", hostQueries = "on", sleeping = "off";
  BenchOptions options;
};

void checkWorlds(const std::vector<std::string>& worlds) {
  const auto& known = benchWorldNames();
  for (size_t i = 0; i < worlds.size(); ++i) {
    if (std::find(known.begin(), known.end(), worlds[i]) == known.end()) {
      throw InputError(fmt::format("--worlds: no world named {}; there are gpu, cpu and bullet3", worlds[i]));
    }
    if (std::find(worlds.begin(), worlds.begin() + static_cast<long>(i), worlds[i]) !=
        worlds.begin() + static_cast<long>(i)) {
      throw InputError(fmt::format("--worlds: {} twice; name each world once", worlds[i]));
    }
  }
}

// Throws if a world that needs a device has none, before anything is run.
void checkDevices(const BenchOptions& options) {
  if (options.worlds == std::vector<std::string>{"cpu"}) return;
  std::vector<EngineInfo> devices;
  std::string error;
  if (!listDevices(devices, error)) throw std::runtime_error(error);
  if (devices.empty()) {
    throw std::runtime_error(
        "no OpenCL device: install a driver, for example the package pocl-opencl-icd, or measure --worlds cpu");
  }
  checkDevice(options.device);
}

int runBench(const BenchArguments& arguments, const std::string& name, const Builder& build,
             const BenchOptions& given) {
  BenchOptions options = given;
  BenchResult result;
  {
    ProgressBar bar("bench " + name, benchSteps(options));
    options.progress = [&bar](int done) { bar.show(done); };
    result = bench(name, build, options);
  }
  fmt::print("{}", toText(result));
  if (!arguments.csv.empty()) writeFile(arguments.csv, toCsv(result));
  if (!arguments.json.empty()) writeFile(arguments.json, toJson(result));
  std::fflush(stdout);
  return kAgreed;
}

int benchBuiltIn(const BenchArguments& arguments, BenchOptions options) {
  const scenes::Scene& scene = sceneNamed(arguments.scene);
  options.timeStep = scene.timeStep;
  const scenes::Size size = arguments.size.empty() ? scene.size : parseSize(arguments.size);
  checkDevices(options);
  return runBench(arguments, scene.name, builderOf(scene, size), options);
}

int benchFile(const BenchArguments& arguments, const BenchOptions& options) {
  if (!arguments.size.empty()) throw InputError("--size does not go with a .bullet file: it has its own");
  const Builder build = builderOfFile(arguments.scene);
  checkDevices(options);
  return runBench(arguments, arguments.scene, build, options);
}

int runBenchCommand(const BenchArguments& arguments) {
  BenchOptions options = arguments.options;
  options.contacts = arguments.contacts == "on";
  options.hostQueries = arguments.hostQueries == "on";
  options.sleeping = arguments.sleeping == "on";
  checkWorlds(options.worlds);
  return isBulletFile(arguments.scene) ? benchFile(arguments, options) : benchBuiltIn(arguments, options);
}

}  // namespace

Command addBenchCommand(CLI::App& tool) {
  const auto a = std::make_shared<BenchArguments>();
  CLI::App* bench = tool.add_subcommand("bench", "time the steps of btgpu and of other worlds in one run");
  const CLI::IsMember onOff({"on", "off"});
  bench->add_option("--scene", a->scene, "built-in scene or .bullet file")->capture_default_str();
  bench->add_option("--size", a->size, "size of a built-in scene, as X,Y,Z")->check(kNotEmpty);
  bench->add_option("--steps", a->options.steps, "steps to run; the second half is measured")
      ->check(CLI::Range(2, 10'000'000))
      ->capture_default_str();
  bench->add_option("--worlds", a->options.worlds, "which of gpu, cpu (stock Bullet), bullet3 (its OpenCL pipeline)")
      ->delimiter(',')
      ->capture_default_str();
  bench->add_option("--contacts", a->contacts, "keep the dispatcher's manifolds current")
      ->check(onOff)
      ->capture_default_str();
  bench->add_option("--host-queries", a->hostQueries, "keep the host's broadphase current")
      ->check(onOff)
      ->capture_default_str();
  bench->add_option("--sleeping", a->sleeping, "let bodies sleep")->check(onOff)->capture_default_str();
  bench->add_option("--device", a->options.device, "OpenCL device: index, gpu, cpu or part of its name");
  bench->add_option("--csv", a->csv, "write a line a world to this file")->check(kNotEmpty);
  bench->add_option("--json", a->json, "write the result to this file")->check(kNotEmpty);
  return {bench, [a] { return runBenchCommand(*a); }};
}

}  // namespace btgpu::tool
