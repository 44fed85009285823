// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The passes of the fast mode over BTGPU_WIDE slots at once; the same as solveSoftSlot, slot by slot
// (70_solve_substeps.cl), operation by operation as in soft.h. OpenCL C only.
#ifndef BTGPU_LIB_SOFT_WIDE_H
#define BTGPU_LIB_SOFT_WIDE_H
#include "soft.h"
#include "solve_wide.h"

WIDE Lanes greaterWide(Lanes a, Lanes b) { return pick(a > b, a, b); }  // fmax for numbers
WIDE Lanes smallerWide(Lanes a, Lanes b) { return pick(a < b, a, b); }

// A point's Jacobian.
STRUCT(WideNormal) { Lanes3 normal, angularA, angularB; };

WIDE WideNormal loadSoftNormal(__global const float* p, LaneMask live) {
  WideNormal n;
  n.normal = loadWide3(p, SOFT_NORMAL, live);
  n.angularA = loadWide3(p, SOFT_ANGULAR_A, live);
  n.angularB = loadWide3(p, SOFT_ANGULAR_B, live);
  return n;
}

WIDE Lanes alongNormalWide(const WideNormal* n, Lanes3 linearA, Lanes3 angularA, Lanes3 linearB, Lanes3 angularB) {
  return dotWide(n->normal, subtractWide(linearA, linearB)) + dotWide(n->angularA, angularA) -
         dotWide(n->angularB, angularB);
}

WIDE void pushWide(WideBody* b, Lanes3 push, Lanes3 turn, Lanes sign) {
  b->linear.x += sign * (b->massLinear.x * push.x);
  b->linear.y += sign * (b->massLinear.y * push.y);
  b->linear.z += sign * (b->massLinear.z * push.z);
  b->angular.x += sign * dotWide(b->mass0, turn);
  b->angular.y += sign * dotWide(b->mass1, turn);
  b->angular.z += sign * dotWide(b->mass2, turn);
}

WIDE void applySoftNormalWide(WideBody* a, WideBody* b, const WideNormal* n, Lanes impulse) {
  const Lanes3 push = timesWide(n->normal, impulse);
  pushWide(a, push, timesWide(n->angularA, impulse), (Lanes)1.0f);
  pushWide(b, push, timesWide(n->angularB, impulse), (Lanes)-1.0f);
}

// Motion of both bodies since the start of the step.
STRUCT(WideMotion) { Lanes3 linearA, angularA, linearB, angularB; };

// solveSoftNormal; lanes whose contact is to something fixed have a softness of their own. The new impulse.
WIDE Lanes solveSoftNormalWide(__global float* p, WideBody* a, WideBody* b, const WideMotion* m, SoftPass pass,
                               Lanes rate, Lanes contactShare, LaneMask live) {
  const WideNormal n = loadSoftNormal(p, live);
  const Lanes mass = loadWide(p, SOFT_MASS, live), held = loadWide(p, SOFT_HELD, live);
  const Lanes springShare = loadWide(p, SOFT_SPRING_SHARE, live), old = loadWide(p, SOFT_IMPULSE, live);
  const Lanes speed = alongNormalWide(&n, a->linear, a->angular, b->linear, b->angular) + held;
  const Lanes separation =
      loadWide(p, SOFT_SEPARATION, live) +
      (alongNormalWide(&n, m->linearA, m->angularA, m->linearB, m->angularB) + held * pass.time);
  const LaneMask apart = separation > 0.0f, spring = ~apart & (springShare != 0.0f);
  Lanes share = 1.0f, bias = pick(apart, separation / pass.h, (Lanes)0.0f);
  if (!pass.relax) {
    share = pick(apart, share, contactShare);
    bias = pick(apart, bias, greaterWide(rate * separation, (Lanes)(-pass.pushSpeed)));
  }
  if (anyLane(spring)) {
    share = pick(spring, springShare, share);
    bias = pick(spring, loadWide(p, SOFT_SPRING_RATE, live) * separation, bias);
  }
  const Lanes impulse = greaterWide(share * (old - mass * (speed + bias)), (Lanes)0.0f);
  applySoftNormalWide(a, b, &n, impulse - old);
  storeWide(p, SOFT_IMPULSE, impulse);
  if (pass.relax) storeWide(p, SOFT_TOTAL, loadWide(p, SOFT_TOTAL, live) + impulse);
  return impulse;
}

WIDE void bounceSoftNormalWide(__global float* p, WideBody* a, WideBody* b, LaneMask live) {
  const Lanes bounce = loadWide(p, SOFT_BOUNCE, live), total = loadWide(p, SOFT_TOTAL, live);
  const LaneMask hit = (bounce > 0.0f) & (total > 0.0f);
  if (!anyLane(hit)) return;
  const WideNormal n = loadSoftNormal(p, live);
  const Lanes old = loadWide(p, SOFT_IMPULSE, live);
  const Lanes speed = alongNormalWide(&n, a->linear, a->angular, b->linear, b->angular) + loadWide(p, SOFT_HELD, live);
  const Lanes wanted = greaterWide(old - loadWide(p, SOFT_MASS, live) * (speed - bounce), (Lanes)0.0f);
  const Lanes impulse = pick(hit, wanted, old);
  applySoftNormalWide(a, b, &n, impulse - old);
  storeWide(p, SOFT_IMPULSE, impulse);
  storeWide(p, SOFT_TOTAL, total + (impulse - old));
}

