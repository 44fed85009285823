// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The fast mode's rows of BTGPU_WIDE slots at once, for the usual settings: friction along the slip, nothing cached, no
// rolling or anisotropic friction. The same as prepareSoftSlot, slot by slot (65_prepare_soft_contacts.cl), operation
// by operation. OpenCL C only.
#ifndef BTGPU_LIB_PREPARE_SOFT_WIDE_H
#define BTGPU_LIB_PREPARE_SOFT_WIDE_H
#include "prepare_wide.h"
#include "soft_wide.h"

// SoftEnd of 65_prepare_soft_contacts.cl
STRUCT(WideSoftEnd) {
  Lanes3 linear, angular, linearWithForces, angularWithForces;
  WideMatrix rotation;
  WideBody mass;  // of it the response only
  LaneMask pushed, held;
};

WIDE void makeSoftEndWide(const uint* body, const uint* safe, LaneMask moved, __global const BodyPose* poses,
                          __global const BodyStep* steps, __global const BodyMass* masses,
                          __global const SolverMass* solverMasses, WideSoftEnd* e) {
  const Lanes4 linear = gatherWide(&steps->linearVelocity, sizeof(BodyStep) / 16, body);
  e->linear = xyzWide(linear);
  e->angular = xyzWide(gatherWide(&steps->angularVelocity, sizeof(BodyStep) / 16, body));
  e->linearWithForces = addWide(e->linear, xyzWide(gatherWide(&steps->externalLinear, sizeof(BodyStep) / 16, body)));
  e->angularWithForces = addWide(e->angular, xyzWide(gatherWide(&steps->externalAngular, sizeof(BodyStep) / 16, body)));
  const Lanes3 factor = timesWide(xyzWide(gatherWide(&masses->linearFactor, sizeof(BodyMass) / 16, body)), linear.w);
  e->pushed = dotWide(factor, factor) >= BTGPU_EPSILON * BTGPU_EPSILON;
  e->rotation = matrixFromQuaternionWide(gatherWide(&poses->orientation, sizeof(BodyPose) / 16, body));
  e->mass = loadWideBody(solverMasses, safe, moved);
  e->held = ~moved;
}

WIDE Lanes3 noneWide(void) {
  const Lanes3 v = {(Lanes)0.0f, (Lanes)0.0f, (Lanes)0.0f};
  return v;
}
WIDE Lanes3 scale3Wide(Lanes3 a, Lanes3 b) {
  a.x *= b.x;
  a.y *= b.y;
  a.z *= b.z;
  return a;
}

WIDE Lanes3 velocityHereWide(const WideSoftEnd* e, Lanes3 r) { return addWide(e->linear, crossWide(e->angular, r)); }
WIDE Lanes3 velocityWithForcesHereWide(const WideSoftEnd* e, Lanes3 r) {
  return addWide(e->linearWithForces, crossWide(e->angularWithForces, r));
}
WIDE Lanes3 heldVelocityWide(const WideSoftEnd* e, Lanes3 r) {
  return pick3(e->held, velocityHereWide(e, r), noneWide());
}
WIDE Lanes3 massAngularWide(const WideBody* m, Lanes3 torque) {
  Lanes3 v;
  v.x = dotWide(m->mass0, torque);
  v.y = dotWide(m->mass1, torque);
  v.z = dotWide(m->mass2, torque);
  return v;
}
// linear2, angular2: those of another row, for what one does to the other.
WIDE Lanes yieldBetweenWide(const WideBody* m, Lanes3 linear, Lanes3 angular, Lanes3 linear2, Lanes3 angular2) {
  return dotWide(linear, scale3Wide(m->massLinear, linear2)) + dotWide(angular, massAngularWide(m, angular2));
}
WIDE Lanes yieldWide(const WideBody* m, Lanes3 linear, Lanes3 angular) {
  return yieldBetweenWide(m, linear, angular, linear, angular);
}
WIDE Lanes inverseOfWide(Lanes sum) {
  const Lanes mass = 1.0f / sum;
  return pick((sum > 0.0f) & isFiniteWide(mass), mass, (Lanes)0.0f);
}

// What the solved points have in common: Touch, and the arms of each.
STRUCT(WideTouch) {
  Lanes3 armA, armB, normal, impulse;
  Lanes friction, count;
  Lanes3 arms[MANIFOLD_POINTS];
  LaneMask solved[MANIFOLD_POINTS];
};

WIDE void addWhere(LaneMask mask, Lanes3* sum, Lanes3 v) { *sum = pick3(mask, addWide(*sum, v), *sum); }

