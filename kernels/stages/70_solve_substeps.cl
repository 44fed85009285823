// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Fast mode (docs/fast_mode.md): the step in substeps, each with one pass over the soft rows of all contacts, a motion
// of the bodies, and one over the hard rows; friction is in both. While this goes on SolverBody holds velocity (delta...) and
// motion since the start of the step (push..., turn...); in the end what stage 80 expects there.
#include "../lib/kernel.h"
#include "../lib/soft.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/soft_wide.h"
#include "../lib/team.h"
#endif

// ---- contacts

static SlotBodies loadSlotBodies(CHECKS SlotHeader h, __global const SolverBody* bodies,
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

static SlotMotion loadSlotMotion(CHECKS SlotHeader h, __global const SolverBody* bodies) {
  SlotMotion m;
  m.linearA = m.angularA = m.linearB = m.angularB = vec3(0.0f, 0.0f, 0.0f);
  if (h.bodyA != NO_INDEX) {
    m.linearA = AT(bodies, h.bodyA).pushLinear;
    m.angularA = AT(bodies, h.bodyA).turnAngular;
  }
  if (h.bodyB != NO_INDEX) {
    m.linearB = AT(bodies, h.bodyB).pushLinear;
    m.angularB = AT(bodies, h.bodyB).turnAngular;
  }
  return m;
}

static void storeSlotBodies(CHECKS SlotHeader h, const SlotBodies* s, __global SolverBody* bodies) {
  if (h.bodyA != NO_INDEX) {
    AT(bodies, h.bodyA).deltaLinear = s->linearA;
    AT(bodies, h.bodyA).deltaAngular = s->angularA;
  }
  if (h.bodyB != NO_INDEX) {
    AT(bodies, h.bodyB).deltaLinear = s->linearB;
    AT(bodies, h.bodyB).deltaAngular = s->angularB;
  }
}

static SoftPoint fetchSoftPoint(__global const float* p) {
  SoftPoint r;
  r.normal = loadField3(p, SOFT_NORMAL);
  r.angularA = loadField3(p, SOFT_ANGULAR_A);
  r.angularB = loadField3(p, SOFT_ANGULAR_B);
  r.mass = loadField(p, SOFT_MASS);
  r.separation = loadField(p, SOFT_SEPARATION);
  r.held = loadField(p, SOFT_HELD);
  r.springShare = loadField(p, SOFT_SPRING_SHARE);
  r.springRate = loadField(p, SOFT_SPRING_RATE);
  r.impulse = loadField(p, SOFT_IMPULSE);
  r.total = loadField(p, SOFT_TOTAL);
  return r;
}

static SoftFriction fetchSoftFriction(__global const float* f) {
  SoftFriction r;
  r.armA = loadField3(f, SOFT_ARM_A);
  r.armB = loadField3(f, SOFT_ARM_B);
  r.tangent1 = loadField3(f, SOFT_TANGENT1);
  r.tangent2 = loadField3(f, SOFT_TANGENT2);
  r.axis = loadField3(f, SOFT_AXIS);
  r.mass11 = loadField(f, SOFT_MASS11);
  r.mass12 = loadField(f, SOFT_MASS12);
  r.mass22 = loadField(f, SOFT_MASS22);
  r.twistMass = loadField(f, SOFT_TWIST_MASS);
  r.coefficient = loadField(f, SOFT_COEFFICIENT);
  r.lever = loadField(f, SOFT_LEVER);
  r.spin = loadField(f, SOFT_SPIN);
  r.held1 = loadField(f, SOFT_HELD1);
  r.held2 = loadField(f, SOFT_HELD2);
  r.heldTwist = loadField(f, SOFT_HELD_TWIST);
  r.impulse1 = loadField(f, SOFT_IMPULSE1);
  r.impulse2 = loadField(f, SOFT_IMPULSE2);
  r.twist = loadField(f, SOFT_TWIST_IMPULSE);
  return r;
}

static void storeSoftFriction(__global float* row, const SoftFriction* f, int relax) {
  storeField(row, SOFT_IMPULSE1, f->impulse1);
  storeField(row, SOFT_IMPULSE2, f->impulse2);
  storeField(row, SOFT_TWIST_IMPULSE, f->twist);
  if (!relax) return;
  storeField(row, SOFT_TOTAL1, loadField(row, SOFT_TOTAL1) + f->impulse1);
  storeField(row, SOFT_TOTAL2, loadField(row, SOFT_TOTAL2) + f->impulse2);
}

static void solveRolls(__global float* rolls, float load, float step, SlotBodies* s) {
  for (uint r = 0; r < SOFT_ROLL_ROWS; ++r) {
    __global float* row = rolls + r * SOFT_ROLL_FIELDS * BTGPU_LANES;
    const float coefficient = loadField(row, SOFT_ROLL_COEFFICIENT);
    if (!(coefficient > 0.0f)) continue;
    const float impulse = solveSoftRoll(s, loadField3(row, SOFT_ROLL_AXIS), loadField(row, SOFT_ROLL_MASS),
                                        loadField(row, SOFT_ROLL_HELD), coefficient * fmin(load, step),
                                        loadField(row, SOFT_ROLL_IMPULSE));
    storeField(row, SOFT_ROLL_IMPULSE, impulse);
  }
}

// Loops have a fixed length so that `points` can be kept in registers; all are fetched before the first is solved.
static void solveSoftSlot(CHECKS uint slot, StepParams params, uint pass, uint substep, __global const SlotHeader* slots,
                          __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                          __global float* rolls) {
  const SlotHeader h = AT(slots, slot);
  if (h.manifold == NO_INDEX) return;
  ASSERT(h.pointCount <= MANIFOLD_POINTS, h.pointCount, slot);
  __global float* row = rows + slotBase(slot, SLOT_SOFT_FIELDS);
  __global float* frictionRow = row + SOFT_FRICTION * BTGPU_LANES;
  SoftPoint points[MANIFOLD_POINTS];
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < h.pointCount) points[k] = fetchSoftPoint(row + k * SOFT_POINT_FIELDS * BTGPU_LANES);
  }
  SlotBodies s = loadSlotBodies(WITH_CHECKS h, bodies, masses);
  if (pass == SUB_WARM_START) {
#pragma unroll
    for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
      if (k < h.pointCount) applySoftNormal(&s, points[k], points[k].impulse);
    }
    const SoftFriction f = fetchSoftFriction(frictionRow);
    applySoftFriction(&s, f, f.tangent1 * f.impulse1 + f.tangent2 * f.impulse2, 0.0f);
  } else if (pass == SUB_BOUNCE) {
#pragma unroll
    for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
      if (k >= h.pointCount) continue;
      const float bounce = loadField(row + k * SOFT_POINT_FIELDS * BTGPU_LANES, SOFT_BOUNCE);
      if (bounce > 0.0f && points[k].total > 0.0f) bounceSoftNormal(&s, bounce, &points[k]);
    }
  } else {
    const SlotMotion m = loadSlotMotion(WITH_CHECKS h, bodies);
    const SoftPass p = makeSoftPass(params, pass, substep, h.bodyA == NO_INDEX || h.bodyB == NO_INDEX);
    float load = 0.0f;
#pragma unroll
    for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
      if (k >= h.pointCount) continue;
      solveSoftNormal(&s, m, p, &points[k]);
      if (p.relax) points[k].total += points[k].impulse;
      load += points[k].impulse;
    }
    const float step = 1.0f / (float)params.substeps;
    SoftFriction f = fetchSoftFriction(frictionRow);
    solveSoftFriction(&s, load, step, &f);
    storeSoftFriction(frictionRow, &f, p.relax);
    if (params.flags & STEP_TORSION) solveRolls(rolls + slotBase(slot, SLOT_ROLL_FIELDS), load, step, &s);
  }
  storeSlotBodies(WITH_CHECKS h, &s, bodies);