WIDE void applySoftFrictionWide(WideBody* a, WideBody* b, Lanes3 armA, Lanes3 armB, Lanes3 axis, Lanes3 push,
                                Lanes twist) {
  const Lanes3 turn = timesWide(axis, twist);
  pushWide(a, push, addWide(crossWide(armA, push), turn), (Lanes)1.0f);
  pushWide(b, push, addWide(crossWide(armB, push), turn), (Lanes)-1.0f);
}

WIDE Lanes3 combineWide(Lanes3 t1, Lanes s1, Lanes3 t2, Lanes s2) {
  return addWide(timesWide(t1, s1), timesWide(t2, s2));
}

WIDE void solveSoftFrictionWide(__global float* f, WideBody* a, WideBody* b, Lanes load, float step, int relax,
                                LaneMask live) {
  const Lanes3 armA = loadWide3(f, SOFT_ARM_A, live), armB = loadWide3(f, SOFT_ARM_B, live);
  const Lanes3 t1 = loadWide3(f, SOFT_TANGENT1, live), t2 = loadWide3(f, SOFT_TANGENT2, live);
  const Lanes3 axis = loadWide3(f, SOFT_AXIS, live);
  const Lanes old1 = loadWide(f, SOFT_IMPULSE1, live), old2 = loadWide(f, SOFT_IMPULSE2, live);
  const Lanes oldTwist = loadWide(f, SOFT_TWIST_IMPULSE, live), mass12 = loadWide(f, SOFT_MASS12, live);
  const Lanes3 slip = subtractWide(subtractWide(addWide(a->linear, crossWide(a->angular, armA)), b->linear),
                                   crossWide(b->angular, armB));
  const Lanes slip1 = dotWide(t1, slip) + loadWide(f, SOFT_HELD1, live);
  const Lanes slip2 = dotWide(t2, slip) + loadWide(f, SOFT_HELD2, live);
  const Lanes wanted1 = old1 - (loadWide(f, SOFT_MASS11, live) * slip1 + mass12 * slip2);
  const Lanes wanted2 = old2 - (mass12 * slip1 + loadWide(f, SOFT_MASS22, live) * slip2);
  const Lanes limit = loadWide(f, SOFT_COEFFICIENT, live) * load, sizeSqr = wanted1 * wanted1 + wanted2 * wanted2;
  const Lanes scale = pick(sizeSqr > limit * limit, limit / sqrt(sizeSqr), (Lanes)1.0f);
  const Lanes impulse1 = wanted1 * scale, impulse2 = wanted2 * scale;

  const Lanes spinning = dotWide(axis, subtractWide(a->angular, b->angular)) + loadWide(f, SOFT_HELD_TWIST, live);
  const Lanes twistLimit =
      limit * loadWide(f, SOFT_LEVER, live) + loadWide(f, SOFT_SPIN, live) * smallerWide(load, (Lanes)step);
  const Lanes wanted = oldTwist - loadWide(f, SOFT_TWIST_MASS, live) * spinning;
  const Lanes twist = smallerWide(greaterWide(wanted, -twistLimit), twistLimit);

  applySoftFrictionWide(a, b, armA, armB, axis, combineWide(t1, impulse1 - old1, t2, impulse2 - old2),
                        twist - oldTwist);
  storeWide(f, SOFT_IMPULSE1, impulse1);
  storeWide(f, SOFT_IMPULSE2, impulse2);
  storeWide(f, SOFT_TWIST_IMPULSE, twist);
  if (!relax) return;
  storeWide(f, SOFT_TOTAL1, loadWide(f, SOFT_TOTAL1, live) + impulse1);
  storeWide(f, SOFT_TOTAL2, loadWide(f, SOFT_TOTAL2, live) + impulse2);
}

WIDE void solveSoftRollWide(__global float* r, WideBody* a, WideBody* b, Lanes load, float step, LaneMask live) {
  const Lanes coefficient = loadWide(r, SOFT_ROLL_COEFFICIENT, live);
  if (!anyLane(coefficient > 0.0f)) return;
  const Lanes3 axis = loadWide3(r, SOFT_ROLL_AXIS, live);
  const Lanes old = loadWide(r, SOFT_ROLL_IMPULSE, live), limit = coefficient * smallerWide(load, (Lanes)step);
  const Lanes speed = dotWide(axis, subtractWide(a->angular, b->angular)) + loadWide(r, SOFT_ROLL_HELD, live);
  const Lanes wanted =
      smallerWide(greaterWide(old - loadWide(r, SOFT_ROLL_MASS, live) * speed, -limit), limit);
  const Lanes3 none = {(Lanes)0.0f, (Lanes)0.0f, (Lanes)0.0f}, turn = timesWide(axis, wanted - old);
  pushWide(a, none, turn, (Lanes)1.0f);
  pushWide(b, none, turn, (Lanes)-1.0f);
  storeWide(r, SOFT_ROLL_IMPULSE, wanted);
}

