// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace btgpu::tool {

// Has the worlds made from now on write hashes of their stages (docs/capture.md): of all steps to a file that the user
// named, or of one step to a file of its own, which goes with this object.
class StageHashFile {
 public:
  explicit StageHashFile(const std::string& wanted);
  explicit StageHashFile(int step);
  ~StageHashFile();
  StageHashFile(const StageHashFile&) = delete;
  StageHashFile& operator=(const StageHashFile&) = delete;

  // What the stages of this step left, in the first world that was made: (stage, hash), in their order. Of a step that
  // was repeated, the last attempt.
  std::vector<std::pair<std::string, std::string>> ofStep(int step) const;

 private:
  std::filesystem::path m_file, m_folder;  // no folder: the user's own file
};

}  // namespace btgpu::tool
