// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "bullet_file.h"

namespace btgpu::tool {
namespace {

struct Candidate {
  std::string name;
  std::unique_ptr<BenchWorld> world;
  std::vector<double> ms, deviceMs, translateMs, restMs;  // of the steps that are measured
};

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  return values[static_cast<size_t>(std::max(1.0, rank)) - 1];
}

std::optional<double> median(const std::vector<double>& values) {
  return values.empty() ? std::optional<double>() : quantile(values, 0.5);
}

btGpuSettings gpuSettings(const BenchOptions& options, bool profile) {
  btGpuSettings settings;
  settings.m_device = options.device;
  settings.m_solver = options.solver;
  settings.m_hostQueries = options.hostQueries;
  settings.m_contacts = options.contacts;
  settings.m_watchSleepers = options.watchSleepers;
  settings.m_profile = profile;
  return settings;
}

std::unique_ptr<BenchWorld> makeWorld(const std::string& name, const Builder& build, const BenchOptions& options) {
  const btScalar dt = static_cast<btScalar>(options.timeStep);
  if (name == "gpu") return makeGpuWorld(build, gpuSettings(options, false), dt);
  if (name == "cpu") return makeCpuWorld(build, dt);
  return makeBullet3World(build, options.device, dt);
}

int firstMeasured(const BenchOptions& options) { return options.steps / 2; }

void stepMeasured(Candidate& c, bool measured) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  c.world->step();
  const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  if (!measured) return;
  c.ms.push_back(ms);
  const StepSplit split = c.world->split();
  if (split.deviceMs) c.deviceMs.push_back(*split.deviceMs);
  if (split.translateMs) c.translateMs.push_back(*split.translateMs);
  if (split.deviceMs && split.translateMs) c.restMs.push_back(std::max(0.0, ms - *split.deviceMs - *split.translateMs));
}

void checkWorld(const std::string& name, const BenchWorld& world) {
  const std::string failure = world.failure();
  if (!failure.empty()) throw std::runtime_error(fmt::format("{}: not measured: {}", name, failure));
}

std::vector<BenchStage> profileStages(const Builder& build, const BenchOptions& options, int stepsDone) {
  const auto world = makeGpuWorld(build, gpuSettings(options, true), static_cast<btScalar>(options.timeStep));
  for (int step = 0; step < options.steps; ++step) {
    if (step == firstMeasured(options)) takeProfile(*world);
    world->step();
    if (options.progress) options.progress(stepsDone + step + 1);
  }
  checkWorld("gpu", *world);
  std::vector<BenchStage> stages;
  const double steps = options.steps - firstMeasured(options);
  for (const auto& t : takeProfile(*world)) {
    stages.push_back({t.m_stage, t.m_milliseconds / steps, t.m_launches / steps});
  }
  return stages;
}

std::vector<Candidate> makeCandidates(const Builder& build, const BenchOptions& options,
                                      std::vector<std::string>& leftOut) {
  std::vector<Candidate> candidates;
  for (const auto& name : options.worlds) {
    try {
      candidates.push_back({name, makeWorld(name, build, options), {}, {}, {}, {}});
    } catch (const InputError& e) {
      if (!options.leaveOut) throw;
      leftOut.push_back(e.what());
    }
  }
  return candidates;
}

}  // namespace

const std::vector<std::string>& benchWorldNames() {
  static const std::vector<std::string> names = {"gpu", "cpu", "bullet3"};
  return names;
}

int countBodies(const Builder& build) {
  TestWorld<btDiscreteDynamicsWorld> world(build);
  return world.world().getNumCollisionObjects();
}

int benchSteps(const BenchOptions& options) {
  const auto& w = options.worlds;
  return options.steps * (options.stages && std::find(w.begin(), w.end(), "gpu") != w.end() ? 2 : 1);
}

BenchResult bench(const std::string& scene, const Builder& sceneBuild, const BenchOptions& options) {
  const Builder awake = options.sleeping ? sceneBuild : withoutSleeping(sceneBuild);
  const Builder build = options.motionStates ? withMotionStates(awake) : awake;
  BenchResult result;
  result.scene = scene;
  result.options = options;
  std::vector<Candidate> candidates = makeCandidates(build, options, result.leftOut);
  for (int step = 0; step < options.steps; ++step) {
    for (Candidate& c : candidates) stepMeasured(c, step >= firstMeasured(options));
    if (step == 0) {
      for (const Candidate& c : candidates) checkWorld(c.name, *c.world);
    }
    if (options.progress) options.progress(step + 1);
  }
  for (Candidate& c : candidates) {
    checkWorld(c.name, *c.world);
    BenchRow row;
    row.world = c.name;
    row.device = c.world->device();
    row.driver = c.world->driver();
    row.scene = scene;
    row.bodies = c.world->bodies();
    row.msMedian = quantile(c.ms, 0.5);
    row.msP95 = quantile(c.ms, 0.95);
    row.split = {median(c.deviceMs), median(c.translateMs)};
    row.restMs = median(c.restMs);
    row.counts = c.world->counts();
    row.end = c.world->end();
    result.rows.push_back(row);
  }
  candidates.clear();
  for (BenchRow& row : result.rows) {
    if (options.stages && row.world == "gpu") row.stages = profileStages(build, options, options.steps);
  }
  return result;
}

}  // namespace btgpu::tool