#pragma unroll
  for (uint k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k >= h.pointCount || pass == SUB_WARM_START) continue;
    __global float* p = row + k * SOFT_POINT_FIELDS * BTGPU_LANES;
    storeField(p, SOFT_IMPULSE, points[k].impulse);
    if (pass != SUB_SOLVE) storeField(p, SOFT_TOTAL, points[k].total);
  }
}

// ---- bodies

// A body's part in a pass over the bodies. What impulses do in a substep is what the next one starts with: the
// Jacobians stay, so this is the warm start of all rows. starts[].linear.w: 1 where any impulse has moved the body.
static void passBody(uint i, StepParams params, uint pass, __global const BodyStep* steps, __global SolverBody* bodies,
                     __global BodyVelocity* starts) {
  const float4 linear = bodies[i].deltaLinear, angular = bodies[i].deltaAngular;
  const float4 gainedLinear = xyz(linear - starts[i].linear), gainedAngular = xyz(angular - starts[i].angular);
  // Impulses that cancel each other leave a few roundings. Those of a substep's first pass count even if the second one
  // takes them back: the body has moved in between.
  const int pushed = starts[i].linear.w != 0.0f || lengthSqr3(gainedLinear) > SUB_ROUNDING * lengthSqr3(linear) ||
                     lengthSqr3(gainedAngular) > SUB_ROUNDING * lengthSqr3(angular);
  if (pass == SUB_MOVE) {
    const float h = substepOf(params);
    starts[i].linear.w = pushed ? 1.0f : 0.0f;
    bodies[i].pushLinear += linear * h;
    bodies[i].turnAngular += angular * h;
    return;
  }
  if (pass == SUB_BEGIN) {
    const float part = 1.0f / (float)params.substeps;
    const float4 startLinear = xyz(linear + steps[i].externalLinear * part);
    const float4 startAngular = angular + steps[i].externalAngular * part;
    starts[i].linear = withW(startLinear, pushed ? 1.0f : 0.0f);
    starts[i].angular = startAngular;
    bodies[i].deltaLinear = startLinear + gainedLinear;
    bodies[i].deltaAngular = startAngular + gainedAngular;
    return;
  }
  // A body that nothing touched moves as Bullet's: by its velocity at the end.
  const float4 freeLinear = xyz(steps[i].linearVelocity + steps[i].externalLinear);
  const float4 freeAngular = xyz(steps[i].angularVelocity + steps[i].externalAngular);
  const float4 none = vec3(0.0f, 0.0f, 0.0f);
  bodies[i].pushLinear = pushed ? bodies[i].pushLinear / params.timeStep : freeLinear;
  bodies[i].turnAngular = pushed ? bodies[i].turnAngular / params.timeStep : freeAngular;
  bodies[i].deltaLinear = pushed ? linear - freeLinear : none;
  bodies[i].deltaAngular = pushed ? angular - freeAngular : none;
}

