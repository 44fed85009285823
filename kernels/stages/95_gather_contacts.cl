// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the host needs to keep its dispatcher's manifolds current: the keys of all manifolds with points, and those
// manifolds themselves that are not carried over unchanged since it saw them last. Both in pair order.
#include "../lib/group_scan.h"
#include "../shared/contact.h"
#include "../shared/shape.h"

static int isTouching(__global const Manifold* m) { return m->pointCount > 0; }
static int isCarried(__global const Manifold* m) { return m->bucket == BUCKET_CARRY && !m->unseen; }

#define IS_TOUCHING 1u
#define IS_FRESH 2u

static uint flagsOf(__global const Manifold* m, uint all) {
  if (!isTouching(m)) return 0;
  return all || !isCarried(m) ? IS_TOUCHING | IS_FRESH : IS_TOUCHING;
}

// flags[i]: what manifold i is, a chunk a group; chunkSums[2 g], [2 g + 1]: how many of chunk g touch and are fresh.
// all: also the manifolds that are carried over.
KERNEL markContacts(uint pairCapacity, uint all, __global const StepCounters* counters,
                    __global const Manifold* manifolds, __global uint* flags, __global uint* chunkSums) {
  SCRATCH;
  RETURN_ON_OVERFLOW(counters);
  uint touching = 0, fresh = 0;
  FOR_CHUNK(i, itemCount(pairCapacity, &counters->pairCount)) {
    if (i + ITEMS_AHEAD < i_end) prefetchSoon(&manifolds[i + ITEMS_AHEAD], 32);
    const uint f = flagsOf(&manifolds[i], all);
    flags[i] = f;
    touching += f & IS_TOUCHING;
    fresh += f / IS_FRESH;
  }
  touching = GROUP_SUM(touching);
  fresh = GROUP_SUM(fresh);
  if (get_local_id(0) != 0) return;
  chunkSums[2 * get_group_id(0)] = touching;
  chunkSums[2 * get_group_id(0) + 1] = fresh;
}

// The indices of both kinds, ascending, and how many there are.
KERNEL listContacts(CHECKS uint pairCapacity, __global StepCounters* counters, __global const uint* flags,
                    __global const uint* chunkSums, __global uint* touching, __global uint* fresh) {
  SCRATCH;
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(pairCapacity, &counters->pairCount), group = get_group_id(0);
  uint nextTouching = 0, nextFresh = 0;
#ifdef BTGPU_SHAPE_CPU
  for (uint g = 0; g < group; ++g) {
    nextTouching += chunkSums[2 * g];
    nextFresh += chunkSums[2 * g + 1];
  }
  FOR_CHUNK(i, count) {
    const uint f = flags[i];
    if (f & IS_TOUCHING) AT(touching, nextTouching) = i;
    if (f & IS_FRESH) AT(fresh, nextFresh) = i;
    nextTouching += f & IS_TOUCHING;
    nextFresh += f / IS_FRESH;
  }
#else
  for (uint g = get_local_id(0); g < group; g += GROUP_SIZE) {
    nextTouching += chunkSums[2 * g];
    nextFresh += chunkSums[2 * g + 1];
  }
  nextTouching = groupSum(nextTouching, scratch);
  nextFresh = groupSum(nextFresh, scratch);
  const uint end = CHUNK_BEGIN(count, group + 1, get_num_groups(0));
  for (uint tile = CHUNK_BEGIN(count, group, get_num_groups(0)); tile < end; tile += GROUP_SIZE) {
    const uint i = tile + get_local_id(0), f = i < end ? flags[i] : 0;
    // Both counts of a tile fit one word.
    uint total;
    const uint before = groupExclusiveScan((f & IS_TOUCHING) | (f / IS_FRESH) << 16, scratch, &total);
    if (f & IS_TOUCHING) AT(touching, nextTouching + (before & 0xffffu)) = i;
    if (f & IS_FRESH) AT(fresh, nextFresh + (before >> 16)) = i;
    nextTouching += total & 0xffffu;
    nextFresh += total >> 16;
  }
#endif
  if (group + 1 < get_num_groups(0) || get_local_id(0) != 0) return;
  counters->touchingCount = nextTouching;
  counters->freshCount = nextFresh;
}

// The first of them, up to `room`.
KERNEL gatherContactKeys(CHECKS uint room, uint all, __global const StepCounters* counters,
                         __global const uint* touching, __global const ulong* keys, __global const Manifold* manifolds,
                         __global ulong* contactKeys) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(k, min(room, counters->touchingCount)) {
    const uint i = AT(touching, k);
    AT(contactKeys, k) = AT(keys, i) | (!all && isCarried(&AT(manifolds, i)) ? CONTACT_CARRIED : 0UL);
  }
}

KERNEL gatherContacts(CHECKS uint room, __global const StepCounters* counters, __global const uint* fresh,
                      __global const Manifold* manifolds, __global Manifold* contacts) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(k, min(room, counters->freshCount)) AT(contacts, k) = AT(manifolds, AT(fresh, k));
}
