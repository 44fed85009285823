// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Work groups that go through many rounds of work in one launch, each round starting when the last one is done. CPU
// shape only: a launch a round costs more there than a round of some thousand items, and hands every thread other
// items than before, so that what one core wrote another one has to fetch.
//
// A round's work is cut into parts, and members take parts that nobody has taken, each beginning at a place of its
// own. Who finds none left waits until those of the others are done. That needs no member but oneself to run at all:
// only running members take parts, so whoever is waited for is on the way. (OpenCL promises nothing for groups that
// wait for a group that has not begun.) Who waits too long leaves, since the other one has no core to run on, and
// gets one sooner that way; who holds a part never leaves, so that one at least carries on to the end.
//
// All members must go through the same rounds with the same numbers of parts. OpenCL C only.
#ifndef BTGPU_LIB_TEAM_H
#define BTGPU_LIB_TEAM_H
#include "../shared/contact.h"
#include "../shared/team.h"
#include "group_scan.h"

#define TEAM_PATIENCE (1u << 14)  // looks at TEAM_DONE: some tenths of a millisecond

STRUCT(Member) {
  volatile __global uint* team;
  uint rank;   // in the order of arrival
  uint round;  // from 1 on
  uint tried;  // parts of this round that are known to be taken
  uint due;    // parts of all rounds that have begun
};

static Member joinTeam(__global uint* team) {
  Member m;
  m.team = team;
  m.rank = atomic_inc(m.team + TEAM_MEMBERS);
  m.round = m.tried = m.due = 0;
  return m;
}

static void beginRound(Member* m, uint parts) {
  m->round += 1;
  m->tried = 0;
  m->due += parts;
}

// A part of this round for this member to do, or NO_INDEX if all are taken.
static uint takePart(Member* m, uint parts) {
  const uint home = (uint)((ulong)m->rank * parts / get_num_groups(0));
  while (m->tried < parts) {
    const uint part = (home + m->tried) % parts;
    m->tried += 1;
    if (atomic_max(m->team + TEAM_CLAIM(part), m->round) < m->round) return part;
  }
  return NO_INDEX;
}

// Waits until the round is done, of which this member did `mine` parts. False if the member has to leave.
static int endRound(const Member* m, uint mine) {
  volatile __global uint* done = m->team + TEAM_DONE;
  mem_fence(CLK_GLOBAL_MEM_FENCE);
  if (mine > 0) atomic_add(done, mine);
  for (uint looks = 0; (int)(atomic_or(done, 0) - m->due) < 0; ++looks) {
    if (looks == TEAM_PATIENCE) return 0;
  }
  mem_fence(CLK_GLOBAL_MEM_FENCE);
  return 1;
}

static void leaveTeam(const Member* m) {
  if (atomic_inc(m->team + TEAM_LEFT) + 1 < get_num_groups(0)) return;
  for (uint i = 0; i < TEAM_SIZE; ++i) atomic_xchg(m->team + i, 0);
}

#endif
