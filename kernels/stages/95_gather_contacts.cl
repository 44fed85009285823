// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the host needs to keep its dispatcher's manifolds current: the keys of all manifolds with points, and those
// manifolds themselves that are not carried over unchanged since it saw them last. Both in pair order.
#include "../lib/kernel.h"
#include "../shared/contact.h"
#include "../shared/shape.h"

static int isTouching(__global const Manifold* m) { return m->pointCount > 0; }
static int isCarried(__global const Manifold* m) { return m->bucket == BUCKET_CARRY && !m->unseen; }

// all: also the manifolds that are carried over.
KERNEL markContacts(uint pairCapacity, uint all, __global const StepCounters* counters, __global const Manifold* manifolds,
                    __global uint* touching, __global uint* fresh) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, itemCount(pairCapacity, &counters->pairCount)) {
    touching[i] = isTouching(&manifolds[i]);
    fresh[i] = isTouching(&manifolds[i]) && (all || !isCarried(&manifolds[i]));
  }
}

SINGLE_KERNEL countContacts(__global const uint* touchingCount, __global const uint* freshCount,
                            __global StepCounters* counters) {
  if (counters->overflow) return;
  counters->touchingCount = *touchingCount;
  counters->freshCount = *freshCount;
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