#ifdef BTGPU_SHAPE_CPU

static int isBodyPass(uint pass) { return pass == SUB_MOVE || pass == SUB_BEGIN || pass == SUB_FINISH; }

static void solveSoftSlots(CHECKS uint slot, StepParams params, uint pass, uint substep, __global const SlotHeader* slots,
                           __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                           __global float* rolls) {
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
      solveSoftSlot(WITH_CHECKS i, params, pass, substep, slots, masses, bodies, rows, rolls);
    }
    return;
  }
#endif
  solveSoftWide(params, pass, substep, slots + slot, masses, bodies, rows + slotBase(slot, SLOT_SOFT_FIELDS),
                params.flags & STEP_TORSION ? rolls + slotBase(slot, SLOT_ROLL_FIELDS) : 0);
}

#define PART_BLOCKS 4u    // blocks of BTGPU_WIDE slots that are worth a part of their own
#define PART_BODIES 256u  // bodies that are

// This member's share of the slots first ... end - 1 of one colour; false if it has to leave the team.
static int passColour(CHECKS Member* m, uint first, uint end, StepParams params, uint pass, uint substep,
                      __global const SlotHeader* slots, __global const SolverMass* masses, __global SolverBody* bodies,
                      __global float* rows, __global float* rolls) {
  const uint blocks = (end - first) / BTGPU_WIDE;
  if (blocks == 0) return 1;
  const uint parts = clamp(blocks / PART_BLOCKS, 1u, (uint)TEAM_PARTS);
  uint mine = 0;
  beginRound(m, parts);
  for (uint part = takePart(m, parts); part != NO_INDEX; part = takePart(m, parts)) {
    const uint partEnd = first + CHUNK_BEGIN(blocks, part + 1, parts) * BTGPU_WIDE;
    for (uint slot = first + CHUNK_BEGIN(blocks, part, parts) * BTGPU_WIDE; slot < partEnd; slot += BTGPU_WIDE) {
      solveSoftSlots(WITH_CHECKS slot, params, pass, substep, slots, masses, bodies, rows, rolls);
    }
    ++mine;
  }
  return endRound(m, mine);
}

