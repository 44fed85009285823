// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Scenes from .bullet files, read with Bullet's own importer, which takes files of float and of double worlds but does
// not survive all damaged ones: work on a file runs in a child process (runGuarded).
#pragma once

#include <functional>
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

// Builder of the file's world. Each call reads the file and checks it: at least one body, indices in range, sizes and
// poses finite. Throws InputError.
Builder builderOfFile(const std::string& path);

// Writes a built-in scene with Bullet's serializer. Throws InputError if the file can't be written.
void writeBulletFile(const scenes::Scene& scene, scenes::Size size, const std::string& path);

// Runs `work` in a child process and returns its exit status. `work` calls its argument once the file has been read;
// if the child dies before, an InputError names the file, after it a std::runtime_error says so.
int runGuarded(const std::string& path, const std::function<int(const std::function<void()>& fileWasRead)>& work);

}  // namespace btgpu::tool
