// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Types and address spaces that let one text be compiled as OpenCL C 1.2 and as C++17.
// Only float, int, uint, ulong and 4-vectors of float cross to the device (docs/architecture.md).
#ifndef BTGPU_SHARED_TYPES_H
#define BTGPU_SHARED_TYPES_H

#ifdef __OPENCL_C_VERSION__

#pragma OPENCL FP_CONTRACT OFF
#define BTGPU_BEGIN
#define BTGPU_END
#define F4(x, y, z, w) ((float4)((x), (y), (z), (w)))
#define LIB static inline
#define REF(T) T*  // an in/out argument in private memory
#define UNROLL _Pragma("unroll")  // before a short loop over a private array, so that its elements can be registers
#define STRUCT(Name) \
  typedef struct Name Name; \
  struct Name

#else

#include "host_types.h"
#define BTGPU_BEGIN namespace btgpu {
#define BTGPU_END }
#define F4(x, y, z, w) (::btgpu::float4{(x), (y), (z), (w)})
#define LIB inline
#define REF(T) T*
#define UNROLL
#define STRUCT(Name) struct Name
#define __global
#define __local
#define __constant const

#endif

#endif
