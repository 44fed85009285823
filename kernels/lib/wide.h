// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// BTGPU_WIDE items at once in explicit vectors: the CPU shape's way to lanes (PoCL's own vectoriser gives up on gather,
// solve and scatter). Every lane is rounded as in vec.h, operation by operation. OpenCL C only.
#ifndef BTGPU_LIB_WIDE_H
#define BTGPU_LIB_WIDE_H
#include "../shared/types.h"
#include "vec.h"

#define BTGPU_WIDE 16  // divides BTGPU_LANES
#ifdef __OPTIMIZE__
#define WIDE static inline __attribute__((always_inline))
#else
#define WIDE static inline
#endif
typedef float16 Lanes;
typedef int16 LaneMask;  // -1 or 0

STRUCT(Lanes3) { Lanes x, y, z; };
STRUCT(Lanes4) { Lanes x, y, z, w; };

WIDE Lanes pick(LaneMask mask, Lanes yes, Lanes no) { return mask ? yes : no; }
WIDE LaneMask isFiniteWide(Lanes v) { return (as_int16(v) & 0x7f800000) != 0x7f800000; }
WIDE int anyLane(LaneMask mask) {
  const int8 a = mask.lo | mask.hi;
  const int4 b = a.lo | a.hi;
  const int2 c = b.lo | b.hi;
  return (c.x | c.y) != 0;
}

WIDE int maxLane(int16 v) {
  const int8 a = max(v.lo, v.hi);
  const int4 b = max(a.lo, a.hi);
  const int2 c = max(b.lo, b.hi);
  return max(c.x, c.y);
}

// The index of the largest value, of several as large the lowest one.
WIDE int firstOfMost(Lanes value, int16 index, float* most) {
  const int8 m8 = (value.hi > value.lo) | ((value.hi == value.lo) & (index.hi < index.lo));
  const float8 f8 = m8 ? value.hi : value.lo;
  const int8 i8 = m8 ? index.hi : index.lo;
  const int4 m4 = (f8.hi > f8.lo) | ((f8.hi == f8.lo) & (i8.hi < i8.lo));
  const float4 f4 = m4 ? f8.hi : f8.lo;
  const int4 i4 = m4 ? i8.hi : i8.lo;
  const int2 m2 = (f4.hi > f4.lo) | ((f4.hi == f4.lo) & (i4.hi < i4.lo));
  const float2 f2 = m2 ? f4.hi : f4.lo;
  const int2 i2 = m2 ? i4.hi : i4.lo;
  const int last = (f2.y > f2.x) | ((f2.y == f2.x) & (i2.y < i2.x));
  *most = last ? f2.y : f2.x;
  return last ? i2.y : i2.x;
}

