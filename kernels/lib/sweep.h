// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the sweeps share. OpenCL C only.
#ifndef BTGPU_LIB_SWEEP_H
#define BTGPU_LIB_SWEEP_H
#include "vec.h"

#define PIECE 256u  // places of a range that are one unit of work

// Ascending as the floats are; -0 and 0 are equal, as floats compare.
static inline uint floatKey(float value) {
  const uint bits = as_uint(value + 0.0f);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

// The last k with first[k] <= unit, of ascending first[0, count): which range a piece belongs to.
static inline uint rangeOf(uint unit, uint count, __global const uint* first) {
  uint low = 0, high = count;  // first[low] <= unit < first[high]
  while (high - low > 1) {
    const uint middle = low + (high - low) / 2;
    if (first[middle] <= unit) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

#endif
