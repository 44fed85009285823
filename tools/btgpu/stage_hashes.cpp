// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "stage_hashes.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "arguments.h"
#include "bullet_file.h"

namespace btgpu::tool {
namespace {

constexpr char kFile[] = "BTGPU_STAGE_HASHES", kStep[] = "BTGPU_STAGE_HASHES_STEP";

std::filesystem::path newFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "btgpu-hashes-XXXXXX").string();
  if (!::mkdtemp(name.data())) throw InputError(name + " can't be made; check TMPDIR");
  return name;
}

}  // namespace

// The engine appends to it.
StageHashFile::StageHashFile(const std::string& wanted) : m_file(wanted) {
  writeFile(wanted, "");
  ::setenv(kFile, wanted.c_str(), 1);
  ::unsetenv(kStep);
}

StageHashFile::StageHashFile(int step) : m_folder(newFolder()) {
  m_file = m_folder / "hashes";
  ::setenv(kFile, m_file.c_str(), 1);
  ::setenv(kStep, std::to_string(step).c_str(), 1);
}

StageHashFile::~StageHashFile() {
  std::error_code ignored;
  if (!m_folder.empty()) std::filesystem::remove_all(m_folder, ignored);
}

std::vector<std::pair<std::string, std::string>> StageHashFile::ofStep(int step) const {
  std::vector<std::pair<std::string, std::string>> found;
  std::ifstream in(m_file);
  std::string stage, inputs, outputs;
  for (int world = 0, at = 0; in >> world >> at >> stage >> inputs >> outputs;) {
    if (world != 1 || at != step) continue;
    const auto before =
        std::find_if(found.begin(), found.end(), [&stage](const auto& entry) { return entry.first == stage; });
    if (before == found.end()) {
      found.emplace_back(stage, outputs);
    } else {
      before->second = outputs;
    }
  }
  return found;
}

}  // namespace btgpu::tool
