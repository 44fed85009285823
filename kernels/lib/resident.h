// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Work groups of the GPU shape that go through many rounds in one launch and wait for each other between them: a wait
// takes less than a launch, and what the next round reads can be under way meanwhile
// (docs/decisions/0025-solver-in-resident-groups.md).
//
// OpenCL does not promise that groups of a launch run at the same time, so the groups call the roll first: when all
// have come, all are running, and none will have to wait for one that has not begun. Who waits too long for the others
// says so in OVERFLOW_ABSENT, and nobody does anything: the host repeats the step with a launch a round.
//
// `team`: TEAM_SIZE uints (../shared/team.h), zero before the launch and after it. OpenCL C only.
#ifndef BTGPU_LIB_RESIDENT_H
#define BTGPU_LIB_RESIDENT_H
#include "../shared/team.h"
#include "kernel.h"

#define ROLL_PATIENCE (1u << 14)  // looks at TEAM_STATE: some milliseconds, a launch's groups come within microseconds

// What the lanes of this group wrote before incReleasing() is visible to groups whose loadAcquiring() sees the increment.
// OpenCL C's own atomics for that are optional before 3.0 and in it.
#ifdef __NV_CL_C_VERSION
static void incReleasing(volatile __global uint* word) {
  asm volatile("red.release.gpu.global.add.u32 [%0], 1;" ::"l"(word) : "memory");
}
static uint loadAcquiring(volatile __global uint* word) {
  uint value;
  asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(value) : "l"(word) : "memory");
  return value;
}
#else
static void incReleasing(volatile __global uint* word) {
  mem_fence(CLK_GLOBAL_MEM_FENCE);
  atomic_inc(word);
}
static uint loadAcquiring(volatile __global uint* word) {
  const uint value = *word;
  mem_fence(CLK_GLOBAL_MEM_FENCE);
  return value;
}
#endif

STRUCT(Resident) {
  volatile __global uint* team;
  uint due;  // arrivals in all rounds that have begun
};

// Whether all groups of this launch are running; if not, this one has nothing to do but to leave.
static int callRoll(Resident* r, __global uint* team, __global StepCounters* counters, __local uint* state) {
  r->team = team;
  r->due = 0;
  if (get_local_id(0) == 0) {
    volatile __global uint* word = r->team + TEAM_STATE;
    if (atomic_inc(r->team + TEAM_MEMBERS) + 1 == get_num_groups(0)) atomic_cmpxchg(word, TEAM_OPEN, TEAM_COMPLETE);
    for (uint looks = 0; atomic_or(word, 0) == TEAM_OPEN; ++looks) {
      if (looks == ROLL_PATIENCE) atomic_cmpxchg(word, TEAM_OPEN, TEAM_GIVEN_UP);
    }
    *state = atomic_or(word, 0);
    if (*state == TEAM_GIVEN_UP) atomic_or(&counters->overflow, OVERFLOW_ABSENT);
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  return *state == TEAM_COMPLETE;
}

// What this group had to do in a round is done. Between this and awaitOthers() it may do what needs nothing of the
// others.
static void arrive(Resident* r) {
  barrier(CLK_GLOBAL_MEM_FENCE);
  if (get_local_id(0) != 0) return;
  r->due += get_num_groups(0);
  incReleasing(r->team + TEAM_DONE);
}

static void awaitOthers(const Resident* r) {
  if (get_local_id(0) == 0) {
    while ((int)(loadAcquiring(r->team + TEAM_DONE) - r->due) < 0) {
    }
  }
  barrier(CLK_GLOBAL_MEM_FENCE);
}

// By all groups in the end. The last one puts the words back to zero.
static void leaveResident(const Resident* r) {
  barrier(CLK_GLOBAL_MEM_FENCE);
  if (get_local_id(0) != 0 || atomic_inc(r->team + TEAM_LEFT) + 1 < get_num_groups(0)) return;
  atomic_xchg(r->team + TEAM_MEMBERS, 0);
  atomic_xchg(r->team + TEAM_STATE, TEAM_OPEN);
  atomic_xchg(r->team + TEAM_DONE, 0);
  atomic_xchg(r->team + TEAM_LEFT, 0);
}

#endif
