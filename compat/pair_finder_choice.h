// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "../gpu_engine/step_settings.h"
#include "btGpuDynamicsWorld.h"

namespace btgpu {

// "bvh", "grid", ..., as in BTGPU_PAIR_FINDER.
const std::vector<std::pair<std::string, PairFinder>>& pairFinderNames();

// As the settings say, else the environment.
PairFinder pairFinderOf(const btGpuSettings& settings);

}  // namespace btgpu
