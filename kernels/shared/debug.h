// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What kernels of a debug build are told and write down (docs/debugging.md).
#ifndef BTGPU_SHARED_DEBUG_H
#define BTGPU_SHARED_DEBUG_H
#include "types.h"

BTGPU_BEGIN

#define DEBUG_ARRAYS 32  // arrays of one kernel
#define DEBUG_FILE 56
#define DEBUG_TEXT 120

// DebugRecord.kind: what the values are.
#define DEBUG_VALUES 0u  // uints
#define DEBUG_FLOATS 1u  // bits of floats
#define DEBUG_INDEX 2u   // an index, and the length that it is too large for

// What guard zones and new memory are filled with: as a float no number, as an index too large.
#define DEBUG_PATTERN 0x7fedbeefu

// Tells the arrays of a kernel apart by their names in its source; `size` counts the zero at the end.
#define DEBUG_NAME(name, size) \
  ((uint)(size) << 24 | (uint)(name)[0] << 16 | (uint)(name)[(size) / 2] << 8 | (uint)(name)[(size)-2])

// Of one launch: its arrays, and its first failed assertion.
STRUCT(DebugRecord) {
  uint failures;
  uint kind;        // DEBUG_*, as all that follows of the first failure
  uint line, item;  // item: get_global_id(0)
  uint values[2];
  uint arrayCount;
  uint unused;
  uint names[DEBUG_ARRAYS];    // DEBUG_NAME
  uint lengths[DEBUG_ARRAYS];  // elements
  uint file[DEBUG_FILE];       // characters, up to a zero
  uint text[DEBUG_TEXT];       // likewise: what was asserted
};

BTGPU_END
#endif
