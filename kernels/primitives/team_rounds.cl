// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// For the test of lib/team.h only.
#include "../lib/kernel.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/team.h"

// `rounds` rounds, each in as many parts as partsOf[round] says (none: no round). Item i of a round becomes the sum of
// its two neighbours of the round before, plus 1; values and last take turns. Part 0 of round slowRound takes `delay`
// turns longer. visits[part] counts who did it; *impatient counts members that left before the end.
KERNEL playRounds(uint rounds, uint items, uint slowRound, uint delay, __global const uint* partsOf,
                  __global uint* values, __global uint* last, __global uint* visits, __global uint* impatient,
                  __global uint* team) {
  Member m = joinTeam(team);
  int stays = 1;
  for (uint round = 0; round < rounds && stays; ++round) {
    const uint parts = partsOf[round];
    if (parts == 0) continue;
    __global uint* to = round % 2 ? last : values;
    __global const uint* from = round % 2 ? values : last;
    uint mine = 0;
    beginRound(&m, parts);
    for (uint part = takePart(&m, parts); part != NO_INDEX; part = takePart(&m, parts)) {
      volatile uint wait = round == slowRound && part == 0 ? delay : 0;
      while (wait > 0) wait -= 1;
      for (uint i = CHUNK_BEGIN(items, part, parts); i < CHUNK_BEGIN(items, part + 1, parts); ++i) {
        to[i] = from[(i + 1) % items] + from[(i + items - 1) % items] + 1;
      }
      atomic_inc(visits + part);
      ++mine;
    }
    stays = endRound(&m, mine);
  }
  if (!stays) atomic_inc(impatient);
  leaveTeam(&m);
}
#endif
