// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// One pass of a stable least-significant-digit radix sort: count the digits of each chunk into tables[digit][chunk], scan
// the table's rows (scanRows in scan.cl), scatter each chunk in order. The digit is (key >> shift) & mask. Built once for
// 32-bit keys and once for 64-bit keys (BTGPU_KEY64). `values` may be null: then only keys are sorted.
#include "../lib/group_scan.h"

#ifdef BTGPU_KEY64
#define Key ulong
#else
#define Key uint
#endif

#define RADIX (1u << RADIX_BITS)
#define DIGIT(key) ((uint)((key) >> shift) & mask)

#ifdef BTGPU_SHAPE_CPU

#define RADIX_BITS 8

KERNEL radixCount(uint capacity, __global const uint* counter, uint shift, uint mask, __global const Key* keys,
                  __global uint* tables) {
  const uint count = itemCount(capacity, counter);
  uint digits[RADIX];
  for (uint d = 0; d <= mask; ++d) digits[d] = 0;
  FOR_EACH(i, count) digits[DIGIT(keys[i])] += 1;
  for (uint d = 0; d <= mask; ++d) tables[d * get_num_groups(0) + get_group_id(0)] = digits[d];
}

KERNEL radixScatter(CHECKS uint capacity, __global const uint* counter, uint shift, uint mask, __global const Key* keys,
                    __global const uint* values, __global const uint* tables, __global const uint* totals,
                    __global Key* keysOut, __global uint* valuesOut) {
  const uint count = itemCount(capacity, counter);
  uint next[RADIX], before = 0;
  for (uint d = 0; d <= mask; ++d) {
    next[d] = before + tables[d * get_num_groups(0) + get_group_id(0)];
    before += totals[d];
  }
  FOR_EACH(i, count) {
    const Key key = keys[i];
    const uint to = next[DIGIT(key)]++;
    AT(keysOut, to) = key;
    if (values) AT(valuesOut, to) = values[i];
  }
}

#else

#define RADIX_BITS 6
#define LANE_ITEMS 16

KERNEL radixCount(uint capacity, __global const uint* counter, uint shift, uint mask, __global const Key* keys,
                  __global uint* tables) {
  __local uint digits[RADIX];
  const uint count = itemCount(capacity, counter);
  const uint groups = get_num_groups(0), group = get_group_id(0);
  for (uint d = get_local_id(0); d < RADIX; d += GROUP_SIZE) digits[d] = 0;
  barrier(CLK_LOCAL_MEM_FENCE);
  const uint end = CHUNK_BEGIN(count, group + 1, groups);
  for (uint i = CHUNK_BEGIN(count, group, groups) + get_local_id(0); i < end; i += GROUP_SIZE) {
    atomic_inc(&digits[DIGIT(keys[i])]);
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint d = get_local_id(0); d <= mask; d += GROUP_SIZE) tables[d * groups + group] = digits[d];
}

// Within a tile every lane owns some consecutive items, so ranks ordered by (digit, lane) are stable.
KERNEL radixScatter(CHECKS uint capacity, __global const uint* counter, uint shift, uint mask, __global const Key* keys,
                    __global const uint* values, __global const uint* tables, __global const uint* totals,
                    __global Key* keysOut, __global uint* valuesOut) {
  __local ushort ranks[RADIX * GROUP_SIZE];  // [digit][lane]: first a count, then the rank of the lane's next item
  __local uint scratch[GROUP_SIZE];
  __local uint next[RADIX];                  // where the tile's first item of a digit goes
  __local uint tileEnd[RADIX];               // rank behind the tile's last item of a digit
  const uint count = itemCount(capacity, counter);
  const uint groups = get_num_groups(0), group = get_group_id(0), lane = get_local_id(0);
  const uint digits = mask + 1;
  uint all;
  const uint below = groupExclusiveScan(lane < digits ? totals[lane] : 0, scratch, &all);
  if (lane < digits) next[lane] = below + tables[lane * groups + group];

  const uint begin = CHUNK_BEGIN(count, group, groups), end = CHUNK_BEGIN(count, group + 1, groups);
  const uint laneItems = min((uint)LANE_ITEMS, (end - begin + GROUP_SIZE - 1) / GROUP_SIZE);
  for (uint tile = begin; tile < end; tile += laneItems * GROUP_SIZE) {
    const uint first = min(end, tile + lane * laneItems), last = min(end, first + laneItems);
    for (uint d = 0; d < digits; ++d) ranks[d * GROUP_SIZE + lane] = 0;
    for (uint i = first; i < last; ++i) ranks[DIGIT(keys[i]) * GROUP_SIZE + lane] += 1;
    barrier(CLK_LOCAL_MEM_FENCE);

    // Exclusive scan of the digits * GROUP_SIZE counts; each lane sums `digits` consecutive ones.
    uint sum = 0;
    for (uint k = 0; k < digits; ++k) sum += ranks[lane * digits + k];
    uint total;
    uint before = groupExclusiveScan(sum, scratch, &total);
    for (uint k = 0; k < digits; ++k) {
      const uint n = ranks[lane * digits + k];
      ranks[lane * digits + k] = (ushort)before;
      before += n;
    }
    barrier(CLK_LOCAL_MEM_FENCE);

    // Ranks count from the tile's start; a digit's own start is the rank of its lane 0.
    for (uint d = lane; d < digits; d += GROUP_SIZE) {
      tileEnd[d] = d + 1 < digits ? ranks[(d + 1) * GROUP_SIZE] : total;
      next[d] -= ranks[d * GROUP_SIZE];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint i = first; i < last; ++i) {
      const Key key = keys[i];
      const uint digit = DIGIT(key);
      const uint to = next[digit] + ranks[digit * GROUP_SIZE + lane]++;
      AT(keysOut, to) = key;
      if (values) AT(valuesOut, to) = values[i];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint d = lane; d < digits; d += GROUP_SIZE) next[d] += tileEnd[d];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}

#endif

#ifndef BTGPU_KEY64
// Floats as uints of the same order (-0 below +0; NaN at the ends), and back.
KERNEL floatsToKeys(uint capacity, __global const uint* counter, __global const float* floats, __global uint* keys) {
  const uint count = itemCount(capacity, counter);
  FOR_EACH(i, count) {
    const uint bits = as_uint(floats[i]);
    keys[i] = bits & 0x80000000u ? ~bits : bits | 0x80000000u;
  }
}

KERNEL keysToFloats(uint capacity, __global const uint* counter, __global const uint* keys, __global float* floats) {
  const uint count = itemCount(capacity, counter);
  FOR_EACH(i, count) {
    const uint key = keys[i];
    floats[i] = as_float(key & 0x80000000u ? key & 0x7fffffffu : ~key);
  }
}
#endif
