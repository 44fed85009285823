// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gpu_engine/engine.h"
#include "translation/oracle/residuals.h"
#include "worlds.h"

namespace btgpu::tool {

constexpr int kConvergedIterations = 1000;

// What a step starts from.
struct StepStart {
  WorldInput input;
  StepSettings settings;
  std::vector<Manifold> cache;  // manifolds after the step before
  std::vector<BodyState> states;
  std::vector<JointState> joints;
};

// Does `step`, a step of the world on the device, and returns what it started from, complete: an engine that knows
// nothing, or has gone on, starts from there.
StepStart recordStep(btGpuDynamicsWorld& world, const std::function<void()>& step);

struct Solved {
  std::vector<Manifold> manifolds;  // with the impulses found
  std::vector<Velocity> velocities;
};

// One of btgpu's solvers, in an engine of its own. Throws InputError if that fails.
class DeviceSolver {
 public:
  DeviceSolver(const std::string& device, Solver solver, GroupSplit split = GroupSplit::Space);
  Solved solve(const StepStart& start, int iterations);
  const StepResults& results() const { return m_results; }

 private:
  std::unique_ptr<Engine> m_engine;
  Solver m_solver;
  GroupSplit m_split;
  WorldInput m_input;
  StepResults m_results;
};

// Stock's solver on btgpu's contacts, in a world of its own. Object i is slot i of the device: nothing may ever leave.
class StockSolver {
 public:
  explicit StockSolver(const Builder& build);
  ~StockSolver();
  // From here on: a step from `start`, with the contacts of `device`, which did it.
  void use(const StepStart& start, const StepResults& device);
  Solved solve(int iterations, bool reversed);
  // rms of what the rows of the step have left of their velocity errors.
  double residualOf(const Solved& solved) const;
  double distance(const Solved& a, const Solved& b) const;

 private:
  std::vector<Manifold> readSolved() const;

  OracleWorld m_oracle;
  std::unique_ptr<SceneContents> m_contents;
  const StepStart* m_start = nullptr;
  std::vector<Manifold> m_contacts;
  std::vector<uint> m_jointSolved;
  size_t m_ofPairs = 0;
  btScalar m_timeStep = 0;
  std::vector<BodyState> m_predicted;
  std::vector<Velocity> m_before;
};

}  // namespace btgpu::tool
