// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Projected Gauss-Seidel over the coloured constraint slots: slots of one colour move different bodies and are
// solved in parallel, colours one after the other. Which rows a launch solves is given by `passes`; of a slot's rows
// the normal ones go first (docs/decisions/0014-friction-after-each-manifold.md).
#include "../lib/kernel.h"
#include "../lib/rows.h"
#include "../shared/joint.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/solve_wide.h"
#include "../lib/team.h"
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
  float pushRhs, pushImpulse;
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
    r->pushImpulse = loadField(p, ROW_PUSH_IMPULSE);
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
    const float impulse =
        solveRow(&s, p.normal, p.ra, p.rb, p.jac, p.pushRhs, p.cfm, p.pushImpulse, 0.0f, INFINITY);
    storeField(pointRows(rows, k), ROW_PUSH_IMPULSE, impulse);
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

// Loops have a fixed length so that `points` can be kept in registers.
static void solveSlot(CHECKS uint slot, uint passes, uint flags, __global const SlotHeader* slots,
                      __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                      __global float* tangent2, __global float* torsion) {
  const SlotHeader h = AT(slots, slot);
  if (h.manifold == NO_INDEX) return;
  ASSERT(h.pointCount <= MANIFOLD_POINTS, h.pointCount, slot);
  SlotRows r;
  r.points = rows + slotBase(slot, SLOT_FIELDS);
  r.tangent2 = flags & STEP_TWO_FRICTION ? tangent2 + slotBase(slot, SLOT_TANGENT2_FIELDS) : 0;
  r.torsion = flags & STEP_TORSION ? torsion + slotBase(slot, SLOT_TORSION_FIELDS) : 0;
  const int twoDirections = r.tangent2 != 0;
  const int pointwise = (passes & PASS_FRICTION) && (flags & STEP_INTERLEAVE);
  PointRows points[MANIFOLD_POINTS];
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < h.pointCount) fetchPoint(r, k, passes, &points[k]);
  }
  SlotBodies s = loadBodies(WITH_CHECKS h, bodies, masses);
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k >= h.pointCount) continue;
    PointRows* p = &points[k];
    if (passes & PASS_WARM_START) applyRowImpulse(&s, p->normal, p->ra, p->rb, p->impulse);
    if (passes & PASS_NORMAL) {
      p->impulse = solveRow(&s, p->normal, p->ra, p->rb, p->jac, p->rhs, p->cfm, p->impulse, 0.0f, INFINITY);
    }
    if (pointwise) solveFriction(twoDirections, p, &s);
    if (passes & PASS_TORSION) solveTorsionRows(r, k, p->impulse, &s);
  }
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < h.pointCount && (passes & PASS_FRICTION) && !pointwise) solveFriction(twoDirections, &points[k], &s);
  }
  storeBodies(WITH_CHECKS h, &s, bodies);
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < h.pointCount) storeImpulsesOf(r, k, passes, &points[k]);
  }
  if ((passes & PASS_NORMAL) && (flags & STEP_SPLIT_IMPULSE)) solvePush(WITH_CHECKS h, r, bodies, points, s);
}

#ifdef BTGPU_SHAPE_CPU

// What a work item takes at once: BTGPU_WIDE slots in vectors, but for torsional rows.
static uint slotsAtOnce(uint passes) { return passes & PASS_TORSION ? 1 : BTGPU_WIDE; }

static void solveSlots(CHECKS uint slot, uint passes, uint flags, __global const SlotHeader* slots,
                       __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                       __global float* tangent2, __global float* torsion) {
  if (passes & PASS_TORSION) {
    solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
    return;
  }
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
  solveWide(passes, flags, slots + slot, masses, bodies, rows + slotBase(slot, SLOT_FIELDS),
            flags & STEP_TWO_FRICTION ? tangent2 + slotBase(slot, SLOT_TANGENT2_FIELDS) : 0);
}

#define PART_BLOCKS 4u  // blocks of BTGPU_WIDE slots that are worth a part of their own

