// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"

// data[first .. first + count) = value.
KERNEL fillUint(uint first, uint count, uint value, __global uint* data) {
  FOR_EACH(i, count) data[first + i] = value;
}
