// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stage 70's passes over the rows of one slot (docs/decisions/0014-friction-after-each-manifold.md), and on the CPU
// shape over BTGPU_WIDE slots at once. OpenCL C only.
#ifndef BTGPU_LIB_SOLVE_SLOT_H
#define BTGPU_LIB_SOLVE_SLOT_H
#include "kernel.h"
#include "rows.h"
#ifdef BTGPU_SHAPE_CPU
#include "solve_wide.h"
#endif

// What a GPU program is built for. What a step surely doesn't have would still take registers of every lane, a third of
// them, and with that half of the speed (docs/decisions/0028-solver-programs-for-a-step.md):
//   SOLVE_PLAIN    neither second friction directions nor torsional rows, and friction after all normal rows
//   SOLVE_PASSES   the passes of each launch
#ifdef SOLVE_PLAIN
#define HAS_TWO_FRICTION(flags) 0
#define HAS_TORSION(flags, passes) 0
#define IS_INTERLEAVED(flags) 0
#else
#define HAS_TWO_FRICTION(flags) ((flags) & STEP_TWO_FRICTION)
#define HAS_TORSION(flags, passes) ((passes) & PASS_TORSION)
#define IS_INTERLEAVED(flags) ((flags) & STEP_INTERLEAVE)
#endif
#ifdef SOLVE_PASSES
#define KNOWN_PASSES(passes) SOLVE_PASSES
#else
#define KNOWN_PASSES(passes) (passes)
#endif

STRUCT(SlotRows) {
  __global float* points;    // field 0 of the slot's rows
  __global float* tangent2;
  __global float* torsion;
};

static SlotBodies loadBodies(CHECKS SlotHeader h, __global const SolverBody* bodies,
                             __global const SolverMass* masses) {
  SlotBodies s;
  s.linearA = s.angularA = s.linearB = s.angularB = vec3(0.0f, 0.0f, 0.0f);
  s.massA.row0 = s.massA.row1 = s.massA.row2 = vec3(0.0f, 0.0f, 0.0f);
  s.massB = s.massA;
  if (h.bodyA != NO_INDEX) {
    s.linearA = AT(bodies, h.bodyA).deltaLinear;
    s.angularA = AT(bodies, h.bodyA).deltaAngular;
    s.massA = AT(masses, h.bodyA);
  }
  if (h.bodyB != NO_INDEX) {
    s.linearB = AT(bodies, h.bodyB).deltaLinear;
    s.angularB = AT(bodies, h.bodyB).deltaAngular;
    s.massB = AT(masses, h.bodyB);
  }
  return s;
}

static void storeBodies(CHECKS SlotHeader h, const SlotBodies* s, __global SolverBody* bodies) {
  if (h.bodyA != NO_INDEX) {
    AT(bodies, h.bodyA).deltaLinear = s->linearA;
    AT(bodies, h.bodyA).deltaAngular = s->angularA;
  }
  if (h.bodyB != NO_INDEX) {
    AT(bodies, h.bodyB).deltaLinear = s->linearB;
    AT(bodies, h.bodyB).deltaAngular = s->angularB;
  }
}

// The rows of a contact point, but for the torsional ones. A slot's are all fetched before the first is solved: each
// fetch takes far longer than a row, and none may overtake the store of an impulse.
STRUCT(PointRows) {
  float4 normal, ra, rb, tangent1, tangent2;
  float jac, rhs, cfm, impulse, friction;
  float pushRhs;
  float jac1, rhs1, impulse1, jac2, rhs2, impulse2;  // tangents
};

static __global float* pointRows(SlotRows rows, uint k) { return rows.points + k * POINT_FIELDS * BTGPU_LANES; }
static __global float* tangent2Rows(SlotRows rows, uint k) {
  return rows.tangent2 + k * TANGENT2_FIELDS * BTGPU_LANES;
}

static void fetchPoint(SlotRows rows, uint k, uint passes, PointRows* r) {
  __global const float* p = pointRows(rows, k);
  r->normal = loadField3(p, ROW_NORMAL);
  r->ra = loadField3(p, ROW_R_A);
  r->rb = loadField3(p, ROW_R_B);
  r->impulse = loadField(p, ROW_NORMAL_IMPULSE);
  if (passes & PASS_NORMAL) {
    r->jac = loadField(p, ROW_NORMAL_JAC);
    r->rhs = loadField(p, ROW_NORMAL_RHS);
    r->cfm = loadField(p, ROW_NORMAL_CFM);
    r->pushRhs = loadField(p, ROW_PUSH_RHS);
  }
  if (!(passes & PASS_FRICTION)) return;
  r->friction = loadField(p, ROW_FRICTION);
  r->tangent1 = loadField3(p, ROW_TANGENT1);
  r->jac1 = loadField(p, ROW_TANGENT1_JAC);
  r->rhs1 = loadField(p, ROW_TANGENT1_RHS);
  r->impulse1 = loadField(p, ROW_TANGENT1_IMPULSE);
  if (!rows.tangent2) return;
  __global const float* q = tangent2Rows(rows, k);
  r->tangent2 = loadField3(q, ROW_TANGENT2);
  r->jac2 = loadField(q, ROW_TANGENT2_JAC);
  r->rhs2 = loadField(q, ROW_TANGENT2_RHS);
  r->impulse2 = loadField(q, ROW_TANGENT2_IMPULSE);
}

