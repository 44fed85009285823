// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The solver's rows, BTGPU_WIDE neighbouring slots at once in explicit vectors: the CPU shape's way to lanes (PoCL's
// own vectoriser gives up on gather, solve and scatter). Every lane is rounded as in rows.h, operation by operation.
// OpenCL C only.
#ifndef BTGPU_LIB_ROWS_WIDE_H
#define BTGPU_LIB_ROWS_WIDE_H
#include "../shared/body.h"
#include "../shared/rows.h"
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

// ---- the fields of a row; lanes that are not live read as zero

WIDE Lanes loadWide(__global const float* slot, int field, LaneMask live) {
  return pick(live, *(__global const Lanes*)(slot + field * BTGPU_LANES), (Lanes)0.0f);
}
WIDE Lanes3 loadWide3(__global const float* slot, int field, LaneMask live) {
  Lanes3 v;
  v.x = loadWide(slot, field, live);
  v.y = loadWide(slot, field + 1, live);
  v.z = loadWide(slot, field + 2, live);
  return v;
}
WIDE void storeWide(__global float* slot, int field, Lanes value) {
  *(__global Lanes*)(slot + field * BTGPU_LANES) = value;
}
// In lanes that are not live the field stays as it is.
WIDE void storeLive(__global float* slot, int field, Lanes value, LaneMask live) {
  __global Lanes* to = (__global Lanes*)(slot + field * BTGPU_LANES);
  *to = pick(live, value, *to);
}
WIDE void storeWide3(__global float* slot, int field, Lanes3 v, LaneMask live) {
  storeLive(slot, field, v.x, live);
  storeLive(slot, field + 1, v.y, live);
  storeLive(slot, field + 2, v.z, live);
}

// ---- bodies

STRUCT(WideBody) {
  Lanes3 linear, angular;
  Lanes3 mass0, mass1, mass2;  // SolverMass
  Lanes3 massLinear;
};

WIDE Lanes3 take3(Lanes4 v, LaneMask moved) {
  Lanes3 r;
  r.x = pick(moved, v.x, (Lanes)0.0f);
  r.y = pick(moved, v.y, (Lanes)0.0f);
  r.z = pick(moved, v.z, (Lanes)0.0f);
  return r;
}

// Lanes whose body is fixed (index NO_INDEX) get no velocity and no response; `safe` has another index there.
WIDE WideBody loadWideBody(__global const SolverMass* masses, const uint* safe, LaneMask moved) {
  WideBody b;
  const Lanes4 r0 = gatherWide(&masses->row0, 3, safe), r1 = gatherWide(&masses->row1, 3, safe),
               r2 = gatherWide(&masses->row2, 3, safe);
  b.mass0 = take3(r0, moved);
  b.mass1 = take3(r1, moved);
  b.mass2 = take3(r2, moved);
  b.massLinear.x = pick(moved, r0.w, (Lanes)0.0f);
  b.massLinear.y = pick(moved, r1.w, (Lanes)0.0f);
  b.massLinear.z = pick(moved, r2.w, (Lanes)0.0f);
  return b;
}

// ---- rowVelocity, applyRowImpulse, solveRow of rows.h

WIDE Lanes rowVelocityWide(const WideBody* a, const WideBody* b, Lanes3 n, Lanes3 ra, Lanes3 rb) {
  return dotWide(n, a->linear) + dotWide(crossWide(ra, n), a->angular) - dotWide(n, b->linear) -
         dotWide(crossWide(rb, n), b->angular);
}

WIDE void applyRowImpulseWide(WideBody* a, WideBody* b, Lanes3 n, Lanes3 ra, Lanes3 rb, Lanes impulse) {
  const Lanes3 p = timesWide(n, impulse), ta = crossWide(ra, p), tb = crossWide(rb, p);
  a->linear.x += a->massLinear.x * p.x;
  a->linear.y += a->massLinear.y * p.y;
  a->linear.z += a->massLinear.z * p.z;
  a->angular.x += dotWide(a->mass0, ta);
  a->angular.y += dotWide(a->mass1, ta);
  a->angular.z += dotWide(a->mass2, ta);
  b->linear.x -= b->massLinear.x * p.x;
  b->linear.y -= b->massLinear.y * p.y;
  b->linear.z -= b->massLinear.z * p.z;
  b->angular.x -= dotWide(b->mass0, tb);
  b->angular.y -= dotWide(b->mass1, tb);
  b->angular.z -= dotWide(b->mass2, tb);
}

// Lanes that are not live keep their impulse. NaN becomes `lower`, as fmax and fmin have it.
WIDE Lanes solveRowWide(WideBody* a, WideBody* b, Lanes3 n, Lanes3 ra, Lanes3 rb, Lanes jac, Lanes rhs, Lanes cfm,
                        Lanes impulse, Lanes lower, Lanes upper, LaneMask live) {
  const Lanes wanted = impulse + rhs - impulse * cfm - rowVelocityWide(a, b, n, ra, rb) * jac;
  const Lanes raised = pick(wanted > lower, wanted, lower);
  const Lanes clamped = pick(live, pick(raised < upper, raised, upper), impulse);
  applyRowImpulseWide(a, b, n, ra, rb, clamped - impulse);
  return clamped;
}

#endif
