// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Assertions and bounds checks of a debug build (BTGPU_DEBUG_KERNELS=1, docs/debugging.md); nothing at all in a normal
// one. A kernel that uses them begins its parameters with CHECKS, a function too; who calls it begins with WITH_CHECKS.
//   AT(array, index)               array[index]; element 0 if there is no such element, which is recorded. `array` is a
//                                  parameter of the kernel, by the name that it has there.
//   ASSERT(condition, a, b)        records two uints
//   ASSERT_FLOATS(condition, a, b) ... two floats
// OpenCL C only.
#ifndef BTGPU_LIB_DEBUG_H
#define BTGPU_LIB_DEBUG_H
#include "../shared/debug.h"

#ifdef BTGPU_DEBUG

#define CHECKS volatile __global DebugRecord *checks,
#define WITH_CHECKS checks,
#define AT(array, index) \
  (array)[checkedIndex(checks, DEBUG_NAME(#array, sizeof(#array)), index, __LINE__, __FILE__, #array "[" #index "]")]
#define ASSERT(condition, a, b)                                                                                  \
  do {                                                                                                           \
    if (!(condition)) recordFailure(checks, DEBUG_VALUES, __LINE__, __FILE__, #condition, (uint)(a), (uint)(b)); \
  } while (0)
#define ASSERT_FLOATS(condition, a, b)                                                                             \
  do {                                                                                                             \
    if (!(condition)) recordFailure(checks, DEBUG_FLOATS, __LINE__, __FILE__, #condition, as_uint(a), as_uint(b)); \
  } while (0)
// How many elements an array has: for assertions.
#define LENGTH(array) lengthOf(checks, DEBUG_NAME(#array, sizeof(#array)))

// For assertions: of length 1, near enough for one thing to be told from another.
static inline int isUnit4(float4 v) { return fabs(v.x * v.x + v.y * v.y + v.z * v.z + v.w * v.w - 1.0f) < 1e-3f; }
static inline int isUnit(float4 v) { return isUnit4((float4)(v.x, v.y, v.z, 0.0f)); }

static inline void copyText(volatile __global uint* to, uint room, __constant const char* text) {
  uint i = 0;
  for (; i + 1 < room && text[i]; ++i) to[i] = (uint)text[i];
  to[i] = 0;
}

// The first one of a launch stays.
static inline void recordFailure(volatile __global DebugRecord* checks, uint kind, uint line,
                                 __constant const char* file, __constant const char* text, uint a, uint b) {
  if (atomic_inc(&checks->failures) != 0) return;
  checks->kind = kind;
  checks->line = line;
  checks->item = (uint)get_global_id(0);
  checks->values[0] = a;
  checks->values[1] = b;
  copyText(checks->file, DEBUG_FILE, file);
  copyText(checks->text, DEBUG_TEXT, text);
}

// Of an array that the host could not name: no limit.
static inline uint lengthOf(volatile __global DebugRecord* checks, uint name) {
  for (uint i = 0; i < checks->arrayCount; ++i) {
    if (checks->names[i] == name) return checks->lengths[i];
  }
  return 0xffffffffu;
}

static inline uint checkedIndex(volatile __global DebugRecord* checks, uint name, uint index, uint line,
                                __constant const char* file, __constant const char* text) {
  const uint length = lengthOf(checks, name);
  if (index < length) return index;
  recordFailure(checks, DEBUG_INDEX, line, file, text, index, length);
  return 0;
}

#else

#define CHECKS
#define WITH_CHECKS
#define AT(array, index) (array)[index]
#define ASSERT(condition, a, b)
#define ASSERT_FLOATS(condition, a, b)

#endif

#endif
