// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Scenes from .bullet files, read with Bullet's own importer, which takes files of float and of double worlds but does
// not survive all damaged ones, or reads them differently each time.
#pragma once

#include <stdexcept>
#include <string>

#include "worlds.h"

namespace btgpu::tool {

// Bad input: one line that names the cause and the cure. The tool exits with 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

bool isBulletFile(const std::string& name);  // by its ending

// Builder of the file's world. A child process reads the file, checks it (at least one body, sizes, poses and settings
// in range) and writes the world anew; what it wrote is what is built. Throws InputError.
Builder builderOfFile(const std::string& path);

// Writes a built-in scene with Bullet's serializer. Throws InputError if the file can't be written.
void writeBulletFile(const scenes::Scene& scene, scenes::Size size, const std::string& path);

}  // namespace btgpu::tool