// dot3, cross3, ... of vec.h
WIDE Lanes dotWide(Lanes3 a, Lanes3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
WIDE Lanes3 crossWide(Lanes3 a, Lanes3 b) {
  Lanes3 c;
  c.x = a.y * b.z - a.z * b.y;
  c.y = a.z * b.x - a.x * b.z;
  c.z = a.x * b.y - a.y * b.x;
  return c;
}
WIDE Lanes3 timesWide(Lanes3 a, Lanes s) {
  a.x *= s;
  a.y *= s;
  a.z *= s;
  return a;
}

// ---- transposition between an array of float4 and lanes

// clang's own, which stands behind every OpenCL for CPUs: vectors put together from elements become twice as many
// instructions.
#define SHUFFLE __builtin_shufflevector

// Within each four lanes of two vectors: their first two elements in turn, or their last two; then by twos.
#define UNPACK_LOW(a, b) SHUFFLE(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29)
#define UNPACK_HIGH(a, b) SHUFFLE(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31)
#define UNPACK_LOW2(a, b) SHUFFLE(a, b, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29)
#define UNPACK_HIGH2(a, b) SHUFFLE(a, b, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31)

// Each four lanes of a, b, c, d as a matrix, transposed.
WIDE Lanes4 transposeWide(Lanes a, Lanes b, Lanes c, Lanes d) {
  const Lanes ab0 = UNPACK_LOW(a, b), ab2 = UNPACK_HIGH(a, b), cd0 = UNPACK_LOW(c, d), cd2 = UNPACK_HIGH(c, d);
  Lanes4 t;
  t.x = UNPACK_LOW2(ab0, cd0);
  t.y = UNPACK_HIGH2(ab0, cd0);
  t.z = UNPACK_LOW2(ab2, cd2);
  t.w = UNPACK_HIGH2(ab2, cd2);
  return t;
}

WIDE Lanes joinWide(float4 a, float4 b, float4 c, float4 d) {
  const float8 ab = SHUFFLE(a, b, 0, 1, 2, 3, 4, 5, 6, 7), cd = SHUFFLE(c, d, 0, 1, 2, 3, 4, 5, 6, 7);
  return SHUFFLE(ab, cd, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}

// Element from[stride * index[lane]] for every lane.
WIDE Lanes4 gatherWide(__global const float4* from, uint stride, const uint* index) {
#define ROW(l) from[stride * index[l]]
  return transposeWide(joinWide(ROW(0), ROW(4), ROW(8), ROW(12)), joinWide(ROW(1), ROW(5), ROW(9), ROW(13)),
                       joinWide(ROW(2), ROW(6), ROW(10), ROW(14)), joinWide(ROW(3), ROW(7), ROW(11), ROW(15)));
#undef ROW
}

// Element from[lane].
WIDE Lanes4 gatherHere(__global const float4* from) {
  const uint lane[BTGPU_WIDE] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return gatherWide(from, 1, lane);
}

// The other way round, where index[lane] is not NO_INDEX.
WIDE void scatterWide(__global float4* to, uint stride, const uint* index, Lanes3 v, Lanes w) {
  const Lanes4 t = transposeWide(v.x, v.y, v.z, w);  // t.x: lanes 0, 4, 8, 12; t.y: 1, 5, 9, 13; ...
#define PUT(l, value) \
  if (index[l] != NO_INDEX) to[stride * index[l]] = value
  PUT(0, t.x.s0123);
  PUT(4, t.x.s4567);
  PUT(8, t.x.s89AB);
  PUT(12, t.x.sCDEF);
  PUT(1, t.y.s0123);
  PUT(5, t.y.s4567);
  PUT(9, t.y.s89AB);
  PUT(13, t.y.sCDEF);
  PUT(2, t.z.s0123);
  PUT(6, t.z.s4567);
  PUT(10, t.z.s89AB);
  PUT(14, t.z.sCDEF);
  PUT(3, t.w.s0123);
  PUT(7, t.w.s4567);
  PUT(11, t.w.s89AB);
  PUT(15, t.w.sCDEF);
#undef PUT
}

// ---- vectors and matrices, as in vec.h

STRUCT(WideMatrix) { Lanes3 row0, row1, row2; };

WIDE Lanes3 xyzWide(Lanes4 v) {
  Lanes3 r;
  r.x = v.x;
  r.y = v.y;
  r.z = v.z;
  return r;
}
WIDE Lanes3 addWide(Lanes3 a, Lanes3 b) {
  a.x += b.x;
  a.y += b.y;
  a.z += b.z;
  return a;
}
WIDE Lanes3 subtractWide(Lanes3 a, Lanes3 b) {
  a.x -= b.x;
  a.y -= b.y;
  a.z -= b.z;
  return a;
}
WIDE Lanes3 mulMatrixWide(WideMatrix m, Lanes3 v) {
  Lanes3 r;
  r.x = dotWide(m.row0, v);
  r.y = dotWide(m.row1, v);
  r.z = dotWide(m.row2, v);
  return r;
}
WIDE Lanes3 mulTransposedWide(WideMatrix m, Lanes3 v) {
  Lanes3 r;
  r.x = m.row0.x * v.x + m.row1.x * v.y + m.row2.x * v.z;
  r.y = m.row0.y * v.x + m.row1.y * v.y + m.row2.y * v.z;
  r.z = m.row0.z * v.x + m.row1.z * v.y + m.row2.z * v.z;
  return r;
}
WIDE WideMatrix matrixFromQuaternionWide(Lanes4 q) {
  WideMatrix m;
  const Lanes s = 2.0f / (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  const Lanes xs = q.x * s, ys = q.y * s, zs = q.z * s;
  const Lanes wx = q.w * xs, wy = q.w * ys, wz = q.w * zs;
  const Lanes xx = q.x * xs, xy = q.x * ys, xz = q.x * zs;
  const Lanes yy = q.y * ys, yz = q.y * zs, zz = q.z * zs;
  m.row0.x = 1.0f - (yy + zz);
  m.row0.y = xy - wz;
  m.row0.z = xz + wy;
  m.row1.x = xy + wz;
  m.row1.y = 1.0f - (xx + zz);
  m.row1.z = yz - wx;
  m.row2.x = xz - wy;
  m.row2.y = yz + wx;
  m.row2.z = 1.0f - (xx + yy);
  return m;
}

WIDE Lanes3 broadcastWide(float4 v) {
  Lanes3 r;
  r.x = (Lanes)v.x;
  r.y = (Lanes)v.y;
  r.z = (Lanes)v.z;
  return r;
}
WIDE Lanes3 abs3Wide(Lanes3 v) {
  v.x = fabs(v.x);
  v.y = fabs(v.y);
  v.z = fabs(v.z);
  return v;
}
WIDE Lanes3 pick3(LaneMask mask, Lanes3 yes, Lanes3 no) {
  yes.x = pick(mask, yes.x, no.x);
  yes.y = pick(mask, yes.y, no.y);
  yes.z = pick(mask, yes.z, no.z);
  return yes;
}

// ---- lanes in private memory: x of all, y of all, z of all

WIDE void storeLanes3(Lanes3 v, float* to) {
  vstore16(v.x, 0, to);
  vstore16(v.y, 1, to);
  vstore16(v.z, 2, to);
}
WIDE Lanes3 loadLanes3(const float* from) {
  Lanes3 r;
  r.x = vload16(0, from);
  r.y = vload16(1, from);
  r.z = vload16(2, from);
  return r;
}
WIDE float4 laneOf(const float* from, int lane) {
  return vec3(from[lane], from[BTGPU_WIDE + lane], from[2 * BTGPU_WIDE + lane]);
}
WIDE void setLane(float* to, int lane, float4 v) {
  to[lane] = v.x;
  to[BTGPU_WIDE + lane] = v.y;
  to[2 * BTGPU_WIDE + lane] = v.z;
}

#endif