static void storeImpulsesOf(SlotRows rows, uint k, uint passes, const PointRows* r) {
  __global float* p = pointRows(rows, k);
  if (passes & PASS_NORMAL) storeField(p, ROW_NORMAL_IMPULSE, r->impulse);
  if (!(passes & PASS_FRICTION)) return;
  storeField(p, ROW_TANGENT1_IMPULSE, r->impulse1);
  if (rows.tangent2) storeField(tangent2Rows(rows, k), ROW_TANGENT2_IMPULSE, r->impulse2);
}

static void solveFriction(int twoDirections, PointRows* r, SlotBodies* s) {
  if (!(r->impulse > 0.0f)) return;
  const float limit = r->friction * r->impulse;
  r->impulse1 = solveRow(s, r->tangent1, r->ra, r->rb, r->jac1, r->rhs1, 0.0f, r->impulse1, -limit, limit);
  if (!twoDirections) return;
  r->impulse2 = solveRow(s, r->tangent2, r->ra, r->rb, r->jac2, r->rhs2, 0.0f, r->impulse2, -limit, limit);
}

static void solveTorsionRows(SlotRows rows, uint k, float normalImpulse, SlotBodies* s) {
  if (!(normalImpulse > 0.0f)) return;
  for (uint r = 0; r < TORSION_ROWS; ++r) {
    __global float* t = rows.torsion + (k * TORSION_ROWS + r) * TORSION_FIELDS * BTGPU_LANES;
    const float friction = loadField(t, ROW_TORSION_FRICTION);
    if (!(friction > 0.0f)) continue;
    // Bullet's limit: in proportion to the normal impulse, but never above the coefficient itself.
    const float limit = fmin(friction * normalImpulse, friction);
    const float impulse = solveTorsion(s, loadField3(t, ROW_TORSION_AXIS), loadField(t, ROW_TORSION_JAC),
                                       loadField(t, ROW_TORSION_RHS), loadField(t, ROW_TORSION_IMPULSE), limit);
    storeField(t, ROW_TORSION_IMPULSE, impulse);
  }
}

// Split impulse: removes penetration by velocities that move the pose once and are then forgotten.
static void solvePush(CHECKS SlotHeader h, SlotRows rows, __global SolverBody* bodies, const PointRows* points,
                      SlotBodies s) {
  int pushed = 0;
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) pushed |= k < h.pointCount && points[k].pushRhs != 0.0f;
  if (!pushed) return;
  s.linearA = s.angularA = s.linearB = s.angularB = vec3(0.0f, 0.0f, 0.0f);
  if (h.bodyA != NO_INDEX) {
    s.linearA = AT(bodies, h.bodyA).pushLinear;
    s.angularA = AT(bodies, h.bodyA).turnAngular;
  }
  if (h.bodyB != NO_INDEX) {
    s.linearB = AT(bodies, h.bodyB).pushLinear;
    s.angularB = AT(bodies, h.bodyB).turnAngular;
  }
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k >= h.pointCount || points[k].pushRhs == 0.0f) continue;
    const PointRows p = points[k];
    __global float* row = pointRows(rows, k);
    const float pushImpulse = loadField(row, ROW_PUSH_IMPULSE);
    storeField(row, ROW_PUSH_IMPULSE,
               solveRow(&s, p.normal, p.ra, p.rb, p.jac, p.pushRhs, p.cfm, pushImpulse, 0.0f, INFINITY));
  }
  if (h.bodyA != NO_INDEX) {
    AT(bodies, h.bodyA).pushLinear = s.linearA;
    AT(bodies, h.bodyA).turnAngular = s.angularA;
  }
  if (h.bodyB != NO_INDEX) {
    AT(bodies, h.bodyB).pushLinear = s.linearB;
    AT(bodies, h.bodyB).turnAngular = s.angularB;
  }
}

// What a slot's passes need and nobody else changes.
STRUCT(FetchedSlot) {
  SlotHeader header;
  SlotRows rows;
  PointRows points[MANIFOLD_POINTS];
};

