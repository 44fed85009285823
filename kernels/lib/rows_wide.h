// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The solver's rows, BTGPU_WIDE neighbouring slots at once (wide.h). Every lane is rounded as in rows.h, operation by
// operation. OpenCL C only.
#ifndef BTGPU_LIB_ROWS_WIDE_H
#define BTGPU_LIB_ROWS_WIDE_H
#include "../shared/body.h"
#include "../shared/rows.h"
#include "wide.h"

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
