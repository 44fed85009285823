// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench_worlds.h"

namespace btgpu::tool {

struct BenchOptions {
  std::vector<std::string> worlds = {"gpu", "cpu"};  // of benchWorldNames()
  double timeStep = 1.0 / 60.0;
  int steps = 120;  // the second half is measured, the first lets programs be built, arrays grow, things fall
  std::string device;
  bool contacts = true, hostQueries = true, sleeping = false;
  std::function<void(int)> progress;  // called with the number of steps done, of benchSteps()
};

struct BenchStage {
  std::string stage;
  double ms = 0, launches = 0;  // a step
};

struct BenchRow {
  std::string world, device, scene;
  int bodies = 0;
  double msMedian = 0, msP95 = 0;  // of a step, on the host's clock
  StepSplit split;                 // medians
  StepCounts counts;               // of the last step
  std::vector<BenchStage> stages;  // by device events, in a run of their own
};

struct BenchResult {
  std::string scene;
  BenchOptions options;
  std::vector<BenchRow> rows;
};

const std::vector<std::string>& benchWorldNames();
int benchSteps(const BenchOptions& options);

// Steps all worlds in turn: what disturbs the machine disturbs all of them. Throws InputError for a scene that a world
// can't hold, std::runtime_error if one of them did not run where it should.
BenchResult bench(const std::string& scene, const Builder& build, const BenchOptions& options);

std::string toText(const BenchResult& result);
std::string toJson(const BenchResult& result);
std::string toCsv(const BenchResult& result);

}  // namespace btgpu::tool