WIDE void prepareSoftPointWide(StepParams s, const WideSoftEnd* a, const WideSoftEnd* b, Lanes threshold, LaneMask live,
                               int k, __global const ContactPoint* first, const uint* manifold, __global float* row,
                               __global StepCounters* counters, WideTouch* t) {
  WidePoint p;
  loadPointWide(first, manifold, &p);
  const Lanes3 n = xyzWide(p.normal), ra = mulMatrixWide(a->rotation, xyzWide(p.localA)),
               rb = mulMatrixWide(b->rotation, xyzWide(p.localB));
  const LaneMask wanted = live & (p.localA.w <= threshold) & (a->pushed | b->pushed);
  const Lanes3 angularA = crossWide(ra, n), angularB = crossWide(rb, n);
  const Lanes before = dotWide(n, subtractWide(velocityHereWide(a, ra), velocityHereWide(b, rb)));
  const Lanes zero = 0.0f, yields = yieldWide(&a->mass, n, angularA) + yieldWide(&b->mass, n, angularB);
  const LaneMask sound = wanted & isFiniteWide(before) & isFiniteWide(p.localA.w);
  const Lanes mass = pick(sound, inverseOfWide(yields), zero);
  const LaneMask solved = sound & (mass != 0.0f);
  Lanes bounce = zero;
  const LaneMask bounces =
      solved & (fabs(before) >= s.restitutionVelocityThreshold) & (p.combined.y * before < 0.0f);
  if (anyLane(bounces)) {
    const Lanes after = dotWide(n, subtractWide(velocityWithForcesHereWide(a, ra), velocityWithForcesHereWide(b, rb)));
    const Lanes fall =
        2.0f * greaterWide(before - after, zero) / s.timeStep * greaterWide(p.localA.w + s.linearSlop, zero);
    bounce = pick(bounces, p.combined.y * sqrt(after * after + fall), zero);
  }
  Lanes springShare = zero, springRate = zero;
  if (anyLane(live & p.soft)) {
    const float h = substepOf(s);
    const Lanes spring = h * p.stiffness, sum = greaterWide(spring + p.damping, (Lanes)BTGPU_EPSILON);
    springRate = pick(p.soft, pick(spring <= 3.402823466e38f, spring / sum / h, (Lanes)(1.0f / h)), zero);
    springShare = pick(p.soft, 1.0f / (1.0f + mass / (sum * h)), zero);
  }
  const LaneMask warm = s.flags & STEP_WARM_START ? solved : (LaneMask)0;
  storeWide3(row, SOFT_NORMAL, n, live);
  storeWide3(row, SOFT_ANGULAR_A, angularA, live);
  storeWide3(row, SOFT_ANGULAR_B, angularB, live);
  storeLive(row, SOFT_MASS, mass, live);
  storeLive(row, SOFT_SEPARATION, p.localA.w + s.linearSlop, live);
  storeLive(row, SOFT_HELD, dotWide(n, subtractWide(heldVelocityWide(a, ra), heldVelocityWide(b, rb))), live);
  storeLive(row, SOFT_SPRING_SHARE, springShare, live);
  storeLive(row, SOFT_SPRING_RATE, springRate, live);
  const float share = s.warmStartingFactor / (float)s.substeps;
  storeLive(row, SOFT_IMPULSE, pick(warm, p.localB.w * share, zero), live);
  storeLive(row, SOFT_TOTAL, zero, live);
  storeLive(row, SOFT_BOUNCE, bounce, live);
  for (int l = 0; anyLane(bounce > 0.0f) && l < BTGPU_WIDE; ++l) {
    if (((float*)&bounce)[l] > 0.0f) atomic_inc(&counters->bouncing);
  }

  t->arms[k] = ra;
  t->solved[k] = solved;
  t->count += pick(solved, (Lanes)1.0f, zero);
  addWhere(solved, &t->armA, ra);
  addWhere(solved, &t->armB, rb);
  addWhere(solved, &t->normal, n);
  const Lanes3 lateral2 = xyzWide(gatherWide(&first->lateralFrictionDir2, MANIFOLD_STRIDE, manifold));
  addWhere(solved, &t->impulse,
           addWide(timesWide(xyzWide(p.lateral), p.normal.w), timesWide(lateral2, p.lateral.w)));
  t->friction += pick(solved, p.combined.x, zero);
}

