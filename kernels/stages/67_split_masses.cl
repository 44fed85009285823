// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A copy has its share of the body's mass (Tonge 2012): with n copies each answers n times as much to an impulse. Rows
// were made for whole bodies; here each gets the effective mass between copies. What a row wants stays the same: rhs
// and cfm are in proportion to jac.
#include "../lib/kernel.h"
#include "../lib/rows.h"
#include "../shared/joint.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/split_wide.h"
#endif

// The copies of each body at rest, with n times the response.
KERNEL splitBodies(CHECKS uint bodyCount, __global const StepCounters* counters, __global const uint* copyFirst,
                   __global const SolverMass* masses, __global SolverBody* copies, __global SolverMass* copyMasses) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    const uint first = copyFirst[i], end = copyFirst[i + 1];
    const float n = (float)(end - first);
    SolverMass mass = masses[i];
    mass.row0 *= n;
    mass.row1 *= n;
    mass.row2 *= n;
    SolverBody body;
    body.deltaLinear = body.deltaAngular = body.pushLinear = body.turnAngular = vec3(0.0f, 0.0f, 0.0f);
    for (uint copy = first; copy < end; ++copy) {
      AT(copies, copy) = body;
      AT(copyMasses, copy) = mass;
    }
  }
}

// One end of a row: the body, and how many times more easily a copy of it yields than it does itself, less one.
STRUCT(SplitEnd) {
  RowBody body;
  float excess;
};

static SplitEnd makeSplitEnd(CHECKS uint i, int isMoved, __global const uint* copyFirst,
                             __global const BodyStep* steps, float4 angularFactor) {
  SplitEnd end;
  end.body = makeRowBody(AT(steps, i), angularFactor);
  end.excess = isMoved ? (float)(AT(copyFirst, i + 1) - AT(copyFirst, i) - 1) : 0.0f;
  return end;
}

// By how much a row's jac shrinks: its inverse, times `scale`, grows by what the copies yield more.
static float shareOf(float jac, float scale, float excess) { return 1.0f / (1.0f + excess * jac / scale); }

static void scaleField(__global float* slot, int field, float factor) {
  storeField(slot, field, loadField(slot, field) * factor);
}

static float excessAlong(const SplitEnd* a, const SplitEnd* b, float4 n, float4 ra, float4 rb) {
  return a->excess * compliance(a->body, n, ra) + b->excess * compliance(b->body, n, rb);
}

static void splitTorsion(__global float* t, const SplitEnd* a, const SplitEnd* b) {
  const float jac = loadField(t, ROW_TORSION_JAC);
  if (jac == 0.0f) return;
  const float4 axis = loadField3(t, ROW_TORSION_AXIS);
  const float excess = a->excess * dot3(mulMatrix(a->body.inverseInertia, axis), axis) +
                       b->excess * dot3(mulMatrix(b->body.inverseInertia, axis), axis);
  const float share = shareOf(jac, 1.0f, excess);
  scaleField(t, ROW_TORSION_JAC, share);
  scaleField(t, ROW_TORSION_RHS, share);
}

