// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stage 65's rows of BTGPU_WIDE slots at once, for the usual settings: one friction direction, along the slip, nothing
// cached, no torsional rows, no anisotropic friction, no point with something of its own. The same as prepareSlot, slot
// by slot (65_prepare_contacts.cl).
// OpenCL C only.
#ifndef BTGPU_LIB_PREPARE_WIDE_H
#define BTGPU_LIB_PREPARE_WIDE_H
#include "../shared/step.h"
#include "rows_wide.h"

#define MANIFOLD_STRIDE ((uint)(sizeof(Manifold) / sizeof(float4)))

// End of 65_prepare_contacts.cl
STRUCT(WideEnd) {
  Lanes3 linear, angular, externalLinear, externalAngular, angularFactor;
  WideMatrix inertia, rotation;
  Lanes inverseMass;
  LaneMask pushed;
};

WIDE void makeEndWide(const uint* body, __global const BodyPose* poses, __global const BodyStep* steps,
                      __global const BodyMass* masses, WideEnd* e) {
  const Lanes4 linear = gatherWide(&steps->linearVelocity, sizeof(BodyStep) / 16, body);
  e->linear = xyzWide(linear);
  e->inverseMass = linear.w;
  e->angular = xyzWide(gatherWide(&steps->angularVelocity, sizeof(BodyStep) / 16, body));
  e->externalLinear = xyzWide(gatherWide(&steps->externalLinear, sizeof(BodyStep) / 16, body));
  e->externalAngular = xyzWide(gatherWide(&steps->externalAngular, sizeof(BodyStep) / 16, body));
  e->inertia.row0 = xyzWide(gatherWide(&steps->inverseInertia0, sizeof(BodyStep) / 16, body));
  e->inertia.row1 = xyzWide(gatherWide(&steps->inverseInertia1, sizeof(BodyStep) / 16, body));
  e->inertia.row2 = xyzWide(gatherWide(&steps->inverseInertia2, sizeof(BodyStep) / 16, body));
  e->angularFactor = xyzWide(gatherWide(&masses->angularFactor, sizeof(BodyMass) / 16, body));
  const Lanes3 factor =
      timesWide(xyzWide(gatherWide(&masses->linearFactor, sizeof(BodyMass) / 16, body)), e->inverseMass);
  e->pushed = dotWide(factor, factor) >= BTGPU_EPSILON * BTGPU_EPSILON;
  e->rotation = matrixFromQuaternionWide(gatherWide(&poses->orientation, sizeof(BodyPose) / 16, body));
}

// ---- velocityAt and so on of rows.h

WIDE Lanes3 velocityAtWide(const WideEnd* e, Lanes3 r) { return addWide(e->linear, crossWide(e->angular, r)); }
WIDE Lanes3 velocityWithForcesAtWide(const WideEnd* e, Lanes3 r) {
  return addWide(addWide(e->linear, e->externalLinear), crossWide(addWide(e->angular, e->externalAngular), r));
}
WIDE Lanes complianceWide(const WideEnd* e, Lanes3 n, Lanes3 r) {
  Lanes3 angular = mulMatrixWide(e->inertia, crossWide(r, n));
  angular.x *= e->angularFactor.x;
  angular.y *= e->angularFactor.y;
  angular.z *= e->angularFactor.z;
  return e->inverseMass + dotWide(n, crossWide(angular, r));
}
WIDE Lanes approachWide(const WideEnd* a, const WideEnd* b, Lanes3 n, Lanes3 ra, Lanes3 rb) {
  return dotWide(n, addWide(a->linear, a->externalLinear)) +
         dotWide(crossWide(ra, n), addWide(a->angular, a->externalAngular)) -
         dotWide(n, addWide(b->linear, b->externalLinear)) -
         dotWide(crossWide(rb, n), addWide(b->angular, b->externalAngular));
}
WIDE Lanes slideWide(const WideEnd* a, const WideEnd* b, Lanes3 t, Lanes3 ra, Lanes3 rb) {
  return dotWide(t, addWide(a->linear, a->externalLinear)) + dotWide(crossWide(ra, t), a->angular) -
         dotWide(t, addWide(b->linear, b->externalLinear)) - dotWide(crossWide(rb, t), b->angular);
}

