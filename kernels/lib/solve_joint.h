// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The rows of one joint in one iteration of stage 70. OpenCL C only.
#ifndef BTGPU_LIB_SOLVE_JOINT_H
#define BTGPU_LIB_SOLVE_JOINT_H
#include "../shared/joint.h"
#include "solve_slot.h"

// Bullet's resolveSingleConstraintRowGeneric: both limits, and the Jacobian of either body as the joint gives it.
static float solveJointRow(JointRow row, JointEffect effect, float impulse, int sameBody, SlotBodies* s) {
  const float speed = dot3(row.linearA, s->linearA) + dot3(row.angularA, s->angularA) + dot3(row.linearB, s->linearB) +
                      dot3(row.angularB, s->angularB);
  const float wanted = impulse + effect.rhs - impulse * row.angularA.w - speed * effect.jac;
  const float clamped = wanted < row.linearB.w ? row.linearB.w : wanted > row.angularB.w ? row.angularB.w : wanted;
  const float change = clamped - impulse;
  s->linearA += scale3(massLinear(s->massA), row.linearA) * change;
  s->angularA += massAngular(s->massA, row.angularA) * change;
  if (sameBody) {
    s->linearB = s->linearA;
    s->angularB = s->angularA;
  }
  s->linearB += scale3(massLinear(s->massB), row.linearB) * change;
  s->angularB += massAngular(s->massB, row.angularB) * change;
  if (sameBody) {
    s->linearA = s->linearB;
    s->angularA = s->angularB;
  }
  return clamped;
}

static void solveJoint(CHECKS uint j, uint iteration, __global const Joint* joints, __global const JointRow* rows,
                       __global const JointEffect* effects, __global const uint* jointSolved,
                       __global const SolverMass* masses, __global SolverBody* bodies, __global float* impulses) {
  const Joint joint = AT(joints, j);
  if (!AT(jointSolved, j) || (int)iteration >= joint.iterations) return;
  SlotHeader h;
  h.bodyA = joint.bodyA;
  h.bodyB = joint.bodyB;
  h.manifold = h.pointCount = 0;
  SlotBodies s = loadBodies(WITH_CHECKS h, bodies, masses);
  for (uint r = joint.firstRow; r < joint.firstRow + joint.rowCount; ++r) {
    if (AT(effects, r).jac == 0.0f) continue;
    AT(impulses, r) = solveJointRow(AT(rows, r), AT(effects, r), AT(impulses, r), h.bodyA == h.bodyB, &s);
  }
  storeBodies(WITH_CHECKS h, &s, bodies);
}

#endif
