// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stage 70's passes over the contacts by the members of a team (team.h). CPU shape, OpenCL C only.
#ifndef BTGPU_LIB_SOLVE_TEAM_H
#define BTGPU_LIB_SOLVE_TEAM_H
#include "solve_slot.h"
#include "team.h"

#define PART_BLOCKS 4u  // blocks of BTGPU_WIDE slots that are worth a part of their own

// This member's share of the slots first ... end - 1 of one colour; false if it has to leave the team.
static int solveColour(CHECKS Member* m, uint first, uint end, uint passes, uint flags,
                       __global const SlotHeader* slots, __global const SolverMass* masses, __global SolverBody* bodies,
                       __global float* rows, __global float* tangent2, __global float* torsion) {
  const uint blocks = (end - first) / BTGPU_WIDE;
  if (blocks == 0) return 1;
  const uint parts = clamp(blocks / PART_BLOCKS, 1u, (uint)TEAM_PARTS);
  uint mine = 0;
  beginRound(m, parts);
  for (uint part = takePart(m, parts); part != NO_INDEX; part = takePart(m, parts)) {
    const uint partEnd = first + CHUNK_BEGIN(blocks, part + 1, parts) * BTGPU_WIDE;
    for (uint slot = first + CHUNK_BEGIN(blocks, part, parts) * BTGPU_WIDE; slot < partEnd; slot += BTGPU_WIDE) {
      solveSlots(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
    }
    ++mine;
  }
  return endRound(m, mine);
}

// The serial batch, slot by slot, all by one member.
static int solveSerial(CHECKS Member* m, uint first, uint end, uint passes, uint flags,
                       __global const SlotHeader* slots, __global const SolverMass* masses, __global SolverBody* bodies,
                       __global float* rows, __global float* tangent2, __global float* torsion) {
  if (first == end) return 1;
  beginRound(m, 1);
  const uint mine = takePart(m, 1) != NO_INDEX;
  for (uint slot = first; mine && slot < end; ++slot) {
    solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
  }
  return endRound(m, mine);
}

// The passes of `sequence`, the first one in its lowest PASS_BITS, each over all colours one after the other and then
// the serial batch. False if this member has to leave the team.
static int solveSequence(CHECKS Member* m, uint sequence, uint colours, uint flags, __global const uint* slotFirst,
                         __global const SlotHeader* slots, __global const SolverMass* masses,
                         __global SolverBody* bodies, __global float* rows, __global float* tangent2,
                         __global float* torsion) {
  int stays = 1;
  for (uint left = sequence; left != 0; left >>= PASS_BITS) {
    const uint passes = left & ((1u << PASS_BITS) - 1);
    for (uint colour = 0; colour < colours && stays; ++colour) {
      stays = solveColour(WITH_CHECKS m, slotFirst[colour], slotFirst[colour + 1], passes, flags, slots, masses, bodies,
                          rows, tangent2, torsion);
    }
    stays = stays && solveSerial(WITH_CHECKS m, slotFirst[COLOUR_SERIAL], slotFirst[COLOUR_SERIAL + 1], passes, flags,
                                 slots, masses, bodies, rows, tangent2, torsion);
  }
  return stays;
}

#endif