// planeSpace of vec.h
WIDE void planeSpaceWide(Lanes3 n, Lanes3* p, Lanes3* q) {
  const LaneMask steep = fabs(n.z) > BTGPU_HALF_SQRT2;
  Lanes3 v;
  v.x = pick(steep, (Lanes)0.0f, -n.y);
  v.y = pick(steep, -n.z, n.x);
  v.z = pick(steep, n.y, (Lanes)0.0f);
  const Lanes length = sqrt(dotWide(v, v));
  p->x = v.x / length;
  p->y = v.y / length;
  p->z = v.z / length;
  *q = crossWide(n, *p);
}

// A point of each slot's manifold.
STRUCT(WidePoint) {
  Lanes4 localA, localB, normal, lateral, combined;
  Lanes stiffness, damping;
  LaneMask soft, unusual;
};

#define UNUSUAL_POINT (POINT_CFM | POINT_ERP | POINT_FRICTION_ANCHOR | POINT_MOTION)

WIDE void loadPointWide(__global const ContactPoint* first, const uint* manifold, WidePoint* p) {
  p->localA = gatherWide(&first->localPointA, MANIFOLD_STRIDE, manifold);
  p->localB = gatherWide(&first->localPointB, MANIFOLD_STRIDE, manifold);
  p->normal = gatherWide(&first->normalWorldOnB, MANIFOLD_STRIDE, manifold);
  p->lateral = gatherWide(&first->lateralFrictionDir1, MANIFOLD_STRIDE, manifold);
  p->combined = gatherWide(&first->combined, MANIFOLD_STRIDE, manifold);
  const Lanes4 rest = gatherWide((__global const float4*)&first->combinedStiffness, MANIFOLD_STRIDE, manifold);
  p->stiffness = rest.x;
  p->damping = rest.y;
  p->soft = (as_int16(rest.w) & POINT_STIFFNESS_DAMPING) != 0;
  p->unusual = (as_int16(rest.w) & UNUSUAL_POINT) != 0;
}

// prepareNormal and the first half of preparePoint. `solved`: the lanes whose contact Bullet solves.
WIDE void prepareNormalWide(StepParams s, const WideEnd* a, const WideEnd* b, const WidePoint* p, Lanes3 ra, Lanes3 rb,
                            LaneMask solved, LaneMask live, __global float* slot) {
  const Lanes3 n = xyzWide(p->normal);
  const float inverseTimeStep = 1.0f / s.timeStep;
  const Lanes stiffness = s.timeStep * p->stiffness, sum = stiffness + p->damping;
  const Lanes denominator = pick(sum > BTGPU_EPSILON, sum, (Lanes)BTGPU_EPSILON);
  const Lanes softErp = pick(stiffness <= 3.402823466e38f, stiffness / denominator, (Lanes)1.0f);
  const Lanes erp = pick(p->soft, softErp, (Lanes)s.erp2);
  const Lanes cfm = pick(p->soft, 1.0f / denominator, (Lanes)s.globalCfm) * inverseTimeStep;

  const Lanes jac = s.sor / (complianceWide(a, n, ra) + complianceWide(b, n, rb) + cfm);
  const Lanes speed = dotWide(n, subtractWide(velocityAtWide(a, ra), velocityAtWide(b, rb)));
  const Lanes rebound = -p->combined.y * speed;
  const Lanes bounce = pick((fabs(speed) >= s.restitutionVelocityThreshold) & (rebound > 0.0f), rebound, (Lanes)0.0f);
  const Lanes distance = p->localA.w + s.linearSlop;
  const LaneMask apart = distance > 0.0f;
  const Lanes error = bounce - approachWide(a, b, n, ra, rb);
  const Lanes velocityError = pick(apart, error - distance * inverseTimeStep, error);
  const Lanes positionError = pick(apart, (Lanes)0.0f, -distance * erp * inverseTimeStep);
  const LaneMask split = s.flags & STEP_SPLIT_IMPULSE ? distance <= s.splitImpulsePenetrationThreshold : (LaneMask)0;
  const Lanes rhs = (velocityError + pick(split, (Lanes)0.0f, positionError)) * jac;

  const Lanes zero = 0.0f;
  const LaneMask row = solved & isFiniteWide(jac) & isFiniteWide(rhs);
  const LaneMask warm = s.flags & STEP_WARM_START ? row & (jac != 0.0f) : (LaneMask)0;
  storeWide3(slot, ROW_NORMAL, n, live);
  storeWide3(slot, ROW_R_A, ra, live);
  storeWide3(slot, ROW_R_B, rb, live);
  storeLive(slot, ROW_NORMAL_JAC, pick(row, jac, zero), live);
  storeLive(slot, ROW_NORMAL_RHS, pick(row, rhs, zero), live);
  storeLive(slot, ROW_NORMAL_CFM, pick(row, cfm * jac, zero), live);
  storeLive(slot, ROW_NORMAL_IMPULSE, pick(warm, p->localB.w * s.warmStartingFactor, zero), live);
  storeLive(slot, ROW_PUSH_RHS, pick(row & split, positionError * jac, zero), live);
  storeLive(slot, ROW_PUSH_IMPULSE, zero, live);
  storeLive(slot, ROW_FRICTION, p->combined.x, live);
}