static void splitSlot(CHECKS uint i, StepParams s, __global const SlotHeader* slots, __global const uint* copyFirst,
                      __global const Manifold* manifolds, __global const BodyStep* steps,
                      __global const BodyMass* masses, __global float* rows, __global float* tangent2,
                      __global float* torsion) {
  const SlotHeader h = AT(slots, i);
  if (h.manifold == NO_INDEX) return;
  ASSERT(h.pointCount <= MANIFOLD_POINTS, h.pointCount, h.manifold);
  const uint bodyA = AT(manifolds, h.manifold).bodyA, bodyB = AT(manifolds, h.manifold).bodyB;
  const float4 factorA = AT(masses, bodyA).angularFactor, factorB = AT(masses, bodyB).angularFactor;
  const SplitEnd a = makeSplitEnd(WITH_CHECKS bodyA, h.bodyA != NO_INDEX, copyFirst, steps, factorA);
  const SplitEnd b = makeSplitEnd(WITH_CHECKS bodyB, h.bodyB != NO_INDEX, copyFirst, steps, factorB);
  for (uint k = 0; k < h.pointCount; ++k) {
    __global float* p = rows + slotBase(i, SLOT_FIELDS) + k * POINT_FIELDS * BTGPU_LANES;
    const float jac = loadField(p, ROW_NORMAL_JAC);
    if (jac == 0.0f) continue;  // not solved, nor are its other rows
    const float4 ra = loadField3(p, ROW_R_A), rb = loadField3(p, ROW_R_B);
    const float share = shareOf(jac, s.sor, excessAlong(&a, &b, loadField3(p, ROW_NORMAL), ra, rb));
    scaleField(p, ROW_NORMAL_JAC, share);
    scaleField(p, ROW_NORMAL_RHS, share);
    scaleField(p, ROW_NORMAL_CFM, share);
    scaleField(p, ROW_PUSH_RHS, share);
    const float excess1 = excessAlong(&a, &b, loadField3(p, ROW_TANGENT1), ra, rb);
    const float share1 = shareOf(loadField(p, ROW_TANGENT1_JAC), s.sor, excess1);
    scaleField(p, ROW_TANGENT1_JAC, share1);
    scaleField(p, ROW_TANGENT1_RHS, share1);
    if (s.flags & STEP_TWO_FRICTION) {
      __global float* q = tangent2 + slotBase(i, SLOT_TANGENT2_FIELDS) + k * TANGENT2_FIELDS * BTGPU_LANES;
      const float excess2 = excessAlong(&a, &b, loadField3(q, ROW_TANGENT2), ra, rb);
      const float share2 = shareOf(loadField(q, ROW_TANGENT2_JAC), s.sor, excess2);
      scaleField(q, ROW_TANGENT2_JAC, share2);
      scaleField(q, ROW_TANGENT2_RHS, share2);
    }
    for (uint r = 0; (s.flags & STEP_TORSION) && r < TORSION_ROWS; ++r) {
      const uint field = (k * TORSION_ROWS + r) * TORSION_FIELDS;
      splitTorsion(torsion + slotBase(i, SLOT_TORSION_FIELDS) + field * BTGPU_LANES, &a, &b);
    }
  }
}

KERNEL splitContacts(CHECKS uint slotCapacity, __global const StepCounters* counters,
                     __global const StepParams* params, __global const SlotHeader* slots,
                     __global const uint* copyFirst, __global const Manifold* manifolds,
                     __global const BodyStep* steps, __global const BodyMass* masses, __global float* rows,
                     __global float* tangent2, __global float* torsion) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams s = *params;
  const uint count = itemCount(slotCapacity, &counters->slotCount);
#if defined(BTGPU_SHAPE_CPU) && !defined(BTGPU_DEBUG)
  if (!(s.flags & (STEP_TWO_FRICTION | STEP_TORSION))) {
    FOR_EACH(block, count / BTGPU_WIDE) {
      const uint first = block * BTGPU_WIDE;
      splitWide(s.sor, slots + first, copyFirst, manifolds, steps, masses, rows + slotBase(first, SLOT_FIELDS));
    }
    return;
  }
#endif
  FOR_EACH(i, count) {
    splitSlot(WITH_CHECKS i, s, slots, copyFirst, manifolds, steps, masses, rows, tangent2, torsion);
  }
}

// How easily a body yields to a joint's row, as stage 52 has it.
static float mobility(RowBody b, float4 linear, float4 angular) {
  return b.inverseMass * dot3(linear, linear) + dot3(mulMatrix(b.inverseInertia, angular), angular);
}

KERNEL splitJointRows(CHECKS uint jointCount, __global const StepCounters* counters, __global const Joint* joints,
                      __global const JointRow* rows, __global const Joint* splitJoints, __global const uint* copyFirst,
                      __global const BodyStep* steps, __global JointEffect* effects, __global JointRow* splitRows) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(j, jointCount) {
    const Joint joint = AT(joints, j);
    const int moved = AT(splitJoints, j).bodyA != NO_INDEX || AT(splitJoints, j).bodyB != NO_INDEX;
    for (uint r = joint.firstRow; r < joint.firstRow + joint.rowCount; ++r) {
      JointRow row = AT(rows, r);
      const float jac = AT(effects, r).jac;
      if (jac != 0.0f && moved) {
        float excess = 0.0f;
        const float4 one = vec3(1.0f, 1.0f, 1.0f);
        if (joint.bodyA != NO_INDEX) {
          const SplitEnd a = makeSplitEnd(WITH_CHECKS joint.bodyA, 1, copyFirst, steps, one);
          excess += a.excess * mobility(a.body, row.linearA, row.angularA);
        }
        if (joint.bodyB != NO_INDEX) {
          const SplitEnd b = makeSplitEnd(WITH_CHECKS joint.bodyB, 1, copyFirst, steps, one);
          excess += b.excess * mobility(b.body, row.linearB, row.angularB);
        }
        const float share = shareOf(jac, 1.0f, excess);
        AT(effects, r).jac = jac * share;
        AT(effects, r).rhs *= share;
        row.angularA.w *= share;  // of the impulse, not of the force: in proportion to jac too
      }
      AT(splitRows, r) = row;
    }
  }
}