// This member's share of the slots first ... end - 1 of one colour; false if it has to leave the team.
static int solveColour(CHECKS Member* m, uint first, uint end, uint passes, uint flags,
                       __global const SlotHeader* slots, __global const SolverMass* masses, __global SolverBody* bodies,
                       __global float* rows, __global float* tangent2, __global float* torsion) {
  const uint blocks = (end - first) / BTGPU_WIDE, step = slotsAtOnce(passes);
  if (blocks == 0) return 1;
  const uint parts = clamp(blocks / PART_BLOCKS, 1u, (uint)TEAM_PARTS);
  uint mine = 0;
  beginRound(m, parts);
  for (uint part = takePart(m, parts); part != NO_INDEX; part = takePart(m, parts)) {
    const uint partEnd = first + CHUNK_BEGIN(blocks, part + 1, parts) * BTGPU_WIDE;
    for (uint slot = first + CHUNK_BEGIN(blocks, part, parts) * BTGPU_WIDE; slot < partEnd; slot += step) {
      solveSlots(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
    }
    ++mine;
  }
  return endRound(m, mine);
}

// The serial batch, slot by slot, all by one member.
static int solveSerial(CHECKS Member* m, uint first, uint end, uint passes, uint flags,
                       __global const SlotHeader* slots, __global const SolverMass* masses, __global SolverBody* bodies,
                       __global float* rows, __global float* tangent2, __global float* torsion) {
  if (first == end) return 1;
  beginRound(m, 1);
  const uint mine = takePart(m, 1) != NO_INDEX;
  for (uint slot = first; mine && slot < end; ++slot) {
    solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
  }
  return endRound(m, mine);
}

// `repeats` times the passes of `sequence`, the first one in its lowest PASS_BITS, each over all colours one after the
// other and then the serial batch.
KERNEL solveInTeam(CHECKS uint repeats, uint sequence, __global const StepCounters* counters,
                   __global const StepParams* params, __global const uint* slotFirst, __global const SlotHeader* slots,
                   __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                   __global float* tangent2, __global float* torsion, __global uint* team) {
  RETURN_ON_OVERFLOW(counters);
  const uint flags = params->flags, colours = counters->colourCount;
  Member m = joinTeam(team);
  ASSERT(m.rank < get_num_groups(0), m.rank, get_num_groups(0));
  ASSERT(colours <= COLOUR_LIMIT, colours, slotFirst[COLOUR_SERIAL]);
  int stays = 1;
  for (uint repeat = 0; repeat < repeats; ++repeat) {
    for (uint left = sequence; left != 0; left >>= PASS_BITS) {
      const uint passes = left & ((1u << PASS_BITS) - 1);
      for (uint colour = 0; colour < colours && stays; ++colour) {
        stays = solveColour(WITH_CHECKS &m, slotFirst[colour], slotFirst[colour + 1], passes, flags, slots, masses,
                            bodies, rows, tangent2, torsion);
      }
      stays = stays && solveSerial(WITH_CHECKS &m, slotFirst[COLOUR_SERIAL], slotFirst[COLOUR_SERIAL + 1], passes,
                                   flags, slots, masses, bodies, rows, tangent2, torsion);
    }
  }
  leaveTeam(&m);
}

#else

// Solves the slots of one parallel colour. In small groups, since those of a small world are to spread over the device.
KERNEL_OF(SOLVE_GROUP)
solveColour(CHECKS uint colour, uint passes, __global const StepCounters* counters, __global const StepParams* params,
            __global const uint* slotFirst, __global const SlotHeader* slots, __global const SolverMass* masses,
            __global SolverBody* bodies, __global float* rows, __global float* tangent2, __global float* torsion) {
  RETURN_ON_OVERFLOW(counters);
  const uint first = slotFirst[colour], flags = params->flags;
  FOR_EACH(i, slotFirst[colour + 1] - first) {
    solveSlot(WITH_CHECKS first + i, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
  }
}

// Solves all colours from firstColour on, however many there are, one after the other, and then the serial batch, slot
// by slot. One work group.
KERNEL solveRest(CHECKS uint firstColour, uint passes, __global const StepCounters* counters,
                 __global const StepParams* params, __global const uint* slotFirst, __global const SlotHeader* slots,
                 __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                 __global float* tangent2, __global float* torsion) {
  RETURN_ON_OVERFLOW(counters);
  const uint flags = params->flags, colours = counters->colourCount;
  for (uint colour = firstColour; colour < colours; ++colour) {
    const uint first = slotFirst[colour], end = slotFirst[colour + 1];
    for (uint slot = first + get_local_id(0); slot < end; slot += GROUP_SIZE) {
      solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
    }
    barrier(CLK_GLOBAL_MEM_FENCE);
  }
  if (get_local_id(0) != 0) return;
  for (uint slot = slotFirst[COLOUR_SERIAL]; slot < slotFirst[COLOUR_SERIAL + 1]; ++slot) {
    solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
  }
}

#endif

// ---- joints

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

// Solves the joints order[first ...] of one colour.
KERNEL solveJointColour(CHECKS uint iteration, uint first, uint count, __global const StepCounters* counters,
                        __global const uint* order, __global const Joint* joints, __global const JointRow* rows,
                        __global const JointEffect* effects, __global const uint* jointSolved,
                        __global const SolverMass* masses, __global SolverBody* bodies, __global float* impulses) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, count) {
    solveJoint(WITH_CHECKS AT(order, first + i), iteration, joints, rows, effects, jointSolved, masses, bodies,
               impulses);
  }
}

