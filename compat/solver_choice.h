// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "../gpu_engine/step_settings.h"
#include "btGpuDynamicsWorld.h"

namespace btgpu {

// "parity", "fast", ..., as in BTGPU_SOLVER and the tool's --solver.
const std::vector<std::pair<std::string, btGpuSolver>>& solverNames();
const char* nameOf(btGpuSolver solver);

// As the settings say, else the environment.
Solver solverOf(const btGpuSettings& settings);
// The part of a step by which the rows of joints are to be ahead of its start.
double jointLead(const btGpuSettings& settings);
// Into the settings of a step, with all that belongs to a solver.
void chooseSolver(const btGpuSettings& settings, StepSettings& step);

}  // namespace btgpu
