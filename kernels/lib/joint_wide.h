// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The rows of JOINT_LANES joints of one colour at once; the same as solveJoint, joint by joint (solve_joint.h).
// CPU shape, OpenCL C only.
#ifndef BTGPU_LIB_JOINT_WIDE_H
#define BTGPU_LIB_JOINT_WIDE_H
#include "../shared/joint.h"
#include "rows_wide.h"

#if JOINT_LANES != BTGPU_WIDE
#error a block of joints is as wide as the vectors
#endif

WIDE Lanes loadJoint(__global const float* row, int field) {
  return *(__global const Lanes*)(row + field * JOINT_LANES);
}
WIDE Lanes3 loadJoint3(__global const float* row, int field) {
  Lanes3 v;
  v.x = loadJoint(row, field);
  v.y = loadJoint(row, field + 1);
  v.z = loadJoint(row, field + 2);
  return v;
}
WIDE void storeJoint(__global float* row, int field, Lanes value) {
  *(__global Lanes*)(row + field * JOINT_LANES) = value;
}
WIDE void storeJoint3(__global float* row, int field, Lanes4 v, LaneMask live) {
  storeJoint(row, field, pick(live, v.x, (Lanes)0.0f));
  storeJoint(row, field + 1, pick(live, v.y, (Lanes)0.0f));
  storeJoint(row, field + 2, pick(live, v.z, (Lanes)0.0f));
}

// Row r of each joint of a block into `row`. `safe`: a row that there is.
WIDE void layJointRow(uint r, const uint* firstRow, const uint* rowCount, uint safe, __global const JointRow* rows,
                      __global const JointEffect* effects, __global const float* impulses, __global float* row) {
  uint from[JOINT_LANES];
  float jac[JOINT_LANES], rhs[JOINT_LANES], impulse[JOINT_LANES];
  for (uint lane = 0; lane < JOINT_LANES; ++lane) {
    const int present = r < rowCount[lane];
    from[lane] = present ? firstRow[lane] + r : safe;
    jac[lane] = present ? effects[from[lane]].jac : 0.0f;
    rhs[lane] = effects[from[lane]].rhs;
    impulse[lane] = present ? impulses[from[lane]] : 0.0f;
  }
  const Lanes jacs = vload16(0, jac);
  const LaneMask live = jacs != 0.0f;
  const Lanes4 linearA = gatherWide(&rows->linearA, 4, from), angularA = gatherWide(&rows->angularA, 4, from),
               linearB = gatherWide(&rows->linearB, 4, from), angularB = gatherWide(&rows->angularB, 4, from);
  storeJoint3(row, JOINT_LINEAR_A, linearA, live);
  storeJoint3(row, JOINT_ANGULAR_A, angularA, live);
  storeJoint3(row, JOINT_LINEAR_B, linearB, live);
  storeJoint3(row, JOINT_ANGULAR_B, angularB, live);
  storeJoint(row, JOINT_CFM, pick(live, angularA.w, (Lanes)0.0f));
  storeJoint(row, JOINT_LOWER, pick(live, linearB.w, (Lanes)0.0f));
  storeJoint(row, JOINT_UPPER, pick(live, angularB.w, (Lanes)0.0f));
  storeJoint(row, JOINT_JAC, jacs);
  storeJoint(row, JOINT_RHS, pick(live, vload16(0, rhs), (Lanes)0.0f));
  storeJoint(row, JOINT_IMPULSE, vload16(0, impulse));
}

WIDE void yieldWide(WideBody* body, Lanes3 linear, Lanes3 angular, Lanes change) {
  body->linear.x += body->massLinear.x * linear.x * change;
  body->linear.y += body->massLinear.y * linear.y * change;
  body->linear.z += body->massLinear.z * linear.z * change;
  body->angular.x += dotWide(body->mass0, angular) * change;
  body->angular.y += dotWide(body->mass1, angular) * change;
  body->angular.z += dotWide(body->mass2, angular) * change;
}

WIDE void copyMotion(LaneMask where, const WideBody* from, WideBody* to) {
  to->linear = pick3(where, from->linear, to->linear);
  to->angular = pick3(where, from->angular, to->angular);
}

