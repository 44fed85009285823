// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stage 70's passes over BTGPU_WIDE slots at once; the same as solveSlot, slot by slot (70_solve_velocities.cl).
// OpenCL C only.
#ifndef BTGPU_LIB_SOLVE_WIDE_H
#define BTGPU_LIB_SOLVE_WIDE_H
#include "rows_wide.h"

// Whose rows a block holds.
STRUCT(WideSlots) {
  uint bodyA[BTGPU_WIDE], bodyB[BTGPU_WIDE];  // NO_INDEX where the solver must not move the body
  uint safeA[BTGPU_WIDE], safeB[BTGPU_WIDE];  // the same, or a body that this block moves: no other work item writes it
  LaneMask movedA, movedB;
  int16 pointCount;
  int maxPoints;
};

WIDE void loadSlots(__global const SlotHeader* slots, WideSlots* w) {
  const Lanes4 h = gatherHere((__global const float4*)slots);
  const uint16 a = as_uint16(h.x), b = as_uint16(h.y);
  w->movedA = a != NO_INDEX;
  w->movedB = b != NO_INDEX;
  w->pointCount = as_int16(h.w);  // 0 in lanes without a constraint
  w->maxPoints = maxLane(w->pointCount);
  vstore16(a, 0, w->bodyA);
  vstore16(b, 0, w->bodyB);
  const uint16 own = w->movedA.s0 ? a.s0 : b.s0;  // lanes are filled from the first one on
  vstore16(w->movedA ? a : own, 0, w->safeA);
  vstore16(w->movedB ? b : own, 0, w->safeB);
}

WIDE __global float* wideRows(__global float* rows, uint k) { return rows + k * POINT_FIELDS * BTGPU_LANES; }

WIDE __global float* wideTangent2(__global float* tangent2, uint k) {
  return tangent2 ? tangent2 + k * TANGENT2_FIELDS * BTGPU_LANES : 0;
}

WIDE void solveFrictionWide(__global float* p, __global float* q, WideBody* a, WideBody* b, LaneMask live) {
  const Lanes normalImpulse = loadWide(p, ROW_NORMAL_IMPULSE, live);
  const LaneMask pressed = normalImpulse > 0.0f;
  if (!anyLane(pressed)) return;
  const Lanes limit = loadWide(p, ROW_FRICTION, live) * normalImpulse;
  const Lanes3 ra = loadWide3(p, ROW_R_A, live), rb = loadWide3(p, ROW_R_B, live);
  const Lanes impulse1 = solveRowWide(a, b, loadWide3(p, ROW_TANGENT1, live), ra, rb,
                                      loadWide(p, ROW_TANGENT1_JAC, live), loadWide(p, ROW_TANGENT1_RHS, live),
                                      (Lanes)0.0f, loadWide(p, ROW_TANGENT1_IMPULSE, live), -limit, limit, pressed);
  storeWide(p, ROW_TANGENT1_IMPULSE, impulse1);
  if (!q) return;
  const Lanes impulse2 = solveRowWide(a, b, loadWide3(q, ROW_TANGENT2, live), ra, rb,
                                      loadWide(q, ROW_TANGENT2_JAC, live), loadWide(q, ROW_TANGENT2_RHS, live),
                                      (Lanes)0.0f, loadWide(q, ROW_TANGENT2_IMPULSE, live), -limit, limit, pressed);
  storeWide(q, ROW_TANGENT2_IMPULSE, impulse2);
}

WIDE void solveNormalWide(__global float* p, WideBody* a, WideBody* b, LaneMask live) {
  const Lanes impulse = solveRowWide(a, b, loadWide3(p, ROW_NORMAL, live), loadWide3(p, ROW_R_A, live),
                                     loadWide3(p, ROW_R_B, live), loadWide(p, ROW_NORMAL_JAC, live),
                                     loadWide(p, ROW_NORMAL_RHS, live), loadWide(p, ROW_NORMAL_CFM, live),
                                     loadWide(p, ROW_NORMAL_IMPULSE, live), (Lanes)0.0f, (Lanes)INFINITY, live);
  storeWide(p, ROW_NORMAL_IMPULSE, impulse);
}

