// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "arguments.h"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>

#include "bullet_file.h"
#include "compat/engine_loader.h"
#include "compat/solver_choice.h"

namespace btgpu::tool {

scenes::Size parseSize(const std::string& text) {
  constexpr long kMost = 4'000'000;  // bodies; more fit no machine that this is built for
  long x = 0, y = 0, z = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%ld,%ld,%ld%c", &x, &y, &z, &rest) != 3 || x < 1 || y < 1 || z < 1) {
    throw InputError(fmt::format("--size {}: give three positive numbers, as in 8,8,8", text));
  }
  if (x > kMost || y > kMost || z > kMost || x * y > kMost || x * y * z > kMost) {
    throw InputError(fmt::format("--size {}: too large; the product may be {} at most", text, kMost));
  }
  return {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
}

const scenes::Scene& sceneNamed(const std::string& name) {
  const scenes::Scene* scene = scenes::find(name);
  if (!scene)
    throw InputError(fmt::format("no scene named {}: 'btgpu scenes' lists them, or give a .bullet file", name));
  return *scene;
}

void checkDevice(const std::string& wish) {
  std::vector<EngineInfo> devices;
  std::string error;
  if (wish.empty() || !listDevices(devices, error) || devices.empty()) return;
  EngineSettings settings;
  settings.device = wish;
  if (!createEngine(settings, error)) throw InputError(fmt::format("--device: {}", error));
}

void addSolverOption(CLI::App& command, btGpuSolver& solver) {
  command.add_option("--solver", solver, "how the device solves contacts and joints")
      ->transform(CLI::CheckedTransformer(solverNames()))
      ->default_str(nameOf(solver));
}

void writeFile(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw InputError(fmt::format("{}: can't be written; check the path", path));
}

}  // namespace btgpu::tool
