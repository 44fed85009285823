// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The separating axis test of BTGPU_WIDE pairs of boxes at once; the same as separatingAxisBoxBox, pair by pair
// (box_box.h). OpenCL C only.
#ifndef BTGPU_LIB_BOX_BOX_WIDE_H
#define BTGPU_LIB_BOX_BOX_WIDE_H
#include "../shared/body.h"
#include "../shared/shape.h"
#include "box_box.h"
#include "wide.h"

// AxisSearch
STRUCT(WideSearch) {
  Lanes separation;
  Lanes3 normal;
  int16 code;
  LaneMask separated;
};

WIDE Lanes3 makeWide(Lanes x, Lanes y, Lanes z) {
  Lanes3 v;
  v.x = x;
  v.y = y;
  v.z = z;
  return v;
}

WIDE void takeWide(WideSearch* best, LaneMask better, Lanes separation, Lanes3 normal, int code) {
  better &= ~best->separated;
  best->separation = pick(better, separation, best->separation);
  best->normal.x = pick(better, normal.x, best->normal.x);
  best->normal.y = pick(better, normal.y, best->normal.y);
  best->normal.z = pick(better, normal.z, best->normal.z);
  best->code = better ? (int16)code : best->code;
}

// tryFace; `normal` as it is where B lies ahead.
WIDE void tryFaceWide(WideSearch* best, Lanes distance, Lanes reach, Lanes3 normal, int code) {
  const Lanes separation = fabs(distance) - reach;
  best->separated |= separation > 0.0f;
  const LaneMask behind = distance < 0.0f;
  normal.x = pick(behind, -normal.x, normal.x);
  normal.y = pick(behind, -normal.y, normal.y);
  normal.z = pick(behind, -normal.z, normal.z);
  takeWide(best, separation > best->separation, separation, normal, code);
}

// tryEdge
WIDE void tryEdgeWide(WideSearch* best, Lanes3 axis, Lanes distance, Lanes reach, int code) {
  const Lanes separation = fabs(distance) - reach;
  best->separated |= separation > BTGPU_EPSILON;
  const Lanes length = sqrt(dotWide(axis, axis)), scaled = separation / length;
  const LaneMask worse = (length <= BTGPU_EPSILON) | (scaled * EDGE_PENALTY <= best->separation);
  const Lanes factor = pick(distance < 0.0f, (Lanes)-1.0f, (Lanes)1.0f) / length;
  takeWide(best, ~worse, scaled, timesWide(axis, factor), code);
}