// Split impulse, as solvePush.
WIDE void solvePushWide(const WideSlots* w, __global float* rows, __global SolverBody* bodies, WideBody a, WideBody b) {
  LaneMask pushed = 0;
  for (int k = 0; k < w->maxPoints; ++k) {
    pushed |= loadWide(wideRows(rows, k), ROW_PUSH_RHS, w->pointCount > k) != 0.0f;
  }
  if (!anyLane(pushed)) return;
  a.linear = take3(gatherWide(&bodies->pushLinear, 4, w->safeA), w->movedA);
  a.angular = take3(gatherWide(&bodies->turnAngular, 4, w->safeA), w->movedA);
  b.linear = take3(gatherWide(&bodies->pushLinear, 4, w->safeB), w->movedB);
  b.angular = take3(gatherWide(&bodies->turnAngular, 4, w->safeB), w->movedB);
  for (int k = 0; k < w->maxPoints; ++k) {
    __global float* p = wideRows(rows, k);
    const LaneMask live = w->pointCount > k;
    const Lanes rhs = loadWide(p, ROW_PUSH_RHS, live);
    const Lanes impulse =
        solveRowWide(&a, &b, loadWide3(p, ROW_NORMAL, live), loadWide3(p, ROW_R_A, live), loadWide3(p, ROW_R_B, live),
                     loadWide(p, ROW_NORMAL_JAC, live), rhs, loadWide(p, ROW_NORMAL_CFM, live),
                     loadWide(p, ROW_PUSH_IMPULSE, live), (Lanes)0.0f, (Lanes)INFINITY, rhs != 0.0f);
    storeWide(p, ROW_PUSH_IMPULSE, impulse);
  }
  scatterWide(&bodies->pushLinear, 4, w->bodyA, a.linear, (Lanes)0.0f);
  scatterWide(&bodies->turnAngular, 4, w->bodyA, a.angular, (Lanes)0.0f);
  scatterWide(&bodies->pushLinear, 4, w->bodyB, b.linear, (Lanes)0.0f);
  scatterWide(&bodies->turnAngular, 4, w->bodyB, b.angular, (Lanes)0.0f);
}

// All passes but the torsional one. `slots`, `rows`, `tangent2` are those of the block's first slot; tangent2 may be
// null.
WIDE void solveWide(uint passes, uint flags, __global const SlotHeader* slots, __global const SolverMass* masses,
                    __global SolverBody* bodies, __global float* rows, __global float* tangent2) {
  WideSlots w;
  loadSlots(slots, &w);
  if (w.maxPoints == 0) return;
  const int pointwise = (passes & PASS_FRICTION) && (flags & STEP_INTERLEAVE);
  WideBody a = loadWideBody(masses, w.safeA, w.movedA), b = loadWideBody(masses, w.safeB, w.movedB);
  a.linear = take3(gatherWide(&bodies->deltaLinear, 4, w.safeA), w.movedA);
  a.angular = take3(gatherWide(&bodies->deltaAngular, 4, w.safeA), w.movedA);
  b.linear = take3(gatherWide(&bodies->deltaLinear, 4, w.safeB), w.movedB);
  b.angular = take3(gatherWide(&bodies->deltaAngular, 4, w.safeB), w.movedB);
  for (int k = 0; k < w.maxPoints; ++k) {
    __global float* p = wideRows(rows, k);
    const LaneMask live = w.pointCount > k;
    if (passes & PASS_WARM_START) {
      applyRowImpulseWide(&a, &b, loadWide3(p, ROW_NORMAL, live), loadWide3(p, ROW_R_A, live),
                          loadWide3(p, ROW_R_B, live), loadWide(p, ROW_NORMAL_IMPULSE, live));
    }
    if (passes & PASS_NORMAL) solveNormalWide(p, &a, &b, live);
    if (pointwise) solveFrictionWide(p, wideTangent2(tangent2, k), &a, &b, live);
  }
  for (int k = 0; k < w.maxPoints && (passes & PASS_FRICTION) && !pointwise; ++k) {
    solveFrictionWide(wideRows(rows, k), wideTangent2(tangent2, k), &a, &b, w.pointCount > k);
  }
  scatterWide(&bodies->deltaLinear, 4, w.bodyA, a.linear, (Lanes)0.0f);
  scatterWide(&bodies->deltaAngular, 4, w.bodyA, a.angular, (Lanes)0.0f);
  scatterWide(&bodies->deltaLinear, 4, w.bodyB, b.linear, (Lanes)0.0f);
  scatterWide(&bodies->deltaAngular, 4, w.bodyB, b.angular, (Lanes)0.0f);
  if ((passes & PASS_NORMAL) && (flags & STEP_SPLIT_IMPULSE)) solvePushWide(&w, rows, bodies, a, b);
}

