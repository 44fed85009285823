// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Prefix sum over the lanes of one work-group, and the chunk of a group. Device only.
#ifndef BTGPU_LIB_GROUP_SCAN_H
#define BTGPU_LIB_GROUP_SCAN_H
#include "kernel.h"

#define CHUNK_BEGIN(count, group, groups) ((uint)((ulong)(count) * (group) / (groups)))

// The items of the group's chunk.
#ifdef BTGPU_SHAPE_CPU
#define FOR_CHUNK(i, count) FOR_EACH(i, count)
#else
#define FOR_CHUNK(i, count)                                                                     \
  for (uint i = CHUNK_BEGIN(count, get_group_id(0), get_num_groups(0)) + get_local_id(0),       \
            i##_end = CHUNK_BEGIN(count, get_group_id(0) + 1, get_num_groups(0));               \
       i < i##_end; i += GROUP_SIZE)
#endif

#ifdef BTGPU_SHAPE_GPU
// Sum of `value` over all lower lanes; *total gets the sum of all lanes. `scratch` has GROUP_SIZE elements and
// may be reused at once: the function ends with a barrier. All lanes must call it.
static inline uint groupExclusiveScan(uint value, __local uint* scratch, uint* total) {
  const uint lane = get_local_id(0);
  scratch[lane] = value;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint step = 1; step < GROUP_SIZE; step *= 2) {
    const uint below = lane >= step ? scratch[lane - step] : 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    scratch[lane] += below;
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  const uint inclusive = scratch[lane];
  *total = scratch[GROUP_SIZE - 1];
  barrier(CLK_LOCAL_MEM_FENCE);
  return inclusive - value;
}

// Sum of `value` over all lanes, which must all call it; `scratch` as above.
static inline uint groupSum(uint value, __local uint* scratch) {
  const uint lane = get_local_id(0);
  scratch[lane] = value;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint half_ = GROUP_SIZE / 2; half_ > 0; half_ /= 2) {
    if (lane < half_) scratch[lane] += scratch[lane + half_];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  const uint total = scratch[0];
  barrier(CLK_LOCAL_MEM_FENCE);
  return total;
}

// sums[0] + ... + sums[count - 1], for all lanes, which must all call it.
static inline uint groupSumBelow(__global const uint* sums, uint count, __local uint* scratch) {
  uint sum = 0;
  for (uint i = get_local_id(0); i < count; i += GROUP_SIZE) sum += sums[i];
  return groupSum(sum, scratch);
}
#endif

// The sum over a group in a kernel of both shapes, which begins with SCRATCH.
#ifdef BTGPU_SHAPE_CPU
#define SCRATCH
#define GROUP_SUM(value) (value)
#else
#define SCRATCH __local uint scratch[GROUP_SIZE]
#define GROUP_SUM(value) groupSum(value, scratch)
#endif

#endif
