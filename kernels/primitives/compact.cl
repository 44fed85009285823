// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"

// Stream compaction, second half: offsets are the exclusive scan of the flags (0 or 1); the indices of flagged
// items are written in ascending order. The bound holds by itself, except after an overflow of the step, when the
// flags were never written.
KERNEL compactScatter(CHECKS uint capacity, __global const uint* counter, __global const uint* flags,
                      __global const uint* offsets, __global uint* indices) {
  const uint count = itemCount(capacity, counter);
  FOR_EACH(i, count) {
    if (flags[i] && offsets[i] < count) AT(indices, offsets[i]) = i;
  }
}

// All of it by one work item.
SINGLE_KERNEL compactByOne(CHECKS uint capacity, __global const uint* counter, __global const uint* flags,
                           __global uint* indices, __global uint* total) {
  const uint count = itemCount(capacity, counter);
  uint next = 0;
  for (uint i = 0; i < count; ++i) {
    if (!flags[i]) continue;
    AT(indices, next) = i;
    ++next;
  }
  *total = next;
}