WIDE __global float* wideSoft(__global float* rows, int k) { return rows + k * SOFT_POINT_FIELDS * BTGPU_LANES; }

WIDE void warmStartSoftWide(const WideSlots* w, __global float* rows, WideBody* a, WideBody* b) {
  for (int k = 0; k < w->maxPoints; ++k) {
    __global float* p = wideSoft(rows, k);
    const LaneMask live = w->pointCount > k;
    const WideNormal n = loadSoftNormal(p, live);
    applySoftNormalWide(a, b, &n, loadWide(p, SOFT_IMPULSE, live));
  }
  __global float* f = rows + SOFT_FRICTION * BTGPU_LANES;
  const LaneMask live = w->pointCount > 0;
  const Lanes3 push = combineWide(loadWide3(f, SOFT_TANGENT1, live), loadWide(f, SOFT_IMPULSE1, live),
                                  loadWide3(f, SOFT_TANGENT2, live), loadWide(f, SOFT_IMPULSE2, live));
  applySoftFrictionWide(a, b, loadWide3(f, SOFT_ARM_A, live), loadWide3(f, SOFT_ARM_B, live),
                        loadWide3(f, SOFT_AXIS, live), push, (Lanes)0.0f);
}

WIDE void loadMotion(const WideSlots* w, __global const SolverBody* bodies, WideMotion* m) {
  m->linearA = take3(gatherWide(&bodies->pushLinear, 4, w->safeA), w->movedA);
  m->angularA = take3(gatherWide(&bodies->turnAngular, 4, w->safeA), w->movedA);
  m->linearB = take3(gatherWide(&bodies->pushLinear, 4, w->safeB), w->movedB);
  m->angularB = take3(gatherWide(&bodies->turnAngular, 4, w->safeB), w->movedB);
}

WIDE void solveSoftPassWide(const WideSlots* w, StepParams s, uint pass, uint substep,
                            __global const SolverBody* bodies, __global float* rows, __global float* rolls, WideBody* a,
                            WideBody* b) {
  WideMotion m;
  loadMotion(w, bodies, &m);
  const SoftPass free = makeSoftPass(s, pass, substep, 0), fixed = makeSoftPass(s, pass, substep, 1);
  const LaneMask toFixed = ~(w->movedA & w->movedB);
  const Lanes rate = pick(toFixed, (Lanes)fixed.contact.rate, (Lanes)free.contact.rate);
  const Lanes share = pick(toFixed, (Lanes)fixed.contact.share, (Lanes)free.contact.share);
  Lanes load = 0.0f;
  for (int k = 0; k < w->maxPoints; ++k) {
    load += solveSoftNormalWide(wideSoft(rows, k), a, b, &m, free, rate, share, w->pointCount > k);
  }
  const LaneMask live = w->pointCount > 0;
  const float step = 1.0f / (float)s.substeps;
  solveSoftFrictionWide(rows + SOFT_FRICTION * BTGPU_LANES, a, b, load, step, free.relax, live);
  for (int r = 0; rolls && r < SOFT_ROLL_ROWS; ++r) {
    solveSoftRollWide(rolls + r * SOFT_ROLL_FIELDS * BTGPU_LANES, a, b, load, step, live);
  }
}

// `slots`, `rows`, `rolls` are those of the block's first slot; rolls may be null.
WIDE void solveSoftWide(StepParams s, uint pass, uint substep, __global const SlotHeader* slots,
                        __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                        __global float* rolls) {
  WideSlots w;
  loadSlots(slots, &w);
  if (w.maxPoints == 0) return;
  WideBody a = loadWideBody(masses, w.safeA, w.movedA), b = loadWideBody(masses, w.safeB, w.movedB);
  a.linear = take3(gatherWide(&bodies->deltaLinear, 4, w.safeA), w.movedA);
  a.angular = take3(gatherWide(&bodies->deltaAngular, 4, w.safeA), w.movedA);
  b.linear = take3(gatherWide(&bodies->deltaLinear, 4, w.safeB), w.movedB);
  b.angular = take3(gatherWide(&bodies->deltaAngular, 4, w.safeB), w.movedB);
  if (pass == SUB_WARM_START) {
    warmStartSoftWide(&w, rows, &a, &b);
  } else if (pass == SUB_BOUNCE) {
    for (int k = 0; k < w.maxPoints; ++k) bounceSoftNormalWide(wideSoft(rows, k), &a, &b, w.pointCount > k);
  } else {
    solveSoftPassWide(&w, s, pass, substep, bodies, rows, rolls, &a, &b);
  }
  scatterWide(&bodies->deltaLinear, 4, w.bodyA, a.linear, (Lanes)0.0f);
  scatterWide(&bodies->deltaAngular, 4, w.bodyA, a.angular, (Lanes)0.0f);
  scatterWide(&bodies->deltaLinear, 4, w.bodyB, b.linear, (Lanes)0.0f);
  scatterWide(&bodies->deltaAngular, 4, w.bodyB, b.angular, (Lanes)0.0f);
}

#endif