// Solves joints that share bodies, one after the other. Single work item.
SINGLE_KERNEL solveJointsSerial(CHECKS uint iteration, uint first, uint count, __global const StepCounters* counters,
                                __global const uint* order, __global const Joint* joints, __global const JointRow* rows,
                                __global const JointEffect* effects, __global const uint* jointSolved,
                                __global const SolverMass* masses, __global SolverBody* bodies,
                                __global float* impulses) {
  RETURN_ON_OVERFLOW(counters);
  for (uint i = first; i < first + count; ++i) {
    solveJoint(WITH_CHECKS AT(order, i), iteration, joints, rows, effects, jointSolved, masses, bodies, impulses);
  }
}

// Accumulated impulses back into the manifolds. Without warm starting Bullet leaves them as they were.
KERNEL storeImpulses(CHECKS uint slotCapacity, __global const StepCounters* counters, __global const StepParams* params,
                     __global const SlotHeader* slots, __global const float* rows, __global const float* tangent2,
                     __global Manifold* manifolds) {
  RETURN_ON_OVERFLOW(counters);
  if (!(params->flags & STEP_WARM_START)) return;
  FOR_EACH(i, itemCount(slotCapacity, &counters->slotCount)) {
    const SlotHeader h = AT(slots, i);
    if (h.manifold == NO_INDEX) continue;
    for (uint k = 0; k < h.pointCount; ++k) {
      __global const float* p = rows + slotBase(i, SLOT_FIELDS) + k * POINT_FIELDS * BTGPU_LANES;
      ASSERT_FLOATS(isfinite(loadField(p, ROW_NORMAL_JAC)) && isfinite(loadField(p, ROW_NORMAL_RHS)),
                    loadField(p, ROW_NORMAL_JAC), loadField(p, ROW_NORMAL_RHS));
      if (loadField(p, ROW_NORMAL_JAC) == 0.0f) continue;
      __global ContactPoint* point = &AT(manifolds, h.manifold).points[k];
      point->localPointB.w = loadField(p, ROW_NORMAL_IMPULSE);
      point->normalWorldOnB.w = loadField(p, ROW_TANGENT1_IMPULSE);
      if (params->flags & STEP_TWO_FRICTION) {
        point->lateralFrictionDir1.w = loadField(
            tangent2 + slotBase(i, SLOT_TANGENT2_FIELDS) + k * TANGENT2_FIELDS * BTGPU_LANES, ROW_TANGENT2_IMPULSE);
      }
    }
  }
}
