// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench_worlds.h"

namespace btgpu::tool {

struct BenchOptions {
  std::vector<std::string> worlds = {"gpu", "cpu"};  // of benchWorldNames()
  double timeStep = 1.0 / 60.0;
  int steps = 120;  // the second half is measured, the first lets programs be built, arrays grow, things fall
  std::string device;
  btGpuSolver solver = btGpuSolver::Parity;
  bool contacts = true, hostQueries = true, sleeping = false, motionStates = false;
  bool watchSleepers = true;
  bool stages = true;                 // times the device's stages, in a run of their own
  bool leaveOut = false;              // a world that can't hold the scene is left out
  std::function<void(int)> progress;  // called with the number of steps done, of benchSteps()
};

struct BenchStage {
  std::string stage;
  double ms = 0, launches = 0;  // a step
};

struct BenchRow {
  std::string world, device, driver, scene;
  int bodies = 0;
  double msMedian = 0, msP95 = 0;  // of a step, on the host's clock
  StepSplit split;                 // medians
  std::optional<double> restMs;    // median of what is in neither part of the split
  StepCounts counts;               // of the last step
  std::optional<EndFigures> end;   // after it
  std::vector<BenchStage> stages;  // by device events, in a run of their own
};

struct BenchResult {
  std::string scene, size;  // size: "8,8,8", of a built-in scene
  BenchOptions options;
  std::vector<BenchRow> rows;
  std::vector<std::string> leftOut;  // why worlds are not in the rows
  std::string error;                 // why there are no rows
};

const std::vector<std::string>& benchWorldNames();
int benchSteps(const BenchOptions& options);

// Steps all worlds in turn: what disturbs the machine disturbs all of them. Throws InputError for a scene that a world
// can't hold, unless that is to be left out; std::runtime_error if a world did not run where it should.
BenchResult bench(const std::string& scene, const Builder& build, const BenchOptions& options);

int countBodies(const Builder& build);

std::string toText(const BenchResult& result);
// One line a run and world.
std::string toTable(const std::vector<BenchResult>& results);
std::string toJson(const std::vector<BenchResult>& results);
std::string toCsv(const std::vector<BenchResult>& results);

}  // namespace btgpu::tool