// The torsional pass, as solveTorsionRows; by itself, since it touches nothing but angular velocities.
WIDE void solveTorsionWide(__global const SlotHeader* slots, __global const SolverMass* masses,
                           __global SolverBody* bodies, __global const float* rows, __global float* torsion) {
  WideSlots w;
  loadSlots(slots, &w);
  LaneMask pressed = 0;
  for (int k = 0; k < w.maxPoints; ++k) {
    pressed |= loadWide(rows + k * POINT_FIELDS * BTGPU_LANES, ROW_NORMAL_IMPULSE, w.pointCount > k) > 0.0f;
  }
  if (!anyLane(pressed)) return;
  WideBody a = loadWideBody(masses, w.safeA, w.movedA), b = loadWideBody(masses, w.safeB, w.movedB);
  a.angular = take3(gatherWide(&bodies->deltaAngular, 4, w.safeA), w.movedA);
  b.angular = take3(gatherWide(&bodies->deltaAngular, 4, w.safeB), w.movedB);
  for (int k = 0; k < w.maxPoints; ++k) {
    const Lanes normalImpulse =
        loadWide(rows + k * POINT_FIELDS * BTGPU_LANES, ROW_NORMAL_IMPULSE, w.pointCount > k);
    for (uint r = 0; r < TORSION_ROWS; ++r) {
      __global float* t = torsion + (k * TORSION_ROWS + r) * TORSION_FIELDS * BTGPU_LANES;
      const Lanes friction = loadWide(t, ROW_TORSION_FRICTION, normalImpulse > 0.0f);
      const LaneMask live = friction > 0.0f;
      if (!anyLane(live)) continue;
      const Lanes3 axis = loadWide3(t, ROW_TORSION_AXIS, live);
      const Lanes scaled = friction * normalImpulse, limit = pick(scaled < friction, scaled, friction);
      const Lanes impulse = loadWide(t, ROW_TORSION_IMPULSE, live);
      const Lanes velocity = dotWide(axis, subtractWide(b.angular, a.angular));
      const Lanes wanted =
          impulse + loadWide(t, ROW_TORSION_RHS, live) - velocity * loadWide(t, ROW_TORSION_JAC, live);
      const Lanes raised = pick(wanted > -limit, wanted, -limit);
      const Lanes clamped = pick(raised < limit, raised, limit);
      const Lanes3 p = timesWide(axis, clamped - impulse);
      a.angular.x -= dotWide(a.mass0, p);
      a.angular.y -= dotWide(a.mass1, p);
      a.angular.z -= dotWide(a.mass2, p);
      b.angular.x += dotWide(b.mass0, p);
      b.angular.y += dotWide(b.mass1, p);
      b.angular.z += dotWide(b.mass2, p);
      storeLive(t, ROW_TORSION_IMPULSE, clamped, live);
    }
  }
  scatterWide(&bodies->deltaAngular, 4, w.bodyA, a.angular, (Lanes)0.0f);
  scatterWide(&bodies->deltaAngular, 4, w.bodyB, b.angular, (Lanes)0.0f);
}

#endif