// chooseTangents: the new first direction; where it is not that of the slip, the second one is noted in the manifold.
WIDE Lanes3 chooseTangentWide(const WideEnd* a, const WideEnd* b, const WidePoint* p, Lanes3 ra, Lanes3 rb,
                              LaneMask solved, __global ContactPoint* first, const uint* manifold) {
  const Lanes3 n = xyzWide(p->normal);
  const Lanes3 slip = subtractWide(velocityWithForcesAtWide(a, ra), velocityWithForcesAtWide(b, rb));
  const Lanes3 lateral = subtractWide(slip, timesWide(n, dotWide(n, slip)));
  const Lanes speedSqr = dotWide(lateral, lateral), speed = sqrt(speedSqr);
  const LaneMask slides = speedSqr > BTGPU_EPSILON, rests = solved & ~slides;
  Lanes3 t1;
  t1.x = pick(solved, lateral.x / speed, p->lateral.x);
  t1.y = pick(solved, lateral.y / speed, p->lateral.y);
  t1.z = pick(solved, lateral.z / speed, p->lateral.z);
  if (anyLane(rests)) {
    Lanes3 plane1, plane2;
    planeSpaceWide(n, &plane1, &plane2);
    t1.x = pick(rests, plane1.x, t1.x);
    t1.y = pick(rests, plane1.y, t1.y);
    t1.z = pick(rests, plane1.z, t1.z);
    uint index[BTGPU_WIDE];
    vstore16(rests ? vload16(0, manifold) : (uint16)NO_INDEX, 0, index);
    scatterWide(&first->lateralFrictionDir2, MANIFOLD_STRIDE, index, plane2,
                gatherWide(&first->lateralFrictionDir2, MANIFOLD_STRIDE, manifold).w);
  }
  return t1;
}