// chooseSoftTangents; zero where nothing is solved.
WIDE void chooseSoftTangentsWide(const WideSoftEnd* a, const WideSoftEnd* b, const WideTouch* t, LaneMask some,
                                 Lanes3* t1, Lanes3* t2) {
  const Lanes3 n = t->normal;
  const Lanes3 slip =
      subtractWide(velocityWithForcesHereWide(a, t->armA), velocityWithForcesHereWide(b, t->armB));
  const Lanes3 lateral = subtractWide(slip, timesWide(n, dotWide(n, slip)));
  const Lanes speedSqr = dotWide(lateral, lateral), speed = sqrt(speedSqr);
  const LaneMask slides = speedSqr > BTGPU_EPSILON;
  Lanes3 along = lateral;
  along.x = lateral.x / speed;
  along.y = lateral.y / speed;
  along.z = lateral.z / speed;
  Lanes3 across = crossWide(along, n);
  const Lanes size = sqrt(dotWide(across, across));
  across.x = across.x / size;
  across.y = across.y / size;
  across.z = across.z / size;
  Lanes3 plane1, plane2;
  planeSpaceWide(n, &plane1, &plane2);
  *t1 = pick3(some, pick3(slides, along, plane1), noneWide());
  *t2 = pick3(some, pick3(slides, across, plane2), noneWide());
}

WIDE Lanes impulseAlongWide(Lanes3 impulse, Lanes3 direction) {
  return dotWide(impulse, direction) * inverseOfWide(dotWide(direction, direction));
}

WIDE void prepareSoftFrictionWide(StepParams s, const WideSoftEnd* a, const WideSoftEnd* b, const WideTouch* t,
                                  Lanes lever, Lanes3 t1, Lanes3 t2, LaneMask live, __global float* row) {
  const Lanes3 a1 = crossWide(t->armA, t1), a2 = crossWide(t->armA, t2);
  const Lanes3 b1 = crossWide(t->armB, t1), b2 = crossWide(t->armB, t2);
  const Lanes k11 = yieldWide(&a->mass, t1, a1) + yieldWide(&b->mass, t1, b1);
  const Lanes k22 = yieldWide(&a->mass, t2, a2) + yieldWide(&b->mass, t2, b2);
  const Lanes k12 = dotWide(t1, scale3Wide(a->mass.massLinear, t2)) + dotWide(a1, massAngularWide(&a->mass, a2)) +
                    dotWide(t1, scale3Wide(b->mass.massLinear, t2)) + dotWide(b1, massAngularWide(&b->mass, b2));
  const Lanes det = k11 * k22 - k12 * k12, zero = 0.0f;
  const LaneMask both = det > 1e-4f * k11 * k22;
  const Lanes3 held = subtractWide(heldVelocityWide(a, t->armA), heldVelocityWide(b, t->armB));
  const Lanes3 turning = subtractWide(pick3(a->held, a->angular, noneWide()), pick3(b->held, b->angular, noneWide()));
  const Lanes3 impulse = timesWide(t->impulse, (Lanes)(s.warmStartingFactor / (float)s.substeps));
  LaneMask warm = isFiniteWide(impulse.x) & isFiniteWide(impulse.y) & isFiniteWide(impulse.z);
  if (!(s.flags & STEP_WARM_START)) warm = 0;
  storeWide3(row, SOFT_ARM_A, t->armA, live);
  storeWide3(row, SOFT_ARM_B, t->armB, live);
  storeWide3(row, SOFT_TANGENT1, t1, live);
  storeWide3(row, SOFT_TANGENT2, t2, live);
  storeWide3(row, SOFT_AXIS, t->normal, live);
  storeLive(row, SOFT_MASS11, pick(both, k22 / det, inverseOfWide(k11)), live);
  storeLive(row, SOFT_MASS12, pick(both, -k12 / det, zero), live);
  storeLive(row, SOFT_MASS22, pick(both, k11 / det, inverseOfWide(k22)), live);
  storeLive(row, SOFT_TWIST_MASS,
            inverseOfWide(dotWide(t->normal, massAngularWide(&a->mass, t->normal)) +
                          dotWide(t->normal, massAngularWide(&b->mass, t->normal))),
            live);
  storeLive(row, SOFT_COEFFICIENT, t->friction, live);
  storeLive(row, SOFT_LEVER, lever, live);
  storeLive(row, SOFT_SPIN, zero, live);
  storeLive(row, SOFT_HELD1, dotWide(t1, held), live);
  storeLive(row, SOFT_HELD2, dotWide(t2, held), live);
  storeLive(row, SOFT_HELD_TWIST, dotWide(t->normal, turning), live);
  storeLive(row, SOFT_IMPULSE1, pick(warm, impulseAlongWide(impulse, t1), zero), live);
  storeLive(row, SOFT_IMPULSE2, pick(warm, impulseAlongWide(impulse, t2), zero), live);
  storeLive(row, SOFT_TWIST_IMPULSE, zero, live);
  storeLive(row, SOFT_TOTAL1, zero, live);
  storeLive(row, SOFT_TOTAL2, zero, live);
}

