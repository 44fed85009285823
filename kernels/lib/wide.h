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

// Asks for `bytes` from an address that will be read soon and that the CPU can't guess. Interpreters know no such thing.
WIDE void prefetchSoon(__global const void* from, uint bytes) {
#if defined(__x86_64__) || defined(__aarch64__)
  for (uint at = 0; at < bytes; at += 64) __builtin_prefetch((const void*)((size_t)from + at), 0, 3);
#endif
}

// ---- transposition between an array of float4 and lanes

WIDE Lanes4 transposeWide(Lanes a, Lanes b, Lanes c, Lanes d) {
  const Lanes ab0 =
      (Lanes)(a.s0, b.s0, a.s1, b.s1, a.s4, b.s4, a.s5, b.s5, a.s8, b.s8, a.s9, b.s9, a.sC, b.sC, a.sD, b.sD);
  const Lanes ab2 =
      (Lanes)(a.s2, b.s2, a.s3, b.s3, a.s6, b.s6, a.s7, b.s7, a.sA, b.sA, a.sB, b.sB, a.sE, b.sE, a.sF, b.sF);
  const Lanes cd0 =
      (Lanes)(c.s0, d.s0, c.s1, d.s1, c.s4, d.s4, c.s5, d.s5, c.s8, d.s8, c.s9, d.s9, c.sC, d.sC, c.sD, d.sD);
  const Lanes cd2 =
      (Lanes)(c.s2, d.s2, c.s3, d.s3, c.s6, d.s6, c.s7, d.s7, c.sA, d.sA, c.sB, d.sB, c.sE, d.sE, c.sF, d.sF);
  Lanes4 t;
  t.x = (Lanes)(ab0.s01, cd0.s01, ab0.s45, cd0.s45, ab0.s89, cd0.s89, ab0.sCD, cd0.sCD);
  t.y = (Lanes)(ab0.s23, cd0.s23, ab0.s67, cd0.s67, ab0.sAB, cd0.sAB, ab0.sEF, cd0.sEF);
  t.z = (Lanes)(ab2.s01, cd2.s01, ab2.s45, cd2.s45, ab2.s89, cd2.s89, ab2.sCD, cd2.sCD);
  t.w = (Lanes)(ab2.s23, cd2.s23, ab2.s67, cd2.s67, ab2.sAB, cd2.sAB, ab2.sEF, cd2.sEF);
  return t;
}

// Element from[stride * index[lane]] for every lane.
WIDE Lanes4 gatherWide(__global const float4* from, uint stride, const uint* index) {
#define ROW(l) from[stride * index[l]]
  return transposeWide((Lanes)(ROW(0), ROW(4), ROW(8), ROW(12)), (Lanes)(ROW(1), ROW(5), ROW(9), ROW(13)),
                       (Lanes)(ROW(2), ROW(6), ROW(10), ROW(14)), (Lanes)(ROW(3), ROW(7), ROW(11), ROW(15)));
#undef ROW
}

// Element from[lane].
WIDE Lanes4 gatherHere(__global const float4* from) {
  const uint lane[BTGPU_WIDE] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return gatherWide(from, 1, lane);
}

// The other way round, where index[lane] is not NO_INDEX.
WIDE void scatterWide(__global float4* to, uint stride, const uint* index, Lanes3 v, Lanes w) {
  // Rows of the transposed 4 x 4 blocks: lanes 0, 4, 8, 12, then 1, 5, 9, 13, ...
  const Lanes xz0 = (Lanes)(v.x.s0, v.z.s0, v.x.s1, v.z.s1, v.x.s4, v.z.s4, v.x.s5, v.z.s5, v.x.s8, v.z.s8, v.x.s9,
                            v.z.s9, v.x.sC, v.z.sC, v.x.sD, v.z.sD);
  const Lanes xz2 = (Lanes)(v.x.s2, v.z.s2, v.x.s3, v.z.s3, v.x.s6, v.z.s6, v.x.s7, v.z.s7, v.x.sA, v.z.sA, v.x.sB,
                            v.z.sB, v.x.sE, v.z.sE, v.x.sF, v.z.sF);
  const Lanes yw0 = (Lanes)(v.y.s0, w.s0, v.y.s1, w.s1, v.y.s4, w.s4, v.y.s5, w.s5, v.y.s8, w.s8, v.y.s9, w.s9, v.y.sC,
                            w.sC, v.y.sD, w.sD);
  const Lanes yw2 = (Lanes)(v.y.s2, w.s2, v.y.s3, w.s3, v.y.s6, w.s6, v.y.s7, w.s7, v.y.sA, w.sA, v.y.sB, w.sB, v.y.sE,
                            w.sE, v.y.sF, w.sF);
  const Lanes a = (Lanes)(xz0.s0, yw0.s0, xz0.s1, yw0.s1, xz0.s4, yw0.s4, xz0.s5, yw0.s5, xz0.s8, yw0.s8, xz0.s9,
                          yw0.s9, xz0.sC, yw0.sC, xz0.sD, yw0.sD);
  const Lanes b = (Lanes)(xz0.s2, yw0.s2, xz0.s3, yw0.s3, xz0.s6, yw0.s6, xz0.s7, yw0.s7, xz0.sA, yw0.sA, xz0.sB,
                          yw0.sB, xz0.sE, yw0.sE, xz0.sF, yw0.sF);
  const Lanes c = (Lanes)(xz2.s0, yw2.s0, xz2.s1, yw2.s1, xz2.s4, yw2.s4, xz2.s5, yw2.s5, xz2.s8, yw2.s8, xz2.s9,
                          yw2.s9, xz2.sC, yw2.sC, xz2.sD, yw2.sD);
  const Lanes d = (Lanes)(xz2.s2, yw2.s2, xz2.s3, yw2.s3, xz2.s6, yw2.s6, xz2.s7, yw2.s7, xz2.sA, yw2.sA, xz2.sB,
                          yw2.sB, xz2.sE, yw2.sE, xz2.sF, yw2.sF);
#define PUT(l, value) \
  if (index[l] != NO_INDEX) to[stride * index[l]] = value
  PUT(0, a.s0123);
  PUT(4, a.s4567);
  PUT(8, a.s89AB);
  PUT(12, a.sCDEF);
  PUT(1, b.s0123);
  PUT(5, b.s4567);
  PUT(9, b.s89AB);
  PUT(13, b.sCDEF);
  PUT(2, c.s0123);
  PUT(6, c.s4567);
  PUT(10, c.s89AB);
  PUT(14, c.sCDEF);
  PUT(3, d.s0123);
  PUT(7, d.s4567);
  PUT(11, d.s89AB);
  PUT(15, d.sCDEF);
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
