// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Exclusive prefix sum of uints, in two launches over a fixed number of chunks: sum of each chunk; scan of each chunk
// from its base, which everybody sums up for himself, and the total. Sums wrap at 2^32 as in C.
#include "../lib/group_scan.h"

#ifdef BTGPU_SHAPE_CPU

KERNEL scanChunkSums(uint capacity, __global const uint* counter, __global const uint* in, __global uint* chunkSums) {
  const uint count = itemCount(capacity, counter);
  uint sum = 0;
  FOR_EACH(i, count) sum += in[i];
  chunkSums[get_global_id(0)] = sum;
}

KERNEL scanChunks(uint capacity, __global const uint* counter, __global const uint* in,
                  __global const uint* chunkSums, __global uint* out, __global uint* total) {
  const uint count = itemCount(capacity, counter);
  uint sum = 0;
  for (uint c = 0; c < get_global_id(0); ++c) sum += chunkSums[c];
  FOR_EACH(i, count) {
    const uint value = in[i];
    out[i] = sum;
    sum += value;
  }
  if (get_global_id(0) + 1 == get_global_size(0)) *total = sum;
}

// tables[row][i] = sum of the row's elements before i; totals[row] = the sum of all.
KERNEL scanRows(uint rows, uint length, __global uint* tables, __global uint* totals) {
  FOR_EACH(row, rows) {
    uint sum = 0;
    for (uint i = 0; i < length; ++i) {
      const uint value = tables[row * length + i];
      tables[row * length + i] = sum;
      sum += value;
    }
    totals[row] = sum;
  }
}

#else

KERNEL scanChunkSums(uint capacity, __global const uint* counter, __global const uint* in, __global uint* chunkSums) {
  __local uint scratch[GROUP_SIZE];
  const uint count = itemCount(capacity, counter);
  const uint end = CHUNK_BEGIN(count, get_group_id(0) + 1, get_num_groups(0));
  uint sum = 0;
  for (uint i = CHUNK_BEGIN(count, get_group_id(0), get_num_groups(0)) + get_local_id(0); i < end; i += GROUP_SIZE) {
    sum += in[i];
  }
  sum = groupSum(sum, scratch);
  if (get_local_id(0) == 0) chunkSums[get_group_id(0)] = sum;
}

KERNEL scanChunks(uint capacity, __global const uint* counter, __global const uint* in,
                  __global const uint* chunkSums, __global uint* out, __global uint* total) {
  __local uint scratch[GROUP_SIZE];
  const uint count = itemCount(capacity, counter);
  const uint end = CHUNK_BEGIN(count, get_group_id(0) + 1, get_num_groups(0));
  uint base = groupSumBelow(chunkSums, get_group_id(0), scratch);
  for (uint tile = CHUNK_BEGIN(count, get_group_id(0), get_num_groups(0)); tile < end; tile += GROUP_SIZE) {
    const uint i = tile + get_local_id(0);
    uint tileTotal;
    const uint before = groupExclusiveScan(i < end ? in[i] : 0, scratch, &tileTotal);
    if (i < end) out[i] = base + before;
    base += tileTotal;
  }
  if (get_global_id(0) + GROUP_SIZE == get_global_size(0)) *total = base;
}

// tables[row][i] = sum of the row's elements before i; totals[row] = the sum of all. A group a row.
KERNEL scanRows(uint rows, uint length, __global uint* tables, __global uint* totals) {
  __local uint scratch[GROUP_SIZE];
  for (uint row = get_group_id(0); row < rows; row += get_num_groups(0)) {
    uint base = 0;
    for (uint tile = 0; tile < length; tile += GROUP_SIZE) {
      const uint i = tile + get_local_id(0);
      uint tileTotal;
      const uint before = groupExclusiveScan(i < length ? tables[row * length + i] : 0, scratch, &tileTotal);
      if (i < length) tables[row * length + i] = base + before;
      base += tileTotal;
    }
    if (get_local_id(0) == 0) totals[row] = base;
  }
}

#endif
