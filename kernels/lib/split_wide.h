// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stage 67's rows of BTGPU_WIDE slots at once, for one friction direction and no torsional rows. The same as splitSlot,
// slot by slot (67_split_masses.cl). OpenCL C only.
#ifndef BTGPU_LIB_SPLIT_WIDE_H
#define BTGPU_LIB_SPLIT_WIDE_H
#include "rows_wide.h"

STRUCT(WideSplitEnd) {
  WideMatrix inertia;
  Lanes3 angularFactor;
  Lanes inverseMass, excess;
};

// `moved`: lanes whose body has copies. body[]: an index in all lanes.
WIDE void makeSplitEndWide(const uint* body, LaneMask moved, __global const uint* copyFirst,
                           __global const BodyStep* steps, __global const BodyMass* masses, WideSplitEnd* e) {
  e->inverseMass = gatherWide(&steps->linearVelocity, sizeof(BodyStep) / 16, body).w;
  e->inertia.row0 = xyzWide(gatherWide(&steps->inverseInertia0, sizeof(BodyStep) / 16, body));
  e->inertia.row1 = xyzWide(gatherWide(&steps->inverseInertia1, sizeof(BodyStep) / 16, body));
  e->inertia.row2 = xyzWide(gatherWide(&steps->inverseInertia2, sizeof(BodyStep) / 16, body));
  e->angularFactor = xyzWide(gatherWide(&masses->angularFactor, sizeof(BodyMass) / 16, body));
  float excess[BTGPU_WIDE];
  for (uint l = 0; l < BTGPU_WIDE; ++l) excess[l] = (float)(copyFirst[body[l] + 1] - copyFirst[body[l]] - 1);
  e->excess = pick(moved, vload16(0, excess), (Lanes)0.0f);
}

// compliance of rows.h
WIDE Lanes splitComplianceWide(const WideSplitEnd* e, Lanes3 n, Lanes3 r) {
  Lanes3 angular = mulMatrixWide(e->inertia, crossWide(r, n));
  angular.x *= e->angularFactor.x;
  angular.y *= e->angularFactor.y;
  angular.z *= e->angularFactor.z;
  return e->inverseMass + dotWide(n, crossWide(angular, r));
}
WIDE Lanes excessAlongWide(const WideSplitEnd* a, const WideSplitEnd* b, Lanes3 n, Lanes3 ra, Lanes3 rb) {
  return a->excess * splitComplianceWide(a, n, ra) + b->excess * splitComplianceWide(b, n, rb);
}
WIDE Lanes shareOfWide(Lanes jac, float scale, Lanes excess) { return 1.0f / (1.0f + excess * jac / scale); }
WIDE void scaleWide(__global float* slot, int field, Lanes factor, LaneMask live) {
  storeLive(slot, field, loadWide(slot, field, live) * factor, live);
}

// `slots` and `rows` are those of the block's first slot.
WIDE void splitWide(float sor, __global const SlotHeader* slots, __global const uint* copyFirst,
                    __global const Manifold* manifolds, __global const BodyStep* steps,
                    __global const BodyMass* masses, __global float* rows) {
  const Lanes4 header = gatherHere((__global const float4*)slots);
  const int16 pointCount = as_int16(header.w);
  const int most = maxLane(pointCount);
  if (most == 0) return;
  uint manifold[BTGPU_WIDE], bodyA[BTGPU_WIDE], bodyB[BTGPU_WIDE];
  const uint16 found = as_uint16(header.z);
  vstore16(found != NO_INDEX ? found : (uint16)found.s0, 0, manifold);  // lanes are filled from the first one on
  const Lanes4 head = gatherWide((__global const float4*)manifolds, sizeof(Manifold) / 16, manifold);
  vstore16(as_uint16(head.x), 0, bodyA);
  vstore16(as_uint16(head.y), 0, bodyB);
  WideSplitEnd a, b;
  makeSplitEndWide(bodyA, as_uint16(header.x) != NO_INDEX, copyFirst, steps, masses, &a);
  makeSplitEndWide(bodyB, as_uint16(header.y) != NO_INDEX, copyFirst, steps, masses, &b);
  for (int k = 0; k < most; ++k) {
    __global float* p = rows + k * POINT_FIELDS * BTGPU_LANES;
    const LaneMask present = pointCount > k;
    const Lanes jac = loadWide(p, ROW_NORMAL_JAC, present);
    const LaneMask live = present & (jac != 0.0f);
    const Lanes3 ra = loadWide3(p, ROW_R_A, live), rb = loadWide3(p, ROW_R_B, live);
    const Lanes share = shareOfWide(jac, sor, excessAlongWide(&a, &b, loadWide3(p, ROW_NORMAL, live), ra, rb));
    scaleWide(p, ROW_NORMAL_JAC, share, live);
    scaleWide(p, ROW_NORMAL_RHS, share, live);
    scaleWide(p, ROW_NORMAL_CFM, share, live);
    scaleWide(p, ROW_PUSH_RHS, share, live);
    const Lanes excess1 = excessAlongWide(&a, &b, loadWide3(p, ROW_TANGENT1, live), ra, rb);
    const Lanes share1 = shareOfWide(loadWide(p, ROW_TANGENT1_JAC, live), sor, excess1);
    scaleWide(p, ROW_TANGENT1_JAC, share1, live);
    scaleWide(p, ROW_TANGENT1_RHS, share1, live);
  }
}

#endif
