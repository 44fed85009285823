// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the commands' arguments have in common. Everything here throws InputError (bullet_file.h).
#pragma once

#include <CLI/CLI.hpp>

#include <string>

#include "compat/btGpuDynamicsWorld.h"
#include "samples/scenes/scene.h"

namespace btgpu::tool {

scenes::Size parseSize(const std::string& text);
const scenes::Scene& sceneNamed(const std::string& name);

// A device that was asked for by name and is not to be had is bad usage; no device at all is not.
void checkDevice(const std::string& wish);

void addSolverOption(CLI::App& command, btGpuSolver& solver);

void writeFile(const std::string& path, const std::string& text);

}  // namespace btgpu::tool
