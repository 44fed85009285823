// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"

// Index of the first element of sorted data[0, count) that is not below (or, if `upper`, is above) `key`.
static uint bound(__global const uint* data, uint count, uint key, uint upper) {
  uint first = 0;
  while (count > 0) {
    const uint half_ = count / 2;
    const uint value = data[first + half_];
    if (value < key || (upper && value == key)) {
      first += half_ + 1;
      count -= half_ + 1;
    } else {
      count = half_;
    }
  }
  return first;
}

// bounds[k] = lower (or upper) bound of key k in the sorted data, for k in [0, keyCount).
KERNEL boundSearch(uint capacity, __global const uint* counter, uint keyCount, uint upper, __global const uint* data,
                   __global uint* bounds) {
  const uint count = itemCount(capacity, counter);
  FOR_EACH(key, keyCount) bounds[key] = bound(data, count, key, upper);
}
