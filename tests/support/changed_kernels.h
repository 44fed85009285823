// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <gtest/gtest.h>

#include "tests/support/subprocess.h"

namespace btgpu::test {

// A copy of the kernels with one piece of text changed, for BTGPU_KERNEL_DIR.
class ChangedKernels {
 public:
  ChangedKernels(const std::string& file, const std::string& old, const std::string& changed) {
    namespace fs = std::filesystem;
    fs::copy(BTGPU_SOURCE_DIR "/kernels", m_folder.path() / "kernels", fs::copy_options::recursive);
    const fs::path path = m_folder.path() / "kernels" / file;
    std::string text = readFile(path);
    const size_t at = text.find(old);
    EXPECT_NE(at, std::string::npos) << file << " has no " << old;
    if (at != std::string::npos) writeFile(path, text.replace(at, old.size(), changed));
  }
  std::string path() const { return m_folder.path().string(); }

 private:
  TemporaryFolder m_folder;
};

}  // namespace btgpu::test
