// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "readers.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  const btgpu::Bytes bytes(data, data + size);
  btgpu::fuzz::tryCapture(bytes);
  btgpu::fuzz::tryMendedCapture(bytes);
  return 0;
}