// solveJointRow; `same`: lanes whose joint has twice the same body.
WIDE void solveJointRowWide(__global float* row, LaneMask active, LaneMask same, int anySame, WideBody* a,
                            WideBody* b) {
  const Lanes jac = loadJoint(row, JOINT_JAC), impulse = loadJoint(row, JOINT_IMPULSE);
  const Lanes3 linearA = loadJoint3(row, JOINT_LINEAR_A), angularA = loadJoint3(row, JOINT_ANGULAR_A),
               linearB = loadJoint3(row, JOINT_LINEAR_B), angularB = loadJoint3(row, JOINT_ANGULAR_B);
  const Lanes lower = loadJoint(row, JOINT_LOWER), upper = loadJoint(row, JOINT_UPPER);
  const LaneMask live = active & (jac != 0.0f);
  const Lanes speed = dotWide(linearA, a->linear) + dotWide(angularA, a->angular) + dotWide(linearB, b->linear) +
                      dotWide(angularB, b->angular);
  const Lanes wanted = impulse + loadJoint(row, JOINT_RHS) - impulse * loadJoint(row, JOINT_CFM) - speed * jac;
  const Lanes clamped = pick(live, pick(wanted < lower, lower, pick(wanted > upper, upper, wanted)), impulse);
  const Lanes change = pick(live, clamped - impulse, (Lanes)0.0f);
  yieldWide(a, linearA, angularA, change);
  if (anySame) copyMotion(same, a, b);
  yieldWide(b, linearB, angularB, change);
  if (anySame) copyMotion(same, b, a);
  storeJoint(row, JOINT_IMPULSE, clamped);
}

// One iteration of a block with `rowCount` rows at most.
WIDE void solveJointsWide(uint iteration, uint rowCount, __global const uint* head, __global float* rows,
                          __global const SolverMass* masses, __global SolverBody* bodies) {
  const LaneMask active = vload16(HEAD_ITERATIONS, (__global const int*)head) > (int)iteration;
  if (!anyLane(active)) return;
  const uint16 bodyA = vload16(HEAD_BODY_A, head), bodyB = vload16(HEAD_BODY_B, head);
  const LaneMask same = active & (bodyA == bodyB), movedA = active & (bodyA != NO_INDEX),
                 movedB = active & (bodyB != NO_INDEX);
  const uint own = bodyA.s0 != NO_INDEX ? bodyA.s0 : bodyB.s0;  // no other work item writes it
  uint toA[JOINT_LANES], toB[JOINT_LANES], safeA[JOINT_LANES], safeB[JOINT_LANES];
  vstore16(movedA ? bodyA : (uint16)NO_INDEX, 0, toA);
  vstore16(movedB ? bodyB : (uint16)NO_INDEX, 0, toB);
  vstore16(movedA ? bodyA : (uint16)own, 0, safeA);
  vstore16(movedB ? bodyB : (uint16)own, 0, safeB);
  WideBody a = loadWideBody(masses, safeA, movedA), b = loadWideBody(masses, safeB, movedB);
  a.linear = take3(gatherWide(&bodies->deltaLinear, 4, safeA), movedA);
  a.angular = take3(gatherWide(&bodies->deltaAngular, 4, safeA), movedA);
  b.linear = take3(gatherWide(&bodies->deltaLinear, 4, safeB), movedB);
  b.angular = take3(gatherWide(&bodies->deltaAngular, 4, safeB), movedB);
  const int anySame = anyLane(same);
  for (uint r = 0; r < rowCount; ++r) {
    solveJointRowWide(rows + r * JOINT_ROW_FIELDS * JOINT_LANES, active, same, anySame, &a, &b);
  }
  scatterWide(&bodies->deltaLinear, 4, toA, a.linear, (Lanes)0.0f);
  scatterWide(&bodies->deltaAngular, 4, toA, a.angular, (Lanes)0.0f);
  scatterWide(&bodies->deltaLinear, 4, toB, b.linear, (Lanes)0.0f);
  scatterWide(&bodies->deltaAngular, 4, toB, b.angular, (Lanes)0.0f);
}

#endif
