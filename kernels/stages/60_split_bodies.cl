// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// For the solver with split masses: every body becomes as many copies as it has constraints, joints that are solved
// among them. No two constraints share a copy, so that all slots are of one colour. A constraint's end is a number, 2 *
// constraint + side, joints behind the contacts; the copies are the ends sorted by body.
#include "../lib/slots.h"
#include "../shared/joint.h"

// Single work item: how many slots and ends there are.
SINGLE_KERNEL beginSplit(uint constraintCapacity, uint slotCapacity, uint jointCount, __global StepCounters* counters,
                         __global uint* slotFirst, __global uint* endCount) {
  endCount[0] = 0;
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount), slotCount = padded(count);
  slotFirst[0] = 0;
  for (uint c = 1; c < COLOUR_TABLE; ++c) slotFirst[c] = slotCount;
  counters->colourCount = count > 0;
  counters->largeColours = 0;
  counters->serialCount = 0;
  counters->slotCount = slotCount;
  if (slotCount > slotCapacity) {
    counters->overflow |= OVERFLOW_SLOTS;
    return;
  }
  endCount[0] = 2 * (count + jointCount);
}

// keys[end]: the body there, or bodyCount if there is none to split.
static void listEnd(uint end, uint body, uint bodyCount, __global uint* keys, __global uint* ends) {
  keys[end] = body == NO_INDEX ? bodyCount : body;
  ends[end] = end;
}

// Lists the ends, and writes slots and joints that name no copy yet.
KERNEL listEnds(CHECKS uint bodyCount, uint constraintCapacity, uint jointCount, __global const StepCounters* counters,
                __global const uint* constraints, __global const Manifold* manifolds, __global const BodyStep* steps,
                __global const Joint* joints, __global const uint* jointSolved, __global SlotHeader* slots,
                __global Joint* splitJoints, __global uint* keys, __global uint* ends) {
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount), slotCount = padded(count);
  FOR_EACH(i, slotCount + jointCount) {
    if (i < count) {
      SlotHeader h = headerOf(WITH_CHECKS AT(constraints, i), manifolds, steps);
      listEnd(2 * i, h.bodyA, bodyCount, keys, ends);
      listEnd(2 * i + 1, h.bodyB, bodyCount, keys, ends);
      h.bodyA = h.bodyB = NO_INDEX;
      fillSlot(WITH_CHECKS slots, i, h);
    } else if (i < slotCount) {
      fillSlot(WITH_CHECKS slots, i, emptySlot());
    } else {
      const uint j = i - slotCount;
      Joint joint = AT(joints, j);
      const int solved = AT(jointSolved, j) && joint.rowCount > 0;
      const uint bodyA = solved ? joint.bodyA : NO_INDEX;
      // A joint of a body with itself works on one copy.
      const uint bodyB = solved && joint.bodyB != joint.bodyA ? joint.bodyB : NO_INDEX;
      listEnd(2 * (count + j), bodyA, bodyCount, keys, ends);
      listEnd(2 * (count + j) + 1, bodyB, bodyCount, keys, ends);
      joint.bodyA = joint.bodyB = NO_INDEX;
      AT(splitJoints, j) = joint;
    }
  }
}

// Tells each constraint its copies. ends[]: sorted by body; copyFirst[bodyCount]: how many copies there are.
KERNEL assignCopies(CHECKS uint bodyCount, uint constraintCapacity, __global const StepCounters* counters,
                    __global const uint* copyFirst, __global const uint* ends, __global const Joint* joints,
                    __global SlotHeader* slots, __global Joint* splitJoints) {
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  FOR_EACH(copy, copyFirst[bodyCount]) {
    const uint end = AT(ends, copy), constraint = end / 2, side = end % 2;
    if (constraint < count) {
      if (side == 0) AT(slots, constraint).bodyA = copy;
      if (side == 1) AT(slots, constraint).bodyB = copy;
    } else {
      const uint j = constraint - count;
      if (side == 0) AT(splitJoints, j).bodyA = copy;
      if (side == 1 || AT(joints, j).bodyB == AT(joints, j).bodyA) AT(splitJoints, j).bodyB = copy;
    }
  }
}