// separatingAxisBoxBox
WIDE WideSearch separatingAxesWide(Lanes3 a, WideMatrix ra, Lanes3 b, WideMatrix rb, Lanes3 bFromA) {
  WideSearch best;
  best.separation = -BTGPU_LARGE;
  best.normal = makeWide((Lanes)0.0f, (Lanes)0.0f, (Lanes)0.0f);
  best.code = -2;
  best.separated = 0;
  const Lanes3 t = mulTransposedWide(ra, bFromA);
  const Lanes3 bx = mulTransposedWide(ra, makeWide(rb.row0.x, rb.row1.x, rb.row2.x));
  const Lanes3 by = mulTransposedWide(ra, makeWide(rb.row0.y, rb.row1.y, rb.row2.y));
  const Lanes3 bz = mulTransposedWide(ra, makeWide(rb.row0.z, rb.row1.z, rb.row2.z));
  const Lanes3 ax = abs3Wide(bx), ay = abs3Wide(by), az = abs3Wide(bz);
  const Lanes one = 1.0f, zero = 0.0f, slack = EDGE_SLACK;

  tryFaceWide(&best, t.x, a.x + (b.x * ax.x + b.y * ay.x + b.z * az.x), makeWide(one, zero, zero), 0);
  tryFaceWide(&best, t.y, a.y + (b.x * ax.y + b.y * ay.y + b.z * az.y), makeWide(zero, one, zero), 1);
  tryFaceWide(&best, t.z, a.z + (b.x * ax.z + b.y * ay.z + b.z * az.z), makeWide(zero, zero, one), 2);
  tryFaceWide(&best, dotWide(t, bx), dotWide(a, ax) + b.x, bx, 3);
  tryFaceWide(&best, dotWide(t, by), dotWide(a, ay) + b.y, by, 4);
  tryFaceWide(&best, dotWide(t, bz), dotWide(a, az) + b.z, bz, 5);

  // Of A's axis i and each of B's.
#define EDGES(i, AXIS, DISTANCE, REACH)                                                                           \
  tryEdgeWide(&best, AXIS(bx), DISTANCE(bx), REACH(ax) + (b.y * (az.i + slack) + b.z * (ay.i + slack)), EDGE_CODE); \
  tryEdgeWide(&best, AXIS(by), DISTANCE(by), REACH(ay) + (b.x * (az.i + slack) + b.z * (ax.i + slack)), EDGE_CODE + 1); \
  tryEdgeWide(&best, AXIS(bz), DISTANCE(bz), REACH(az) + (b.x * (ay.i + slack) + b.y * (ax.i + slack)), EDGE_CODE + 2)
#define AXIS_X(v) makeWide(zero, -v.z, v.y)
#define DISTANCE_X(v) (t.y * -v.z + t.z * v.y)
#define REACH_X(v) (a.y * (v.z + slack) + a.z * (v.y + slack))
#define AXIS_Y(v) makeWide(v.z, zero, -v.x)
#define DISTANCE_Y(v) (t.x * v.z + t.z * -v.x)
#define REACH_Y(v) (a.x * (v.z + slack) + a.z * (v.x + slack))
#define AXIS_Z(v) makeWide(-v.y, v.x, zero)
#define DISTANCE_Z(v) (t.x * -v.y + t.y * v.x)
#define REACH_Z(v) (a.x * (v.y + slack) + a.y * (v.x + slack))
#define EDGE_CODE 6
  EDGES(x, AXIS_X, DISTANCE_X, REACH_X);
#undef EDGE_CODE
#define EDGE_CODE 9
  EDGES(y, AXIS_Y, DISTANCE_Y, REACH_Y);
#undef EDGE_CODE
#define EDGE_CODE 12
  EDGES(z, AXIS_Z, DISTANCE_Z, REACH_Z);
#undef EDGE_CODE
#undef EDGES
  best.normal = mulMatrixWide(ra, best.normal);
  return best;
}

WIDE void shapesOfWide(__global const BodyInfo* infos, const uint* body, uint* shape) {
  for (int l = 0; l < BTGPU_WIDE; ++l) shape[l] = (uint)infos[body[l]].shapeIndex;
}

// Tests the pairs at positions first ... of the bucket, up to `count` of all; items[] is the bucket's.
WIDE void findAxesWide(uint first, uint count, __global const uint* items, __global const Pair* pairs,
                       __global const BodyInfo* infos, __global const Shape* shapes, __global const BodyPose* poses,
                       __global RawContacts* contacts, __global SeparatingAxis* axes) {
  uint bodyA[BTGPU_WIDE], bodyB[BTGPU_WIDE], shapeA[BTGPU_WIDE], shapeB[BTGPU_WIDE], position[BTGPU_WIDE];
  for (uint l = 0; l < BTGPU_WIDE; ++l) {
    const uint k = min(first + l, count - 1), i = items[k];
    bodyA[l] = pairs[i].bodyA;
    bodyB[l] = pairs[i].bodyB;
    position[l] = first + l < count ? k : NO_INDEX;
    contacts[i].count = 0;
  }
  shapesOfWide(infos, bodyA, shapeA);
  shapesOfWide(infos, bodyB, shapeB);
  const uint poseStride = sizeof(BodyPose) / 16, shapeStride = sizeof(Shape) / 16;
  const Lanes3 positionA = xyzWide(gatherWide(&poses->position, poseStride, bodyA));
  const Lanes3 positionB = xyzWide(gatherWide(&poses->position, poseStride, bodyB));
  const WideSearch found = separatingAxesWide(
      xyzWide(gatherWide(&shapes->extents, shapeStride, shapeA)),
      matrixFromQuaternionWide(gatherWide(&poses->orientation, poseStride, bodyA)),
      xyzWide(gatherWide(&shapes->extents, shapeStride, shapeB)),
      matrixFromQuaternionWide(gatherWide(&poses->orientation, poseStride, bodyB)), subtractWide(positionB, positionA));
  const int16 code = (found.separated | (found.code < 0)) ? (int16)-1 : found.code;
  const Lanes zero = 0.0f;
  scatterWide(&axes->normal, 2, position, found.normal, -found.separation);
  scatterWide(&axes->normal + 1, 2, position, makeWide(as_float16(code), zero, zero), zero);
}

#endif
