// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The vertex of a hull that lies farthest along a direction, BTGPU_WIDE vertices at once: the same one as coreSupport's
// loop in convex.h finds, of several as far that with the lowest index. OpenCL C only.
#ifndef BTGPU_LIB_SUPPORT_WIDE_H
#define BTGPU_LIB_SUPPORT_WIDE_H
#include "../shared/shape.h"
#include "wide.h"

// Reads up to HULL_PADDING vertices after the last.
WIDE int farthestVertexWide(__global const float4* vertices, int count, float4 direction) {
  __global const float* from = (__global const float*)vertices;
  Lanes farthest = (Lanes)-INFINITY;
  int16 best = 0;
  for (int i = 0; i < count; i += BTGPU_WIDE) {
    const Lanes4 v = transposeWide(vload16(0, from + 4 * i), vload16(1, from + 4 * i), vload16(2, from + 4 * i),
                                   vload16(3, from + 4 * i));
    const int16 index = (int16)(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15) + i;  // as transposed
    const Lanes along = v.x * direction.x + v.y * direction.y + v.z * direction.z;
    const LaneMask more = (along > farthest) & (index < count);
    farthest = pick(more, along, farthest);
    best = more ? index : best;
  }
  float most;
  return firstOfMost(farthest, best, &most);
}

#endif
