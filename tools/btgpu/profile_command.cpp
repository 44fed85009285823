// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "arguments.h"
#include "bullet_file.h"
#include "commands.h"
#include "compat/profile_text.h"
#include "compat/world_state.h"
#include "progress.h"
#include "worlds.h"

namespace btgpu::tool {
namespace {

struct ProfileArguments {
  std::string scene = "stack", size, device, trace, csv;
  int steps = 120, warmUp = 10;
  bool hostOnly = false;
};

struct ProfiledRun {
  ProfileData data;
  std::string device;
  int bodies = 0;
  unsigned long long stockSteps = 0;
};

ProfiledRun profileScene(const std::string& name, const Builder& build, const ProfileArguments& arguments,
                         double timeStep) {
  btGpuSettings settings;
  settings.m_device = arguments.device;
  settings.m_smallWorld = 0;
  const auto profile = std::make_shared<Profile>();
  TestWorld<btGpuDynamicsWorld> world(build, settings);
  findState(&world.world())->zones.use(profile, !arguments.hostOnly);
  ProgressBar bar("profile " + name, arguments.warmUp + arguments.steps);
  for (int step = 0; step < arguments.warmUp + arguments.steps; ++step) {
    if (step == arguments.warmUp) profile->clear();
    world.world().stepSimulation(static_cast<btScalar>(timeStep), 0);
    bar.show(step + 1);
  }
  const btGpuStatistics statistics = world.world().statistics();
  return {profile->data(), statistics.m_device, world.world().getNumCollisionObjects(), statistics.m_stockSteps};
}

double milliseconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }
double percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

std::string hostTable(const ProfileData& data) {
  const double steps = static_cast<double>(std::max<std::uint64_t>(1, data.steps));
  const std::int64_t all = hostTime(data);
  std::string text = fmt::format("{:<44} {:>8} {:>11} {:>10} {:>11} {:>7}\n", "zone", "calls", "total ms", "ms a step",
                                 "self ms", "share");
  for (const int i : treeOrder(data)) {
    const auto& n = data.nodes[static_cast<size_t>(i)];
    if (n.calls == 0) continue;
    text += fmt::format("{:<44} {:>8} {:>11.3f} {:>10.4f} {:>11.3f} {:>5.1f} %\n",
                        std::string(2 * static_cast<size_t>(n.depth), ' ') + data.name(n.name), n.calls,
                        milliseconds(n.total), milliseconds(n.total) / steps, milliseconds(n.total - n.inChildren),
                        percent(n.total, all));
  }
  return text;
}

std::string deviceLine(const ProfileData& data, const std::string& name, std::uint64_t launches, std::int64_t total) {
  const double steps = static_cast<double>(std::max<std::uint64_t>(1, data.steps));
  return fmt::format("{:<44} {:>8} {:>11.3f} {:>10.4f} {:>11} {:>5.1f} %\n", name, launches, milliseconds(total),
                     milliseconds(total) / steps, "", percent(total, deviceTime(data)));
}

// Stages in the order of their numbers, with their kernels in the order of the first launch.
std::string deviceTable(const ProfileData& data) {
  std::string text = fmt::format("\n{:<44} {:>8} {:>11} {:>10} {:>11} {:>7}\n", "device stage", "launches", "total ms",
                                 "ms a step", "", "share");
  std::map<std::string, std::vector<const ProfileData::Launches*>> stages;
  for (const auto& l : data.launches) {
    if (l.count > 0) stages[data.name(l.stage)].push_back(&l);
  }
  std::uint64_t allLaunches = 0;
  for (const auto& [stage, kernels] : stages) {
    std::uint64_t launches = 0;
    std::int64_t total = 0;
    for (const auto* l : kernels) launches += l->count, total += l->total;
    text += deviceLine(data, stage, launches, total);
    for (const auto* l : kernels)
      text += deviceLine(data, std::string("  ") + data.name(l->kernel), l->count, l->total);
    allLaunches += launches;
  }
  return text + deviceLine(data, "all", allLaunches, deviceTime(data));
}

std::string lastLines(const ProfiledRun& run) {
  const ProfileData& data = run.data;
  std::string text;
  if (run.stockSteps > 0) text += fmt::format("{} steps ran on the CPU: see stockStep\n", run.stockSteps);
  for (const auto& device : data.devices) {
    if (data.launches.empty()) break;
    text += fmt::format("device times lie on the host's axis to within {:.1f} us\n",
                        static_cast<double>(device.accuracy) * 1e-3);
  }
  if (data.lostEvents + data.lostSlices > 0) {
    text += fmt::format("not in the trace: {} calls of zones and {} launches before the last ones\n", data.lostEvents,
                        data.lostSlices);
  }
  return text;
}

void saveTrace(const std::string& path, const ProfileData& data) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  bool done = file != nullptr;
  if (file) {
    writeTrace(file, data);
    done = std::ferror(file) == 0;
    done = std::fclose(file) == 0 && done;
  }
  if (!done) throw InputError(fmt::format("{}: can't be written; check the path", path));
}

int runProfile(const ProfileArguments& a) {
  checkDevice(a.device);
  double timeStep = 1.0 / 60.0;
  std::string name = a.scene;
  Builder build;
  if (isBulletFile(a.scene)) {
    if (!a.size.empty()) throw InputError("--size does not go with a .bullet file: it has its own");
    build = builderOfFile(a.scene);
  } else {
    const scenes::Scene& scene = sceneNamed(a.scene);
    build = builderOf(scene, a.size.empty() ? scene.size : parseSize(a.size));
    timeStep = scene.timeStep;
    name = scene.name;
  }
  const ProfiledRun run = profileScene(name, build, a, timeStep);
  fmt::print("{}: {} bodies, {} steps after {} to warm up, {}\n\n{}{}\n{}", name, run.bodies, run.data.steps, a.warmUp,
             run.device.empty() ? "no device" : run.device, hostTable(run.data),
             run.data.launches.empty() ? "" : deviceTable(run.data), lastLines(run));
  if (!a.trace.empty()) saveTrace(a.trace, run.data);
  if (!a.csv.empty()) writeFile(a.csv, toCsv(run.data));
  std::fflush(stdout);
  return kAgreed;
}

}  // namespace

Command addProfileCommand(CLI::App& tool) {
  const auto a = std::make_shared<ProfileArguments>();
  CLI::App* profile = tool.add_subcommand(
      "profile", "where the time of a step goes: zones of the host and stages of the device (docs/profile.md)");
  profile->add_option("--scene", a->scene, "built-in scene or .bullet file")->capture_default_str();
  profile->add_option("--size", a->size, "size of a built-in scene, as X,Y,Z")->check(kNotEmpty);
  profile->add_option("--steps", a->steps, "steps to profile")->check(CLI::Range(1, 10'000'000))->capture_default_str();
  profile->add_option("--warm-up", a->warmUp, "steps before those; the first one builds the kernels")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  profile->add_flag("--host-only", a->hostOnly, "leave the device's times out: taking them slows the launches");
  profile->add_option("--device", a->device, "OpenCL device: index, gpu, cpu or part of its name");
  profile->add_option("--trace", a->trace, "write a trace for Perfetto to this file")->check(kNotEmpty);
  profile->add_option("--csv", a->csv, "write the tables to this file")->check(kNotEmpty);
  return {profile, [a] { return runProfile(*a); }};
}

}  // namespace btgpu::tool
