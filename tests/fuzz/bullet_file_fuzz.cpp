// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bullet_files.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  static const btgpu::test::TemporaryFolder folder;
  btgpu::fuzz::tryBulletFile({data, data + size}, folder.file("fuzzed.bullet"));
  return 0;
}
