// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The fuzzer of .bullet files without a fuzzer: its corpus. tools/damaged_files does the same with the whole tool.
#include "tests/fuzz/bullet_files.h"

#include <gtest/gtest.h>

namespace btgpu {
namespace {

// Files whose names begin with "good" are taken, all others refused.
TEST(BulletFiles, Corpus) {
  const test::TemporaryFolder folder;
  int good = 0, bad = 0;
  for (const auto& entry : std::filesystem::directory_iterator(BTGPU_SOURCE_DIR "/tests/fuzz/corpus/bullet_file")) {
    const std::string text = test::readFile(entry.path()), name = entry.path().filename().string();
    const bool isGood = name.rfind("good", 0) == 0;
    EXPECT_EQ(fuzz::tryBulletFile({text.begin(), text.end()}, folder.file("tried.bullet")), isGood) << name;
    ++(isGood ? good : bad);
  }
  EXPECT_GT(good, 0);
  EXPECT_GT(bad, 0);
}

}  // namespace
}  // namespace btgpu
