// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Projected Gauss-Seidel over the groups and batches of 60_batch_constraints: a work group takes a whole group of a
// phase and goes through its batches, one after the other.
#include "../lib/batches.h"
#include "../lib/solve_slot.h"

#ifdef BTGPU_SHAPE_CPU
#define LANES 1
#else
#define LANES SOLVE_GROUP
#endif

// The batches firstBatch ... firstBatch + batchCount - 1 of all groups of a phase.
KERNEL_OF(LANES)
solveBatches(CHECKS uint phase, uint firstBatch, uint batchCount, uint passes, __global const StepCounters* counters,
             __global const StepParams* params, __global const uint* split, __global const uint* groupBatches,
             __global const uint* batchFirst, __global const SlotHeader* slots, __global const SolverMass* masses,
             __global SolverBody* bodies, __global float* rows, __global float* tangent2, __global float* torsion) {
  RETURN_ON_OVERFLOW(counters);
  const uint groups = split[SPLIT_GROUPS], flags = params->flags;
  for (uint g = get_group_id(0); g < groups; g += get_num_groups(0)) {
    const uint group = phase * groups + g;
    const uint endBatch = min(AT(groupBatches, group), firstBatch + batchCount);
    for (uint batch = firstBatch; batch < endBatch; ++batch) {
      const uint first = AT(batchFirst, group * BATCH_LIMIT + batch);
      const uint end = AT(batchFirst, group * BATCH_LIMIT + batch + 1);
#ifdef BTGPU_SHAPE_CPU
      for (uint slot = first; slot < end; slot += BTGPU_WIDE) {
        solveSlots(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
      }
#else
      for (uint slot = first + get_local_id(0); slot < end; slot += SOLVE_GROUP) {
        solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
      }
      barrier(CLK_GLOBAL_MEM_FENCE);
#endif
    }
  }
}

// What fits no batch, slot by slot. Single work item.
SINGLE_KERNEL solveSerialBatch(CHECKS uint passes, __global const StepCounters* counters,
                               __global const StepParams* params, __global const uint* slotFirst,
                               __global const SlotHeader* slots, __global const SolverMass* masses,
                               __global SolverBody* bodies, __global float* rows, __global float* tangent2,
                               __global float* torsion) {
  RETURN_ON_OVERFLOW(counters);
  const uint flags = params->flags;
  for (uint slot = slotFirst[COLOUR_SERIAL]; slot < slotFirst[COLOUR_SERIAL + 1]; ++slot) {
    solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
  }
}