// False if one of the points is none of the usual ones.
WIDE int preparePointWide(StepParams s, const WideEnd* a, const WideEnd* b, Lanes threshold, LaneMask live,
                          __global ContactPoint* first, const uint* manifold, __global float* slot) {
  WidePoint p;
  loadPointWide(first, manifold, &p);
  if (anyLane(live & p.unusual)) return 0;
  const Lanes3 ra = mulMatrixWide(a->rotation, xyzWide(p.localA));
  const Lanes3 rb = mulMatrixWide(b->rotation, xyzWide(p.localB));
  const LaneMask solved = live & (p.localA.w <= threshold) & (a->pushed | b->pushed);
  prepareNormalWide(s, a, b, &p, ra, rb, solved, live, slot);
  const Lanes3 t1 = chooseTangentWide(a, b, &p, ra, rb, solved, first, manifold);
  uint index[BTGPU_WIDE];
  vstore16(solved ? vload16(0, manifold) : (uint16)NO_INDEX, 0, index);
  scatterWide(&first->lateralFrictionDir1, MANIFOLD_STRIDE, index, t1, p.lateral.w);
  const Lanes jac = s.sor / (complianceWide(a, t1, ra) + complianceWide(b, t1, rb));
  storeWide3(slot, ROW_TANGENT1, t1, live);
  storeLive(slot, ROW_TANGENT1_JAC, jac, live);
  storeLive(slot, ROW_TANGENT1_RHS, -slideWide(a, b, t1, ra, rb) * jac, live);
  storeLive(slot, ROW_TANGENT1_IMPULSE, (Lanes)0.0f, live);
  return 1;
}

WIDE int isAnisotropicWide(__global const BodyInfo* infos, const uint* body) {
  const Lanes4 info = gatherWide((__global const float4*)infos, sizeof(BodyInfo) / 16, body);
  return anyLane((as_int16(info.y) & (int)BODY_ANISOTROPIC) != 0);
}

// Whether these settings are the usual ones.
WIDE int canPrepareWide(uint stepFlags) {
  return !(stepFlags & (STEP_TWO_FRICTION | STEP_FRICTION_CACHING | STEP_NO_VELOCITY_FRICTION | STEP_TORSION));
}

// False if a body is anisotropic or a point unusual; the block's slots then have to be prepared one by one, as if
// nothing had been done. `slots` and `rows` are those of the block's first slot.
WIDE int prepareWide(StepParams s, __global const SlotHeader* slots, __global const BodyInfo* infos,
                     __global const BodyPose* poses, __global const BodyStep* steps, __global const BodyMass* masses,
                     __global Manifold* manifolds, __global float* rows) {
  const Lanes4 header = gatherHere((__global const float4*)slots);
  const int16 pointCount = as_int16(header.w);
  const int most = maxLane(pointCount);
  if (most == 0) return 1;
  uint manifold[BTGPU_WIDE], bodyA[BTGPU_WIDE], bodyB[BTGPU_WIDE];
  const uint16 found = as_uint16(header.z);
  vstore16(found != NO_INDEX ? found : (uint16)found.s0, 0, manifold);  // lanes are filled from the first one on
  const Lanes4 head = gatherWide((__global const float4*)manifolds, MANIFOLD_STRIDE, manifold);
  vstore16(as_uint16(head.x), 0, bodyA);
  vstore16(as_uint16(head.y), 0, bodyB);
  if (isAnisotropicWide(infos, bodyA) || isAnisotropicWide(infos, bodyB)) return 0;
  const Lanes threshold = gatherWide((__global const float4*)manifolds + 1, MANIFOLD_STRIDE, manifold).y;
  WideEnd a, b;
  makeEndWide(bodyA, poses, steps, masses, &a);
  makeEndWide(bodyB, poses, steps, masses, &b);
  for (int k = 0; k < most; ++k) {
    if (!preparePointWide(s, &a, &b, threshold, pointCount > k, &manifolds->points[k], manifold,
                          rows + k * POINT_FIELDS * BTGPU_LANES)) {
      return 0;
    }
  }
  return 1;
}

// The manifolds of a block lie where their pairs do, far from each other, since slots are sorted by colour.
WIDE void prefetchManifolds(__global const SlotHeader* slots, __global const Manifold* manifolds) {
  for (uint i = 0; i < BTGPU_WIDE; ++i) {
    const uint m = slots[i].manifold;
    if (m != NO_INDEX) prefetchSoon(manifolds + m, sizeof(Manifold));
  }
}

#endif
