// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The two shapes of every kernel (docs/decisions/0002-two-kernel-shapes.md), chosen when a program is built:
//   BTGPU_SHAPE_GPU: a work item is a lane; work-groups of GROUP_SIZE cooperate through local memory.
//   BTGPU_SHAPE_CPU: a work item is a whole group of its own and walks a contiguous chunk.
// Grids are fixed and loops strided, so that a kernel reads the number of its items on the device.
#ifndef BTGPU_LIB_KERNEL_H
#define BTGPU_LIB_KERNEL_H
#include "../shared/step.h"
#include "../shared/types.h"
#include "debug.h"

#ifdef BTGPU_SHAPE_CPU
#define GROUP_SIZE 1
// Chunk of work item `get_global_id(0)` out of `count` items.
#define FOR_EACH(i, count)                                                                        \
  for (uint i = (uint)((ulong)(count) * get_global_id(0) / get_global_size(0)),                   \
            i##_end = (uint)((ulong)(count) * (get_global_id(0) + 1) / get_global_size(0));       \
       i < i##_end; ++i)
#else
#ifndef GROUP_SIZE
#define GROUP_SIZE 128
#endif
#define FOR_EACH(i, count) for (uint i = get_global_id(0); i < (count); i += get_global_size(0))
#endif

#define KERNEL_OF(size) __kernel __attribute__((reqd_work_group_size(size, 1, 1))) void
#define KERNEL KERNEL_OF(GROUP_SIZE)
#define SINGLE_KERNEL KERNEL_OF(1)

// A count is known to the host, or lies in a counter on the device and is clamped to what there is room for.
static inline uint itemCount(uint capacity, __global const uint* counter) {
  return counter ? min(capacity, *counter) : capacity;
}

// DEBUG_PRINT(("pair %u\n", i)); prints if BTGPU_PRINTF=1 is set, and is nothing otherwise. OpenCL C has no variadic
// macros, hence the second parentheses.
#ifdef BTGPU_PRINTF
#define DEBUG_PRINT(arguments) printf arguments
#else
#define DEBUG_PRINT(arguments)
#endif

// After an overflow every kernel of the step returns at once.
#define RETURN_ON_OVERFLOW(counters) \
  if ((counters)->overflow) return

#endif
