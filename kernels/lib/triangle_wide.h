// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Up to BTGPU_WIDE triangles of a mesh, all against the box around the shape that they meet: makeTriangle and
// mayTouch (stage 47), with the same roundings. OpenCL C only.
#ifndef BTGPU_LIB_TRIANGLE_WIDE_H
#define BTGPU_LIB_TRIANGLE_WIDE_H
#include "triangle.h"
#include "wide.h"

typedef struct WideTriangles {
  float a[3 * BTGPU_WIDE], b[3 * BTGPU_WIDE], c[3 * BTGPU_WIDE];
  float normals[3 * BTGPU_WIDE], heights[BTGPU_WIDE], sizes[BTGPU_WIDE];
  int slivers[BTGPU_WIDE];   // -1: one without a plane, of which only the corners count here
  int mayTouch[BTGPU_WIDE];  // -1: yes; all slivers may
} WideTriangles;

// The lanes whose three numbers are all beyond the reach, to the same side.
WIDE LaneMask beyondWide(Lanes a, Lanes b, Lanes c, float reach) {
  return ((a > reach) & (b > reach) & (c > reach)) | ((a < -reach) & (b < -reach) & (c < -reach));
}

// The lanes in which the side from p to q has the whole box beyond it, farther away than the limit.
WIDE LaneMask besideWide(Lanes3 p, Lanes3 q, Lanes3 normal, Lanes3 halfExtents, float limitSqr) {
  const Lanes3 outward = crossWide(subtractWide(q, p), normal);
  const Lanes gap = -dotWide(outward, p) - dotWide(abs3Wide(outward), halfExtents);
  return (gap > 0.0f) & (gap * gap > limitSqr * dotWide(outward, outward));
}

// One corner of all in A's axes. `turn`, `offset`: from the mesh's.
WIDE Lanes3 cornerWide(__global const MeshTriangle* triangles, int corner, const uint* index, Matrix3 turn,
                       float4 offset) {
  const Lanes3 v = xyzWide(gatherWide((__global const float4*)triangles + corner, 4, index));
  WideMatrix m;
  m.row0 = broadcastWide(turn.row0);
  m.row1 = broadcastWide(turn.row1);
  m.row2 = broadcastWide(turn.row2);
  return addWide(broadcastWide(offset), mulMatrixWide(m, v));
}

WIDE void trianglesWide(__global const MeshTriangle* triangles, const uint* index, Matrix3 turn, float4 offset,
                        float4 halfExtents, float4 at, float limit, WideTriangles* out) {
  const Lanes3 cornerA = cornerWide(triangles, 0, index, turn, offset),
               cornerB = cornerWide(triangles, 1, index, turn, offset),
               cornerC = cornerWide(triangles, 2, index, turn, offset);
  const Lanes3 ab = subtractWide(cornerB, cornerA), bc = subtractWide(cornerC, cornerB),
               ca = subtractWide(cornerA, cornerC);
  const Lanes abSqr = dotWide(ab, ab), bcSqr = dotWide(bc, bc), caSqr = dotWide(ca, ca);
  const Lanes moreSqr = pick(bcSqr > caSqr, bcSqr, caSqr), sizeSqr = pick(abSqr > moreSqr, abSqr, moreSqr);
  const Lanes3 across = crossWide(ab, timesWide(ca, (Lanes)-1.0f));
  const Lanes area = sqrt(dotWide(across, across));
  const LaneMask isSliver = ~(area > SLIVER_SINE * sizeSqr);
  Lanes3 normal;
  normal.x = across.x / area;
  normal.y = across.y / area;
  normal.z = across.z / area;
  storeLanes3(cornerA, out->a);
  storeLanes3(cornerB, out->b);
  storeLanes3(cornerC, out->c);
  storeLanes3(normal, out->normals);
  vstore16(dotWide(normal, cornerA), 0, out->heights);
  vstore16(sqrt(sizeSqr), 0, out->sizes);
  vstore16(isSliver, 0, out->slivers);
  const Lanes3 centre = broadcastWide(at), half3 = broadcastWide(halfExtents);
  const Lanes3 a = subtractWide(cornerA, centre), b = subtractWide(cornerB, centre), c = subtractWide(cornerC, centre);
  LaneMask isFar = beyondWide(a.x, b.x, c.x, halfExtents.x + limit) | beyondWide(a.y, b.y, c.y, halfExtents.y + limit) |
                   beyondWide(a.z, b.z, c.z, halfExtents.z + limit);
  isFar |= fabs(dotWide(normal, a)) > dotWide(abs3Wide(normal), half3) + limit;
  const float limitSqr = limit * limit;
  isFar |= besideWide(a, b, normal, half3, limitSqr) | besideWide(b, c, normal, half3, limitSqr) |
           besideWide(c, a, normal, half3, limitSqr);
  vstore16(~isFar | isSliver, 0, out->mayTouch);
}

WIDE Triangle triangleOf(const WideTriangles* t, int l) {
  if (t->slivers[l]) return makeTriangle(laneOf(t->a, l), laneOf(t->b, l), laneOf(t->c, l));
  Triangle one;
  one.a = laneOf(t->a, l);
  one.b = laneOf(t->b, l);
  one.c = laneOf(t->c, l);
  one.plane = withW(laneOf(t->normals, l), t->heights[l]);
  one.size = t->sizes[l];
  return one;
}

#endif
