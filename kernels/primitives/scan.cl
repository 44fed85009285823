// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Exclusive prefix sum of uints, in three launches over a fixed number of chunks: sum of each chunk, scan of the
// chunk sums (which also gives the total), scan of each chunk from its base. Sums wrap at 2^32 as in C.
#include "../lib/group_scan.h"

#ifdef BTGPU_SHAPE_CPU

KERNEL scanChunkSums(uint capacity, __global const uint* counter, __global const uint* in, __global uint* chunkSums) {
  const uint count = itemCount(capacity, counter);
  uint sum = 0;
  FOR_EACH(i, count) sum += in[i];
  chunkSums[get_global_id(0)] = sum;
}

KERNEL scanChunkBases(uint chunks, __global uint* chunkSums, __global uint* total) {
  if (get_global_id(0) != 0) return;
  uint sum = 0;
  for (uint c = 0; c < chunks; ++c) {
    const uint next = sum + chunkSums[c];
    chunkSums[c] = sum;
    sum = next;
  }
  *total = sum;
}

KERNEL scanChunks(uint capacity, __global const uint* counter, __global const uint* in,
                  __global const uint* chunkBases, __global uint* out) {
  const uint count = itemCount(capacity, counter);
  uint sum = chunkBases[get_global_id(0)];
  FOR_EACH(i, count) {
    const uint value = in[i];
    out[i] = sum;
    sum += value;
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
  uint total;
  groupExclusiveScan(sum, scratch, &total);
  if (get_local_id(0) == 0) chunkSums[get_group_id(0)] = total;
}

// One group; walks the chunk sums in tiles of its own size.
KERNEL scanChunkBases(uint chunks, __global uint* chunkSums, __global uint* total) {
  __local uint scratch[GROUP_SIZE];
  if (get_group_id(0) != 0) return;
  uint base = 0;
  for (uint tile = 0; tile < chunks; tile += GROUP_SIZE) {
    const uint i = tile + get_local_id(0);
    uint tileTotal;
    const uint before = groupExclusiveScan(i < chunks ? chunkSums[i] : 0, scratch, &tileTotal);
    if (i < chunks) chunkSums[i] = base + before;
    base += tileTotal;
  }
  if (get_local_id(0) == 0) *total = base;
}

KERNEL scanChunks(uint capacity, __global const uint* counter, __global const uint* in,
                  __global const uint* chunkBases, __global uint* out) {
  __local uint scratch[GROUP_SIZE];
  const uint count = itemCount(capacity, counter);
  const uint end = CHUNK_BEGIN(count, get_group_id(0) + 1, get_num_groups(0));
  uint base = chunkBases[get_group_id(0)];
  for (uint tile = CHUNK_BEGIN(count, get_group_id(0), get_num_groups(0)); tile < end; tile += GROUP_SIZE) {
    const uint i = tile + get_local_id(0);
    uint tileTotal;
    const uint before = groupExclusiveScan(i < end ? in[i] : 0, scratch, &tileTotal);
    if (i < end) out[i] = base + before;
    base += tileTotal;
  }
}

#endif
