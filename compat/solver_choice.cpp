// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "solver_choice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <sstream>

#include "environment.h"

namespace btgpu {
namespace {

Solver engineSolver(btGpuSolver solver) {
  switch (solver) {
    case btGpuSolver::Fast:
      return Solver::Fast;
    case btGpuSolver::MassSplitting:
      return Solver::MassSplitting;
    case btGpuSolver::TwoLevel:
      return Solver::TwoLevel;
    case btGpuSolver::Parity:
      break;
  }
  return Solver::Parity;
}

// BTGPU_TWO_LEVEL: words in any order.
struct TwoLevelWords {
  GroupSplit split = GroupSplit::Index;
  BatchLaunches launches = BatchLaunches::Phase;
};

TwoLevelWords twoLevelWords() {
  TwoLevelWords words;
  const char* wanted = environment("BTGPU_TWO_LEVEL");
  std::istringstream list(wanted ? wanted : "");
  for (std::string word; std::getline(list, word, ',');) {
    if (word == "space" || word == "index") {
      words.split = word == "space" ? GroupSplit::Space : GroupSplit::Index;
    } else if (word == "phase" || word == "batch") {
      words.launches = word == "phase" ? BatchLaunches::Phase : BatchLaunches::Batch;
    } else {
      static std::once_flag said;
      std::call_once(said, [&word] {
        std::fprintf(stderr, "btgpu: BTGPU_TWO_LEVEL: what is %s? space or index and phase or batch are known\n",
                     word.c_str());
      });
    }
  }
  return words;
}

GroupSplit groupSplitOf(const btGpuSettings& settings) {
  if (!settings.m_groupSplit) return twoLevelWords().split;
  return *settings.m_groupSplit == btGpuGroupSplit::Index ? GroupSplit::Index : GroupSplit::Space;
}

BatchLaunches batchLaunchesOf(const btGpuSettings& settings) {
  if (!settings.m_batchLaunches) return twoLevelWords().launches;
  return *settings.m_batchLaunches == btGpuBatchLaunches::Batch ? BatchLaunches::Batch : BatchLaunches::Phase;
}

}  // namespace

const std::vector<std::pair<std::string, btGpuSolver>>& solverNames() {
  static const std::vector<std::pair<std::string, btGpuSolver>> names = {{"parity", btGpuSolver::Parity},
                                                                         {"fast", btGpuSolver::Fast},
                                                                         {"mass_splitting", btGpuSolver::MassSplitting},
                                                                         {"two_level", btGpuSolver::TwoLevel}};
  return names;
}

const char* nameOf(btGpuSolver solver) {
  for (const auto& [name, value] : solverNames()) {
    if (value == solver) return name.c_str();
  }
  return "unknown";
}

Solver solverOf(const btGpuSettings& settings) {
  if (settings.m_solver) return engineSolver(*settings.m_solver);
  const char* wanted = environment("BTGPU_SOLVER");
  if (!wanted) return Solver::Parity;
  for (const auto& [name, value] : solverNames()) {
    if (name == wanted) return engineSolver(value);
  }
  static std::once_flag said;
  std::call_once(said, [wanted] {
    std::fprintf(stderr, "btgpu: BTGPU_SOLVER=%s is no solver; parity, fast, mass_splitting, two_level are\n", wanted);
  });
  return Solver::Parity;
}

double jointLead(const btGpuSettings& settings) {
  if (solverOf(settings) != Solver::Fast) return 0;
  // A force that is spread over n substeps moves a body (n + 1) / 2n of what it would if all of it came first.
  const double n = std::clamp(settings.m_fastSubsteps, 1, 64);
  return (n - 1) / (2 * n);
}

void chooseSolver(const btGpuSettings& settings, StepSettings& step) {
  step.solver = solverOf(settings);
  step.groupSplit = groupSplitOf(settings);
  step.batchLaunches = batchLaunchesOf(settings);
  step.substeps = std::clamp(settings.m_fastSubsteps, 1, 64);
  const auto orDefault = [](btScalar wanted, float& value) {
    if (wanted > btScalar(0) && std::isfinite(static_cast<float>(wanted))) value = static_cast<float>(wanted);
  };
  orDefault(settings.m_fastContactHertz, step.contactHertz);
  orDefault(settings.m_fastContactDampingRatio, step.contactDampingRatio);
  orDefault(settings.m_fastPushSpeed, step.pushSpeed);
  orDefault(settings.m_fastJointHertz, step.jointHertz);
  orDefault(settings.m_fastJointDampingRatio, step.jointDampingRatio);
}

}  // namespace btgpu
