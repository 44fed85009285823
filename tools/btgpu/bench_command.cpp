// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "arguments.h"
#include "bench.h"
#include "bullet_file.h"
#include "commands.h"
#include "compat/engine_loader.h"
#include "pairs_bench_command.h"
#include "progress.h"

namespace btgpu::tool {
namespace {

// Above so many bodies a world is left out.
struct WorldWish {
  std::string name;
  long mostBodies = std::numeric_limits<long>::max();
};

struct BenchArguments {
  std::vector<std::string> scenes = {"stack"}, worlds = {"gpu", "cpu"};
  std::vector<int> bodies;
  std::string size, csv, json;
  std::string contacts = "on", hostQueries = "on", sleeping = "off", stages = "on", motionStates = "off";
  int steps = 0;  // 0: as the scene has it
  BenchOptions options;
  PairsBenchArguments pairs;  // of the scene "pairs", which is no world
};

// A scene at a size.
struct Run {
  std::string scene, size;
  Builder build;
  double timeStep = 1.0 / 60.0;
  int steps = 120;
};

WorldWish parseWorld(const std::string& text) {
  const size_t colon = text.find(':');
  WorldWish wish;
  wish.name = text.substr(0, colon);
  const auto& known = benchWorldNames();
  if (std::find(known.begin(), known.end(), wish.name) == known.end()) {
    throw InputError(fmt::format("--worlds: no world named {}; there are gpu, cpu and bullet3", wish.name));
  }
  char rest = 0;
  if (colon != std::string::npos &&
      (std::sscanf(text.c_str() + colon + 1, "%ld%c", &wish.mostBodies, &rest) != 1 || wish.mostBodies < 1)) {
    throw InputError(fmt::format("--worlds {}: give the most bodies behind the colon, as in cpu:100000", text));
  }
  return wish;
}

std::vector<WorldWish> parseWorlds(const std::vector<std::string>& worlds) {
  std::vector<WorldWish> wishes;
  for (const auto& text : worlds) {
    const WorldWish wish = parseWorld(text);
    for (const WorldWish& other : wishes) {
      if (other.name == wish.name) throw InputError(fmt::format("--worlds: {} twice; name each world once", wish.name));
    }
    wishes.push_back(wish);
  }
  return wishes;
}

// Throws if a world that needs a device has none, before anything is run.
void checkDevices(const BenchOptions& options, const std::vector<WorldWish>& worlds) {
  if (std::all_of(worlds.begin(), worlds.end(), [](const WorldWish& w) { return w.name == "cpu"; })) return;
  std::vector<EngineInfo> devices;
  std::string error;
  if (!listDevices(devices, error)) throw std::runtime_error(error);
  if (devices.empty()) {
    throw std::runtime_error(
        "no OpenCL device: install a driver, for example the package pocl-opencl-icd, or measure --worlds cpu");
  }
  checkDevice(options.device);
}

Run runOf(const scenes::Scene& scene, scenes::Size size) {
  return {scene.name, fmt::format("{},{},{}", size.x, size.y, size.z), builderOf(scene, size), scene.timeStep,
          scene.benchmark.steps};
}

void addRuns(const scenes::Scene& scene, const BenchArguments& arguments, bool named, std::vector<Run>& runs) {
  if (!arguments.size.empty()) {
    runs.push_back(runOf(scene, parseSize(arguments.size)));
  } else if (arguments.bodies.empty()) {
    runs.push_back(runOf(scene, scene.benchmark.size));
  } else if (scene.benchmark.sizeFor) {
    for (const int bodies : arguments.bodies) runs.push_back(runOf(scene, scene.benchmark.sizeFor(bodies)));
  } else if (named) {
    throw InputError(fmt::format("--bodies: {} has no room to grow; give its --size", scene.name));
  }
}

std::vector<Run> runsOf(const BenchArguments& arguments) {
  std::vector<Run> runs;
  for (const auto& name : arguments.scenes) {
    if (name == "all") {
      for (const auto* list : {&scenes::all(), &scenes::big()}) {
        for (const scenes::Scene& scene : *list) addRuns(scene, arguments, false, runs);
      }
    } else if (isBulletFile(name)) {
      if (!arguments.size.empty()) throw InputError("--size does not go with a .bullet file: it has its own");
      if (!arguments.bodies.empty()) throw InputError("--bodies does not go with a .bullet file: it has its own");
      runs.push_back({name, "", builderOfFile(name)});
    } else {
      addRuns(sceneNamed(name), arguments, true, runs);
    }
  }
  return runs;
}

// The worlds that may have so many bodies; the others are noted.
std::vector<std::string> worldsFor(const std::vector<WorldWish>& wishes, const Run& run,
                                   std::vector<std::string>& leftOut) {
  const bool anyLimit = std::any_of(wishes.begin(), wishes.end(), [](const WorldWish& w) {
    return w.mostBodies != std::numeric_limits<long>::max();
  });
  const int bodies = anyLimit ? countBodies(run.build) : 0;
  std::vector<std::string> names;
  for (const WorldWish& wish : wishes) {
    if (bodies <= wish.mostBodies) {
      names.push_back(wish.name);
    } else {
      leftOut.push_back(fmt::format("{}: left out, more than {} bodies", wish.name, wish.mostBodies));
    }
  }
  return names;
}

BenchResult measure(const Run& run, const std::vector<WorldWish>& wishes, BenchOptions options, int steps) {
  std::vector<std::string> leftOut;
  options.worlds = worldsFor(wishes, run, leftOut);
  options.timeStep = run.timeStep;
  options.steps = steps > 0 ? steps : run.steps;
  ProgressBar bar("bench " + run.scene, benchSteps(options));
  options.progress = [&bar](int done) { bar.show(done); };
  BenchResult result;
  try {
    result = bench(run.scene, run.build, options);
  } catch (const std::runtime_error& e) {  // InputError is one
    if (!options.leaveOut) throw;
    result.scene = run.scene;
    result.options = options;
    result.error = e.what();
  }
  result.size = run.size;
  result.leftOut.insert(result.leftOut.begin(), leftOut.begin(), leftOut.end());
  return result;
}

void saveFiles(const BenchArguments& arguments, const std::vector<BenchResult>& results) {
  if (!arguments.csv.empty()) writeFile(arguments.csv, toCsv(results));
  if (!arguments.json.empty()) writeFile(arguments.json, toJson(results));
}

bool isPairs(const std::string& scene) { return scene == "pairs"; }

int runPairs(const BenchArguments& arguments) {
  if (arguments.scenes.size() > 1) throw InputError("--scene pairs goes alone: its worlds are others");
  if (!arguments.size.empty()) throw InputError("--scene pairs has --bodies instead of a --size");
  if (!arguments.json.empty()) throw InputError("--scene pairs writes --csv, no --json");
  PairsBenchArguments pairs = arguments.pairs;
  if (arguments.worlds != BenchArguments().worlds) pairs.worlds = arguments.worlds;
  pairs.bodies = arguments.bodies;
  pairs.steps = arguments.steps;
  pairs.device = arguments.options.device;
  pairs.csv = arguments.csv;
  return runPairsBench(pairs);
}

int runBenchCommand(const BenchArguments& arguments) {
  if (std::any_of(arguments.scenes.begin(), arguments.scenes.end(), isPairs)) return runPairs(arguments);
  BenchOptions options = arguments.options;
  options.contacts = arguments.contacts == "on";
  options.hostQueries = arguments.hostQueries == "on";
  options.sleeping = arguments.sleeping != "off";
  options.watchSleepers = arguments.sleeping != "unwatched";
  options.motionStates = arguments.motionStates == "on";
  options.stages = arguments.stages == "on";
  const std::vector<WorldWish> wishes = parseWorlds(arguments.worlds);
  const std::vector<Run> runs = runsOf(arguments);
  checkDevices(options, wishes);
  options.leaveOut = runs.size() > 1;
  std::vector<BenchResult> results;
  for (const Run& run : runs) {
    results.push_back(measure(run, wishes, options, arguments.steps));
    fmt::print("{}{}", results.size() > 1 ? "\n" : "", toText(results.back()));
    std::fflush(stdout);
    saveFiles(arguments, results);  // after each run: a later one may be too large for the machine
  }
  if (runs.size() > 1) fmt::print("\n{}", toTable(results));
  std::fflush(stdout);
  return std::any_of(results.begin(), results.end(), [](const BenchResult& r) { return !r.error.empty(); }) ? kFailed
                                                                                                            : kAgreed;
}

}  // namespace

Command addBenchCommand(CLI::App& tool) {
  const auto a = std::make_shared<BenchArguments>();
  CLI::App* bench = tool.add_subcommand("bench", "time the steps of btgpu and of other worlds in one run");
  const CLI::IsMember onOff({"on", "off"});
  bench
      ->add_option(
          "--scene", a->scenes,
          "built-in scenes, all of them (all), or .bullet files; or pairs: the ways of finding pairs by themselves, on "
          "AABBs without a world (docs/benchmarks.md)")
      ->delimiter(',')
      ->capture_default_str();
  auto* size = bench->add_option("--size", a->size, "size of the built-in scenes, as X,Y,Z; left out: that of each");
  size->check(kNotEmpty);
  bench->add_option("--bodies", a->bodies, "instead of a size, about so many bodies; several: a run each")
      ->delimiter(',')
      ->check(CLI::Range(1, 4'000'000))
      ->excludes(size);
  bench->add_option("--steps", a->steps, "steps to run; the second half is measured. Left out: the scene's own number")
      ->check(CLI::Range(2, 10'000'000));
  bench
      ->add_option("--worlds", a->worlds,
                   "which of gpu, cpu (stock Bullet), bullet3 (its OpenCL pipeline); cpu:100000 leaves cpu out of runs "
                   "with more bodies than that. With --scene pairs, of bvh, grid, sweep, incremental, brute_force and "
                   "dbvt (btDbvtBroadphase); left out: all")
      ->delimiter(',')
      ->capture_default_str();
  bench->add_option("--contacts", a->contacts, "keep the dispatcher's manifolds current")
      ->check(onOff)
      ->capture_default_str();
  bench->add_option("--host-queries", a->hostQueries, "keep the host's broadphase current")
      ->check(onOff)
      ->capture_default_str();
  bench
      ->add_option("--sleeping", a->sleeping,
                   "let bodies sleep; unwatched: and while all do, notice only which are activated")
      ->check(CLI::IsMember({"on", "off", "unwatched"}))
      ->capture_default_str();
  bench->add_option("--motion-states", a->motionStates, "give each body a btDefaultMotionState")
      ->check(onOff)
      ->capture_default_str();
  bench->add_option("--stages", a->stages, "time the device's stages too, in a run of their own")
      ->check(onOff)
      ->capture_default_str();
  addPairsOptions(*bench, a->pairs);
  addSolverOption(*bench, a->options.solver);
  bench->add_option("--device", a->options.device, "OpenCL device: index, gpu, cpu or part of its name");
  bench->add_option("--csv", a->csv, "write a line a run and world to this file")->check(kNotEmpty);
  bench->add_option("--json", a->json, "write the results to this file")->check(kNotEmpty);
  return {bench, [a] { return runBenchCommand(*a); }};
}

}  // namespace btgpu::tool