// The serial batch, slot by slot, all by one member.
static int passSerial(CHECKS Member* m, uint first, uint end, StepParams params, uint pass, uint substep,
                      __global const SlotHeader* slots, __global const SolverMass* masses, __global SolverBody* bodies,
                      __global float* rows, __global float* rolls) {
  if (first == end) return 1;
  beginRound(m, 1);
  const uint mine = takePart(m, 1) != NO_INDEX;
  for (uint slot = first; mine && slot < end; ++slot) {
    solveSoftSlot(WITH_CHECKS slot, params, pass, substep, slots, masses, bodies, rows, rolls);
  }
  return endRound(m, mine);
}

static int passBodies(Member* m, uint bodyCount, StepParams params, uint pass, __global const BodyStep* steps,
                      __global SolverBody* bodies, __global BodyVelocity* starts) {
  const uint parts = clamp(bodyCount / PART_BODIES, 1u, (uint)TEAM_PARTS);
  uint mine = 0;
  beginRound(m, parts);
  for (uint part = takePart(m, parts); part != NO_INDEX; part = takePart(m, parts)) {
    const uint end = CHUNK_BEGIN(bodyCount, part + 1, parts);
    for (uint i = CHUNK_BEGIN(bodyCount, part, parts); i < end; ++i) {
      passBody(i, params, pass, steps, bodies, starts);
    }
    ++mine;
  }
  return endRound(m, mine);
}

// `repeats` times the passes of `sequence`, the first one in its lowest SUB_BITS, each time one substep further.
KERNEL substepsInTeam(CHECKS uint bodyCount, uint firstSubstep, uint repeats, uint sequence,
                      __global const StepCounters* counters, __global const StepParams* params,
                      __global const uint* slotFirst, __global const SlotHeader* slots,
                      __global const SolverMass* masses, __global const BodyStep* steps, __global SolverBody* bodies,
                      __global BodyVelocity* starts, __global float* rows, __global float* rolls,
                      __global uint* team) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams p = *params;
  const uint colours = counters->colourCount, bouncing = counters->bouncing;
  Member m = joinTeam(team);
  ASSERT(m.rank < get_num_groups(0), m.rank, get_num_groups(0));
  ASSERT(colours <= COLOUR_LIMIT, colours, slotFirst[COLOUR_SERIAL]);
  int stays = 1;
  for (uint repeat = 0; repeat < repeats; ++repeat) {
    for (uint left = sequence; left != 0; left >>= SUB_BITS) {
      const uint pass = left & ((1u << SUB_BITS) - 1), substep = firstSubstep + repeat;
      if (isBodyPass(pass)) {
        stays = stays && passBodies(&m, bodyCount, p, pass, steps, bodies, starts);
        continue;
      }
      if (pass == SUB_BOUNCE && bouncing == 0) continue;
      for (uint colour = 0; colour < colours && stays; ++colour) {
        stays = passColour(WITH_CHECKS &m, slotFirst[colour], slotFirst[colour + 1], p, pass, substep, slots, masses,
                           bodies, rows, rolls);
      }
      stays = stays && passSerial(WITH_CHECKS &m, slotFirst[COLOUR_SERIAL], slotFirst[COLOUR_SERIAL + 1], p, pass,
                                  substep, slots, masses, bodies, rows, rolls);
    }
  }
  leaveTeam(&m);
}

#else