// `header`: of the slot, fetched before.
static void fetchRows(CHECKS uint slot, SlotHeader header, uint passes, uint flags, __global float* rows,
                      __global float* tangent2, __global float* torsion, FetchedSlot* f) {
  f->header = header;
  if (header.manifold == NO_INDEX) return;
  ASSERT(header.pointCount <= MANIFOLD_POINTS, header.pointCount, slot);
  f->rows.points = rows + slotBase(slot, SLOT_FIELDS);
  f->rows.tangent2 = HAS_TWO_FRICTION(flags) ? tangent2 + slotBase(slot, SLOT_TANGENT2_FIELDS) : 0;
  f->rows.torsion = flags & STEP_TORSION ? torsion + slotBase(slot, SLOT_TORSION_FIELDS) : 0;
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < header.pointCount) fetchPoint(f->rows, k, passes, &f->points[k]);
  }
}

// Loops have a fixed length so that `points` can be kept in registers.
static void solveFetched(CHECKS uint passes, uint flags, __global const SolverMass* masses,
                         __global SolverBody* bodies, FetchedSlot* f) {
  const SlotHeader h = f->header;
  if (h.manifold == NO_INDEX) return;
  const int twoDirections = f->rows.tangent2 != 0;
  const int pointwise = (passes & PASS_FRICTION) && IS_INTERLEAVED(flags);
  SlotBodies s = loadBodies(WITH_CHECKS h, bodies, masses);
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k >= h.pointCount) continue;
    PointRows* p = &f->points[k];
    if (passes & PASS_WARM_START) applyRowImpulse(&s, p->normal, p->ra, p->rb, p->impulse);
    if (passes & PASS_NORMAL) {
      p->impulse = solveRow(&s, p->normal, p->ra, p->rb, p->jac, p->rhs, p->cfm, p->impulse, 0.0f, INFINITY);
    }
    if (pointwise) solveFriction(twoDirections, p, &s);
    if (HAS_TORSION(flags, passes)) solveTorsionRows(f->rows, k, p->impulse, &s);
  }
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < h.pointCount && (passes & PASS_FRICTION) && !pointwise) solveFriction(twoDirections, &f->points[k], &s);
  }
  storeBodies(WITH_CHECKS h, &s, bodies);
  if ((passes & PASS_NORMAL) && (flags & STEP_SPLIT_IMPULSE)) solvePush(WITH_CHECKS h, f->rows, bodies, f->points, s);
}

// The impulses that solveFetched() arrived at; the bodies got theirs already.
static void storeFetched(uint passes, const FetchedSlot* f) {
  if (f->header.manifold == NO_INDEX) return;
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < f->header.pointCount) storeImpulsesOf(f->rows, k, passes, &f->points[k]);
  }
}

static void solveSlot(CHECKS uint slot, uint passes, uint flags, __global const SlotHeader* slots,
                      __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                      __global float* tangent2, __global float* torsion) {
  FetchedSlot f;
  fetchRows(WITH_CHECKS slot, AT(slots, slot), passes, flags, rows, tangent2, torsion, &f);
  solveFetched(WITH_CHECKS passes, flags, masses, bodies, &f);
  storeFetched(passes, &f);
}

#ifdef BTGPU_SHAPE_CPU

// BTGPU_WIDE slots. Torsional rows have a pass of their own.
static void solveSlots(CHECKS uint slot, uint passes, uint flags, __global const SlotHeader* slots,
                       __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                       __global float* tangent2, __global float* torsion) {
#ifdef BTGPU_DEBUG
  // The vector code checks nothing: what is wrong goes slot by slot, where it is recorded.
  for (uint i = slot; i < slot + BTGPU_WIDE; ++i) {
    const SlotHeader h = AT(slots, i);
    const uint count = LENGTH(bodies);
    if (h.pointCount <= MANIFOLD_POINTS && (h.bodyA == NO_INDEX || h.bodyA < count) &&
        (h.bodyB == NO_INDEX || h.bodyB < count)) {
      continue;
    }
    for (i = slot; i < slot + BTGPU_WIDE; ++i) {
      solveSlot(WITH_CHECKS i, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
    }
    return;
  }
#endif
  if (passes & PASS_TORSION) {
    if (flags & STEP_TORSION) {
      solveTorsionWide(slots + slot, masses, bodies, rows + slotBase(slot, SLOT_FIELDS),
                       torsion + slotBase(slot, SLOT_TORSION_FIELDS));
    }
    return;
  }
  solveWide(passes, flags, slots + slot, masses, bodies, rows + slotBase(slot, SLOT_FIELDS),
            flags & STEP_TWO_FRICTION ? tangent2 + slotBase(slot, SLOT_TANGENT2_FIELDS) : 0);
}

#endif

#endif
