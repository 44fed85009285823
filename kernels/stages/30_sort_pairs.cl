// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The end of every pair finder: pairs in any order become keys in ascending order. A counting sort by the lower body,
// then each body's pairs by themselves.
#include "../lib/group_scan.h"
#include "../lib/pair_list.h"

// counts[b]: listed pairs whose lower body is b. Of a list that was too short nobody wants to know.
KERNEL countListed(CHECKS uint pairCapacity, __global const uint* listed, __global const ulong* list,
                   volatile __global uint* counts) {
  const uint pairs = *listed;
  if (pairs > pairCapacity) return;
  FOR_EACH(k, pairs) atomic_inc(&AT(counts, (uint)(AT(list, k) >> 32)));
}

// Also notes how many pairs there are and whether they fit. The list is cleared, so that its order, which is another one
// each time, is left nowhere.
KERNEL emitListed(CHECKS uint pairCapacity, __global const uint* listed, __global ulong* list,
                  __global const uint* offsets, __global uint* total, __global StepCounters* counters,
                  __global uint* counts, __global ulong* keys) {
  const uint pairs = *listed, fits = pairs <= pairCapacity;
  if (get_global_id(0) == 0) {
    *total = counters->pairCount = pairs;
    if (!fits) counters->overflow |= OVERFLOW_PAIRS;
  }
  const int emits = fits ? !counters->overflow : 0;  // read only where nobody writes it
  FOR_EACH(k, min(pairs, pairCapacity)) {
    const ulong key = AT(list, k);
    AT(list, k) = 0;
    if (emits) emitPair(WITH_CHECKS (uint)(key >> 32), (uint)key, offsets, counts, keys);
  }
}

// ---- each body's pairs in order ------------------------------------------------------------------------------

#define FEW_PAIRS 32u  // that one work item sorts by insertion

static void sortFew(__global ulong* keys, uint count) {
  for (uint i = 1; i < count; ++i) {
    const ulong key = keys[i];
    uint to = i;
    for (; to > 0 && keys[to - 1] > key; --to) keys[to] = keys[to - 1];
    keys[to] = key;
  }
}

// Of more pairs the higher bodies become bits of a window over all bodies, which are then read out in order. Several
// windows need room for the result.
#ifdef BTGPU_SHAPE_CPU

#define WINDOW_WORDS 1024u

static void sortMany(CHECKS uint bodyCount, uint body, uint first, uint last, __global ulong* keys,
                     __global ulong* sorted) {
  uint bits[WINDOW_WORDS];
  const uint window = WINDOW_WORDS * 32, several = bodyCount - body > window;
  uint to = first;
  for (uint begin = body; begin < bodyCount; begin += min(window, bodyCount - begin)) {
    const uint words = min(WINDOW_WORDS, (bodyCount - begin + 31) / 32);
    for (uint w = 0; w < words; ++w) bits[w] = 0;
    for (uint k = first; k < last; ++k) {
      const uint place = (uint)keys[k] - begin;  // wraps below the window
      if (place < window) bits[place / 32] |= 1u << (place % 32);
    }
    for (uint w = 0; w < words; ++w) {
      for (uint left = bits[w]; left; left &= left - 1) {
        const ulong key = pairKeyOf(body, begin + w * 32 + (31 - clz(left & (0 - left))));
        if (several) {
          AT(sorted, to) = key;
        } else {
          AT(keys, to) = key;
        }
        ++to;
      }
    }
  }
  for (uint k = first; several && k < last; ++k) keys[k] = sorted[k];
}

KERNEL sortPairs(CHECKS uint bodyCount, __global const StepCounters* counters, __global const uint* offsets,
                 __global ulong* keys, __global ulong* sorted) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    const uint first = offsets[i], last = i + 1 < bodyCount ? offsets[i + 1] : counters->pairCount;
    ASSERT(first <= last && last <= LENGTH(keys), first, last);
    if (last - first <= FEW_PAIRS) {
      sortFew(keys + first, last - first);
    } else {
      sortMany(WITH_CHECKS bodyCount, i, first, last, keys, sorted);
    }
  }
}

#else

#define WINDOW_WORDS 4096u

// By all lanes of a group.
static void sortMany(CHECKS uint bodyCount, uint body, uint first, uint last, __global ulong* keys,
                     __global ulong* sorted, __local uint* bits, __local uint* scratch) {
  const uint lane = get_local_id(0);
  const uint window = WINDOW_WORDS * 32, several = bodyCount - body > window;
  uint to = first;
  for (uint begin = body; begin < bodyCount; begin += min(window, bodyCount - begin)) {
    const uint words = min(WINDOW_WORDS, (bodyCount - begin + 31) / 32);
    for (uint w = lane; w < words; w += GROUP_SIZE) bits[w] = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint k = first + lane; k < last; k += GROUP_SIZE) {
      const uint place = (uint)keys[k] - begin;  // wraps below the window
      if (place < window) atomic_or(&bits[place / 32], 1u << (place % 32));
    }
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    for (uint tile = 0; tile < words; tile += GROUP_SIZE) {
      uint left = tile + lane < words ? bits[tile + lane] : 0, total;
      uint mine = to + groupExclusiveScan(popcount(left), scratch, &total);
      for (; left; left &= left - 1) {
        const ulong key = pairKeyOf(body, begin + (tile + lane) * 32 + (31 - clz(left & (0 - left))));
        if (several) {
          AT(sorted, mine) = key;
        } else {
          AT(keys, mine) = key;
        }
        ++mine;
      }
      to += total;
    }
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
  }
  for (uint k = first + lane; several && k < last; k += GROUP_SIZE) keys[k] = sorted[k];
}

KERNEL sortPairs(CHECKS uint bodyCount, __global const StepCounters* counters, __global const uint* offsets,
                 __global ulong* keys, __global ulong* sorted) {
  __local uint bits[WINDOW_WORDS], scratch[GROUP_SIZE], many[GROUP_SIZE], manyCount;
  RETURN_ON_OVERFLOW(counters);
  const uint lane = get_local_id(0);
  for (uint base = get_group_id(0) * GROUP_SIZE; base < bodyCount; base += get_global_size(0)) {
    if (lane == 0) manyCount = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    const uint i = base + lane;
    if (i < bodyCount) {
      const uint first = offsets[i], last = i + 1 < bodyCount ? offsets[i + 1] : counters->pairCount;
      ASSERT(first <= last && last <= LENGTH(keys), first, last);
      if (last - first <= FEW_PAIRS) {
        sortFew(keys + first, last - first);
      } else {
        many[atomic_inc(&manyCount)] = i;
      }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    const uint n = manyCount;
    for (uint k = 0; k < n; ++k) {
      const uint body = many[k];
      const uint first = offsets[body], last = body + 1 < bodyCount ? offsets[body + 1] : counters->pairCount;
      sortMany(WITH_CHECKS bodyCount, body, first, last, keys, sorted, bits, scratch);
      barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}

#endif