// One pass over the slots of one parallel colour, in small groups (as 70_solve_velocities.cl).
KERNEL_OF(SOLVE_GROUP)
substepColour(CHECKS uint colour, uint pass, uint substep, __global const StepCounters* counters,
              __global const StepParams* params, __global const uint* slotFirst, __global const SlotHeader* slots,
              __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
              __global float* rolls) {
  RETURN_ON_OVERFLOW(counters);
  if (pass == SUB_BOUNCE && counters->bouncing == 0) return;
  const uint first = slotFirst[colour];
  const StepParams p = *params;
  FOR_EACH(i, slotFirst[colour + 1] - first) {
    solveSoftSlot(WITH_CHECKS first + i, p, pass, substep, slots, masses, bodies, rows, rolls);
  }
}

// One pass over all colours from firstColour on, one after the other, and then the serial batch. One work group.
KERNEL substepRest(CHECKS uint firstColour, uint pass, uint substep, __global const StepCounters* counters,
                   __global const StepParams* params, __global const uint* slotFirst, __global const SlotHeader* slots,
                   __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                   __global float* rolls) {
  RETURN_ON_OVERFLOW(counters);
  if (pass == SUB_BOUNCE && counters->bouncing == 0) return;
  const StepParams p = *params;
  const uint colours = counters->colourCount;
  for (uint colour = firstColour; colour < colours; ++colour) {
    const uint end = slotFirst[colour + 1];
    for (uint slot = slotFirst[colour] + get_local_id(0); slot < end; slot += GROUP_SIZE) {
      solveSoftSlot(WITH_CHECKS slot, p, pass, substep, slots, masses, bodies, rows, rolls);
    }
    barrier(CLK_GLOBAL_MEM_FENCE);
  }
  if (get_local_id(0) != 0) return;
  for (uint slot = slotFirst[COLOUR_SERIAL]; slot < slotFirst[COLOUR_SERIAL + 1]; ++slot) {
    solveSoftSlot(WITH_CHECKS slot, p, pass, substep, slots, masses, bodies, rows, rolls);
  }
}

// One pass over the bodies.
KERNEL substepBodies(uint bodyCount, uint pass, __global const StepCounters* counters,
                     __global const StepParams* params, __global const BodyStep* steps, __global SolverBody* bodies,
                     __global BodyVelocity* starts) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams p = *params;
  FOR_EACH(i, bodyCount) { passBody(i, p, pass, steps, bodies, starts); }
}

#endif

// What the contacts got in the whole step, into the manifolds; of friction each point its share by load. Without warm
// starting Bullet leaves them as they were.
KERNEL storeSoftImpulses(CHECKS uint slotCapacity, __global const StepCounters* counters,
                         __global const StepParams* params, __global const SlotHeader* slots,
                         __global const float* rows, __global Manifold* manifolds) {
  RETURN_ON_OVERFLOW(counters);
  if (!(params->flags & STEP_WARM_START)) return;
  FOR_EACH(i, itemCount(slotCapacity, &counters->slotCount)) {
    const SlotHeader h = AT(slots, i);
    if (h.manifold == NO_INDEX) continue;
    __global const float* row = rows + slotBase(i, SLOT_SOFT_FIELDS);
    __global const float* f = row + SOFT_FRICTION * BTGPU_LANES;
    float load = 0.0f;
    for (uint k = 0; k < h.pointCount; ++k) load += loadField(row + k * SOFT_POINT_FIELDS * BTGPU_LANES, SOFT_TOTAL);
    const float part = load > 0.0f ? 1.0f / load : 0.0f;
    for (uint k = 0; k < h.pointCount; ++k) {
      __global const float* p = row + k * SOFT_POINT_FIELDS * BTGPU_LANES;
      if (loadField(p, SOFT_MASS) == 0.0f) continue;
      const float total = loadField(p, SOFT_TOTAL);
      __global ContactPoint* point = &AT(manifolds, h.manifold).points[k];
      point->localPointB.w = total;
      point->normalWorldOnB.w = loadField(f, SOFT_TOTAL1) * (total * part);
      point->lateralFrictionDir1.w = loadField(f, SOFT_TOTAL2) * (total * part);
    }
  }
}
