// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The shared structs have the size on the host that kernels/shared/struct_fields.h states, and copy as plain
// bytes.
#include "../../kernels/shared/struct_fields.h"

#include <type_traits>

namespace btgpu {

#define CHECK_SIZE(Struct, bytes)                                                                 \
  static_assert(sizeof(Struct) == (bytes), "the size of " #Struct " is not what the device has"); \
  static_assert(sizeof(Struct) % alignof(Struct) == 0 && alignof(Struct) <= 16);                  \
  static_assert(std::is_trivially_copyable_v<Struct> && std::is_standard_layout_v<Struct>);
#define IGNORE_FIELD(Struct, field)

SHARED_STRUCTS(CHECK_SIZE, IGNORE_FIELD)

static_assert(sizeof(float4) == 16);
static_assert(alignof(float4) == 16);
static_assert(sizeof(uint) == 4 && sizeof(ulong) == 8);
static_assert(sizeof(int) == 4);
static_assert(sizeof(float) == 4);

}  // namespace btgpu