// Means from the sums, and the mean distance from where friction acts.
WIDE Lanes finishTouchWide(WideTouch* t, int most, LaneMask some) {
  const Lanes zero = 0.0f, part = pick(some, 1.0f / t->count, zero);
  t->armA = timesWide(t->armA, part);
  t->armB = timesWide(t->armB, part);
  t->friction *= part;
  const Lanes size = sqrt(dotWide(t->normal, t->normal));
  Lanes3 n;
  n.x = t->normal.x / size;
  n.y = t->normal.y / size;
  n.z = t->normal.z / size;
  t->normal = pick3(size > 0.0f, n, noneWide());
  Lanes lever = zero;
  for (int k = 0; k < most; ++k) {
    const Lanes3 away = subtractWide(t->arms[k], t->armA);
    const Lanes3 flat = subtractWide(away, timesWide(t->normal, dotWide(t->normal, away)));
    lever = pick(t->solved[k], lever + part * sqrt(dotWide(flat, flat)), lever);
  }
  return lever;
}

WIDE void noteTangentsWide(const WideTouch* t, int most, Lanes3 t1, Lanes3 t2, __global Manifold* manifolds,
                           const uint* manifold) {
  for (int k = 0; k < most; ++k) {
    __global ContactPoint* first = &manifolds->points[k];
    uint index[BTGPU_WIDE];
    vstore16(t->solved[k] ? vload16(0, manifold) : (uint16)NO_INDEX, 0, index);
    scatterWide(&first->lateralFrictionDir1, MANIFOLD_STRIDE, index, t1,
                gatherWide(&first->lateralFrictionDir1, MANIFOLD_STRIDE, manifold).w);
    scatterWide(&first->lateralFrictionDir2, MANIFOLD_STRIDE, index, t2,
                gatherWide(&first->lateralFrictionDir2, MANIFOLD_STRIDE, manifold).w);
  }
}

WIDE int canPrepareSoftWide(uint stepFlags) {
  return !(stepFlags & (STEP_FRICTION_CACHING | STEP_NO_VELOCITY_FRICTION | STEP_TORSION));
}

// False, with nothing done, if a body is anisotropic. `slots` and `rows` are those of the block's first slot.
WIDE int prepareSoftWide(StepParams s, __global StepCounters* counters, __global const SlotHeader* slots,
                         __global const BodyInfo* infos, __global const BodyPose* poses, __global const BodyStep* steps,
                         __global const BodyMass* masses, __global const SolverMass* solverMasses,
                         __global Manifold* manifolds, __global float* rows) {
  const Lanes4 header = gatherHere((__global const float4*)slots);
  const int16 pointCount = as_int16(header.w);
  const int most = maxLane(pointCount);
  if (most == 0) return 1;
  WideSlots w;
  loadSlots(slots, &w);
  uint manifold[BTGPU_WIDE], bodyA[BTGPU_WIDE], bodyB[BTGPU_WIDE];
  const uint16 found = as_uint16(header.z);
  vstore16(found != NO_INDEX ? found : (uint16)found.s0, 0, manifold);  // lanes are filled from the first one on
  const Lanes4 head = gatherWide((__global const float4*)manifolds, MANIFOLD_STRIDE, manifold);
  vstore16(as_uint16(head.x), 0, bodyA);
  vstore16(as_uint16(head.y), 0, bodyB);
  if (isAnisotropicWide(infos, bodyA) || isAnisotropicWide(infos, bodyB)) return 0;
  const Lanes threshold = gatherWide((__global const float4*)manifolds + 1, MANIFOLD_STRIDE, manifold).y;
  WideSoftEnd a, b;
  makeSoftEndWide(bodyA, w.safeA, w.movedA, poses, steps, masses, solverMasses, &a);
  makeSoftEndWide(bodyB, w.safeB, w.movedB, poses, steps, masses, solverMasses, &b);
  WideTouch t;
  t.armA = t.armB = t.normal = t.impulse = noneWide();
  t.friction = t.count = (Lanes)0.0f;
  for (int k = 0; k < most; ++k) {
    prepareSoftPointWide(s, &a, &b, threshold, pointCount > k, k, &manifolds->points[k], manifold,
                         wideSoft(rows, k), counters, &t);
  }
  const LaneMask some = t.count > 0.0f, live = pointCount > 0;
  const Lanes lever = finishTouchWide(&t, most, some);
  Lanes3 t1, t2;
  chooseSoftTangentsWide(&a, &b, &t, some, &t1, &t2);
  prepareSoftFrictionWide(s, &a, &b, &t, lever, t1, t2, live, rows + SOFT_FRICTION * BTGPU_LANES);
  noteTangentsWide(&t, most, t1, t2, manifolds, manifold);
  return 1;
}

#endif
