// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Histogram of small keys in two launches: a table a group, [bin][group], then the sum over the groups.
// Deterministic: the counts do not depend on the order. Keys outside [0, bins) are not counted.
#include "../lib/group_scan.h"

#ifdef BTGPU_SHAPE_CPU

KERNEL histogramTables(uint capacity, __global const uint* counter, uint bins, __global const uint* keys,
                       __global uint* tables) {
  const uint count = itemCount(capacity, counter);
  const uint groups = get_num_groups(0), group = get_group_id(0);
  for (uint b = 0; b < bins; ++b) tables[b * groups + group] = 0;
  FOR_EACH(i, count) {
    if (keys[i] < bins) tables[keys[i] * groups + group] += 1;
  }
}

#else

KERNEL histogramTables(uint capacity, __global const uint* counter, uint bins, __global const uint* keys,
                       __global uint* tables) {
  const uint count = itemCount(capacity, counter);
  const uint groups = get_num_groups(0), group = get_group_id(0);
  for (uint b = get_local_id(0); b < bins; b += GROUP_SIZE) tables[b * groups + group] = 0;
  barrier(CLK_GLOBAL_MEM_FENCE);
  const uint end = CHUNK_BEGIN(count, group + 1, groups);
  for (uint i = CHUNK_BEGIN(count, group, groups) + get_local_id(0); i < end; i += GROUP_SIZE) {
    if (keys[i] < bins) atomic_inc(&tables[keys[i] * groups + group]);
  }
}

#endif

KERNEL histogramSum(uint bins, uint groups, __global const uint* tables, __global uint* histogram) {
  FOR_EACH(b, bins) {
    uint sum = 0;
    for (uint g = 0; g < groups; ++g) sum += tables[b * groups + g];
    histogram[b] = sum;
  }
}
