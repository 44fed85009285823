// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the Jacobi solver adds to the kernels of stage 70: after each pass, in which every constraint has worked on
// copies of its own, the copies of a body are averaged, always in the same order.
#include "../lib/kernel.h"
#include "../lib/rows.h"

KERNEL averageCopies(CHECKS uint bodyCount, __global const StepCounters* counters, __global const StepParams* params,
                     __global const uint* copyFirst, __global SolverBody* copies, __global SolverBody* bodies) {
  RETURN_ON_OVERFLOW(counters);
  const int pushes = (params->flags & STEP_SPLIT_IMPULSE) != 0;
  FOR_EACH(i, bodyCount) {
    const uint first = copyFirst[i], end = copyFirst[i + 1];
    if (first == end) continue;  // nothing moved it
    const float n = (float)(end - first);
    SolverBody mean = AT(copies, first);
    for (uint copy = first + 1; copy < end; ++copy) {
      mean.deltaLinear += AT(copies, copy).deltaLinear;
      mean.deltaAngular += AT(copies, copy).deltaAngular;
      if (!pushes) continue;
      mean.pushLinear += AT(copies, copy).pushLinear;
      mean.turnAngular += AT(copies, copy).turnAngular;
    }
    mean.deltaLinear /= n;
    mean.deltaAngular /= n;
    if (pushes) {
      mean.pushLinear /= n;
      mean.turnAngular /= n;
    }
    for (uint copy = first; copy < end; ++copy) AT(copies, copy) = mean;
    bodies[i] = mean;
  }
}
