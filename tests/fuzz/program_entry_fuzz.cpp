// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "readers.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  const btgpu::Bytes bytes(data, data + size);
  btgpu::fuzz::tryProgramEntry(bytes);
  btgpu::fuzz::tryMendedProgramEntry(bytes);
  return 0;
}
