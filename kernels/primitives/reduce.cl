// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Sum of uints in two launches: one partial result a group, then the partial results. Groups own contiguous
// chunks, so the grid does not depend on the count. (Minimum and maximum of AABBs: stage 30.)
#include "../lib/group_scan.h"

#ifdef BTGPU_SHAPE_CPU

KERNEL reducePartial(uint capacity, __global const uint* counter, __global const uint* data, __global uint* partial) {
  const uint count = itemCount(capacity, counter);
  uint sum = 0;
  FOR_EACH(i, count) sum += data[i];
  partial[get_group_id(0)] = sum;
}

KERNEL reduceFinal(uint groups, __global const uint* partial, __global uint* result) {
  if (get_global_id(0) != 0) return;
  uint sum = 0;
  for (uint g = 0; g < groups; ++g) sum += partial[g];
  *result = sum;
}

#else

KERNEL reducePartial(uint capacity, __global const uint* counter, __global const uint* data, __global uint* partial) {
  __local uint scratch[GROUP_SIZE];
  const uint count = itemCount(capacity, counter);
  const uint end = CHUNK_BEGIN(count, get_group_id(0) + 1, get_num_groups(0));
  uint sum = 0;
  for (uint i = CHUNK_BEGIN(count, get_group_id(0), get_num_groups(0)) + get_local_id(0); i < end; i += GROUP_SIZE) {
    sum += data[i];
  }
  sum = groupSum(sum, scratch);
  if (get_local_id(0) == 0) partial[get_group_id(0)] = sum;
}

KERNEL reduceFinal(uint groups, __global const uint* partial, __global uint* result) {
  __local uint scratch[GROUP_SIZE];
  if (get_group_id(0) != 0) return;
  uint sum = 0;
  for (uint g = get_local_id(0); g < groups; g += GROUP_SIZE) sum += partial[g];
  sum = groupSum(sum, scratch);
  if (get_local_id(0) == 0) *result = sum;
}

#endif
