// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// For the struct layout test only: how the device's compiler lays out the shared structs.
#include "../lib/kernel.h"
#include "../shared/struct_fields.h"

#define WRITE(value)                             \
  do {                                           \
    if (n < capacity) layout[n] = (uint)(value); \
    ++n;                                         \
  } while (0)
#define WRITE_SIZE(Struct, bytes) WRITE(sizeof(Struct));
#define WRITE_FIELD(Struct, field)                          \
  {                                                         \
    Struct s;                                               \
    WRITE((__private char*)&s.field - (__private char*)&s); \
    WRITE(sizeof(s.field));                                 \
  }

// For each struct its size, then offset and size of each field, in the order of SHARED_STRUCTS; *written
// counts them.
SINGLE_KERNEL reportLayout(uint capacity, __global uint* written, __global uint* layout) {
  uint n = 0;
  SHARED_STRUCTS(WRITE_SIZE, WRITE_FIELD)
  *written = n;
}
