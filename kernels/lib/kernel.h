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

// Asks for `bytes` from an address that will be read soon and that the CPU can't guess. GPUs and interpreters know no
// such thing.
static inline void prefetchSoon(__global const void* from, uint bytes) {
#if defined(BTGPU_SHAPE_CPU) && (defined(__x86_64__) || defined(__aarch64__))
  for (uint at = 0; at < bytes; at += 64) __builtin_prefetch((const void*)((size_t)from + at), 0, 3);
#endif
}
// ... that will be written.
static inline void prefetchToWrite(__global const void* to, uint bytes) {
#if defined(BTGPU_SHAPE_CPU) && (defined(__x86_64__) || defined(__aarch64__))
  for (uint at = 0; at < bytes; at += 64) __builtin_prefetch((const void*)((size_t)to + at), 1, 3);
#endif
}
#define ITEMS_AHEAD 16u  // a loop over items asks so many before it needs them

// After an overflow every kernel of the step returns at once.
#define RETURN_ON_OVERFLOW(counters) \
  if ((counters)->overflow) return

#endif
