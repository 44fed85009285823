// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"
#include "../lib/rows.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/prepare_wide.h"
#endif

// Makes the solver's bodies ready: no velocity change yet, and the response to impulses.
KERNEL prepareBodies(uint bodyCount, __global const StepCounters* counters, __global const BodyStep* steps,
                     __global const BodyMass* masses, __global SolverBody* solverBodies,
                     __global SolverMass* solverMasses) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    SolverBody body;
    body.deltaLinear = body.deltaAngular = body.pushLinear = body.turnAngular = vec3(0.0f, 0.0f, 0.0f);
    solverBodies[i] = body;
    solverMasses[i] = makeSolverMass(steps[i], masses[i]);
  }
}

// Everything about one end of a manifold.
STRUCT(End) {
  RowBody body;
  float4 position;
  Matrix3 rotation;
  BodyMaterial material;
  uint flags;
  int pushed;  // canBePushed
};

static End makeEnd(CHECKS uint i, __global const BodyInfo* infos, __global const BodyPose* poses,
                   __global const BodyStep* steps, __global const BodyMass* masses,
                   __global const BodyMaterial* materials) {
  End end;
  end.body = makeRowBody(AT(steps, i), AT(masses, i).angularFactor);
  end.position = AT(poses, i).position;
  end.rotation = matrixFromQuaternion(AT(poses, i).orientation);
  end.material = AT(materials, i);
  end.flags = AT(infos, i).flags;
  end.pushed = canBePushed(end.body.inverseMass, AT(masses, i).linearFactor);
  return end;
}

static float4 scaleByFriction(uint wanted, End a, End b, float4 direction) {
  direction = anisotropic(a.flags, wanted, a.material, a.rotation, direction);
  return anisotropic(b.flags, wanted, b.material, b.rotation, direction);
}

// Chooses the two friction directions of a point; Bullet's convertContact.
static void chooseTangents(StepParams s, End a, End b, float4 ra, float4 rb, ContactPoint* p) {
  if ((s.flags & STEP_FRICTION_CACHING) && (p->flags & POINT_LATERAL_FRICTION_INITIALIZED)) return;
  const float4 n = xyz(p->normalWorldOnB);
  const float4 slip = velocityWithForcesAt(a.body, ra) - velocityWithForcesAt(b.body, rb);
  const float4 lateral = xyz(slip - n * dot3(n, slip));
  const float speedSqr = lengthSqr3(lateral);
  float4 t1, t2;
  if (!(s.flags & STEP_NO_VELOCITY_FRICTION) && speedSqr > BTGPU_EPSILON) {
    t1 = scaleByFriction(BODY_ANISOTROPIC, a, b, lateral / sqrt(speedSqr));
    t2 = xyz(p->lateralFrictionDir2);
    if (s.flags & STEP_TWO_FRICTION) t2 = scaleByFriction(BODY_ANISOTROPIC, a, b, normalize3(cross3(t1, n)));
  } else {
    planeSpace(n, &t1, &t2);
    t1 = scaleByFriction(BODY_ANISOTROPIC, a, b, t1);
    if (s.flags & STEP_TWO_FRICTION) t2 = scaleByFriction(BODY_ANISOTROPIC, a, b, t2);
    if ((s.flags & STEP_TWO_FRICTION) && (s.flags & STEP_NO_VELOCITY_FRICTION)) {
      p->flags |= POINT_LATERAL_FRICTION_INITIALIZED;
    }
  }
  p->lateralFrictionDir1 = withW(t1, p->lateralFrictionDir1.w);
  p->lateralFrictionDir2 = withW(t2, p->lateralFrictionDir2.w);
}

// One torsional row: inert if there is nothing to brake or the axis was scaled away.
static void storeTorsion(__global float* slot, int field, End a, End b, float4 axis, float friction, int wanted) {
  const float jac = wanted ? torsionJac(a.body, b.body, axis) : 0.0f;
  const int live = wanted && isfinite(jac);
  storeField3(slot, field + ROW_TORSION_AXIS, axis);
  storeField(slot, field + ROW_TORSION_JAC, live ? jac : 0.0f);
  storeField(slot, field + ROW_TORSION_RHS, live ? torsionRhs(a.body, b.body, axis, jac) : 0.0f);
  storeField(slot, field + ROW_TORSION_FRICTION, live ? friction : 0.0f);
  storeField(slot, field + ROW_TORSION_IMPULSE, 0.0f);
}

static void prepareTorsion(__global float* slot, int field, End a, End b, ContactPoint p) {
  const int wanted = p.combined.z > 0.0f;
  const float4 n = xyz(p.normalWorldOnB);
  float4 t1, t2;
  planeSpace(n, &t1, &t2);
  t1 = scaleByFriction(BODY_ANISOTROPIC_ROLLING, a, b, normalize3(t1));
  t2 = scaleByFriction(BODY_ANISOTROPIC_ROLLING, a, b, normalize3(t2));
  storeTorsion(slot, field, a, b, n, p.combined.w, wanted);
  storeTorsion(slot, field + TORSION_FIELDS, a, b, t1, p.combined.z, wanted && length3(t1) > 0.001f);
  storeTorsion(slot, field + 2 * TORSION_FIELDS, a, b, t2, p.combined.z, wanted && length3(t2) > 0.001f);
}

// What a point's own flags add to the right-hand side of the friction row along t; `motion`: with POINT_MOTION.
static float ownRhs(StepParams s, End a, End b, const ContactPoint* p, float4 t, float4 ra, float4 rb, float motion,
                    float jac) {
  float rhs = 0.0f;
  if (p->flags & POINT_FRICTION_ANCHOR) rhs += anchorRhs(s, t, ra - rb - xyz(b.position - a.position), jac);
  if (p->flags & POINT_MOTION) rhs += motion * jac;
  return rhs;
}

// Rows of one point. A point that is not solved has a normal row with jac = 0.
static void preparePoint(StepParams s, __global float* slot, __global float* slot2, End a, End b, int solved,
                         ContactPoint p, float4 ra, float4 rb) {
  NormalRow row = prepareNormal(s, a.body, b.body, p, ra, rb);
  if (!solved || !isfinite(row.jac) || !isfinite(row.rhs)) row.jac = row.rhs = row.cfm = row.pushRhs = 0.0f;
  const int live = row.jac != 0.0f;
  storeField3(slot, ROW_NORMAL, p.normalWorldOnB);
  storeField3(slot, ROW_R_A, ra);
  storeField3(slot, ROW_R_B, rb);
  storeField(slot, ROW_NORMAL_JAC, row.jac);
  storeField(slot, ROW_NORMAL_RHS, row.rhs);
  storeField(slot, ROW_NORMAL_CFM, row.cfm);
  storeField(slot, ROW_NORMAL_IMPULSE,
             live && (s.flags & STEP_WARM_START) ? p.localPointB.w * s.warmStartingFactor : 0.0f);
  storeField(slot, ROW_PUSH_RHS, row.pushRhs);
  storeField(slot, ROW_PUSH_IMPULSE, 0.0f);
  storeField(slot, ROW_FRICTION, p.combined.x);

  const float4 t1 = xyz(p.lateralFrictionDir1), t2 = xyz(p.lateralFrictionDir2);
  const float jac1 = frictionJac(s, a.body, b.body, t1, ra, rb);
  storeField3(slot, ROW_TANGENT1, t1);
  storeField(slot, ROW_TANGENT1_JAC, jac1);
  const int own = p.flags & (POINT_FRICTION_ANCHOR | POINT_MOTION);
  float rhs1 = frictionRhs(a.body, b.body, t1, ra, rb, jac1);
  if (own) rhs1 += ownRhs(s, a, b, &p, t1, ra, rb, p.normalWorldOnB.w, jac1);
  storeField(slot, ROW_TANGENT1_RHS, rhs1);
  storeField(slot, ROW_TANGENT1_IMPULSE, 0.0f);
  if (!(s.flags & STEP_TWO_FRICTION)) return;
  const float jac2 = frictionJac(s, a.body, b.body, t2, ra, rb);
  storeField3(slot2, ROW_TANGENT2, t2);
  storeField(slot2, ROW_TANGENT2_JAC, jac2);
  float rhs2 = frictionRhs(a.body, b.body, t2, ra, rb, jac2);
  if (own) rhs2 += ownRhs(s, a, b, &p, t2, ra, rb, p.lateralFrictionDir1.w, jac2);
  storeField(slot2, ROW_TANGENT2_RHS, rhs2);
  storeField(slot2, ROW_TANGENT2_IMPULSE, 0.0f);
}

static void prepareSlot(CHECKS uint i, StepParams s, __global const SlotHeader* slots, __global const BodyInfo* infos,
                        __global const BodyPose* poses, __global const BodyStep* steps, __global const BodyMass* masses,
                        __global const BodyMaterial* materials, __global Manifold* manifolds, __global float* rows,
                        __global float* tangent2, __global float* torsion) {
  const SlotHeader header = AT(slots, i);
  if (header.manifold == NO_INDEX) return;
  __global Manifold* manifold = &AT(manifolds, header.manifold);
  ASSERT(header.pointCount <= MANIFOLD_POINTS, header.pointCount, header.manifold);
  const uint bodyA = manifold->bodyA, bodyB = manifold->bodyB;
  const End a = makeEnd(WITH_CHECKS bodyA, infos, poses, steps, masses, materials);
  const End b = makeEnd(WITH_CHECKS bodyB, infos, poses, steps, masses, materials);
  for (uint k = 0; k < header.pointCount; ++k) {
    ContactPoint p = manifold->points[k];
    const float4 ra = mulMatrix(a.rotation, p.localPointA), rb = mulMatrix(b.rotation, p.localPointB);
    const int solved = p.localPointA.w <= manifold->processingThreshold && (a.pushed || b.pushed);
    if (solved) chooseTangents(s, a, b, ra, rb, &p);
    manifold->points[k] = p;
    __global float* slot2 = tangent2;
    if (s.flags & STEP_TWO_FRICTION) {
      slot2 += slotBase(i, SLOT_TANGENT2_FIELDS) + k * TANGENT2_FIELDS * BTGPU_LANES;
    }
    preparePoint(s, rows + slotBase(i, SLOT_FIELDS) + k * POINT_FIELDS * BTGPU_LANES, slot2, a, b, solved, p, ra, rb);
    if (s.flags & STEP_TORSION) {
      prepareTorsion(torsion + slotBase(i, SLOT_TORSION_FIELDS), k * TORSION_ROWS * TORSION_FIELDS, a, b, p);
    }
  }
}

#if defined(BTGPU_DEBUG) && defined(BTGPU_SHAPE_CPU)
// Whether the vector code, which checks nothing, may have a block. Who says no goes slot by slot, where it is recorded.
static int blockIsSound(CHECKS __global const SlotHeader* slots, uint first, __global const Manifold* manifolds,
                        __global const BodyInfo* infos) {
  for (uint i = first; i < first + BTGPU_WIDE; ++i) {
    const uint m = AT(slots, i).manifold;
    if (m == NO_INDEX) continue;
    if (m >= LENGTH(manifolds) || slots[i].pointCount > MANIFOLD_POINTS) return 0;
    if (manifolds[m].bodyA >= LENGTH(infos) || manifolds[m].bodyB >= LENGTH(infos)) return 0;
  }
  return 1;
}
#define BLOCK_IS_SOUND(slots, first, manifolds, infos) blockIsSound(WITH_CHECKS slots, first, manifolds, infos)
#else
#define BLOCK_IS_SOUND(slots, first, manifolds, infos) 1
#endif

// Builds the rows of every slot from its manifold, and notes the friction directions in the manifold.
KERNEL prepareContacts(CHECKS uint slotCapacity, __global const StepCounters* counters,
                       __global const StepParams* params, __global const SlotHeader* slots,
                       __global const BodyInfo* infos, __global const BodyPose* poses, __global const BodyStep* steps,
                       __global const BodyMass* masses, __global const BodyMaterial* materials,
                       __global Manifold* manifolds, __global float* rows, __global float* tangent2,
                       __global float* torsion) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams s = *params;
  const uint count = itemCount(slotCapacity, &counters->slotCount);
#ifdef BTGPU_SHAPE_CPU
  // Colours fill whole blocks of BTGPU_LANES.
  const int wide = canPrepareWide(s.flags);
  FOR_EACH(block, count / BTGPU_WIDE) {
    const uint first = block * BTGPU_WIDE;
    if (block + 1 < block_end) prefetchManifolds(slots + first + BTGPU_WIDE, manifolds);
    if (wide && BLOCK_IS_SOUND(slots, first, manifolds, infos) &&
        prepareWide(s, slots + first, infos, poses, steps, masses, manifolds, rows + slotBase(first, SLOT_FIELDS))) {
      continue;
    }
    for (uint i = first; i < first + BTGPU_WIDE; ++i) {
      prepareSlot(WITH_CHECKS i, s, slots, infos, poses, steps, masses, materials, manifolds, rows, tangent2, torsion);
    }
  }
#else
  FOR_EACH(i, count) {
    prepareSlot(WITH_CHECKS i, s, slots, infos, poses, steps, masses, materials, manifolds, rows, tangent2, torsion);
  }
#endif
}

#ifdef BTGPU_SHAPE_CPU
// Both in one launch: neither needs what the other writes.
KERNEL prepareBodiesAndContacts(CHECKS uint bodyCount, uint slotCapacity, __global const StepCounters* counters,
                                __global const StepParams* params, __global const SlotHeader* slots,
                                __global const BodyInfo* infos, __global const BodyPose* poses,
                                __global const BodyStep* steps, __global const BodyMass* masses,
                                __global const BodyMaterial* materials, __global Manifold* manifolds,
                                __global float* rows, __global float* tangent2, __global float* torsion,
                                __global SolverBody* solverBodies, __global SolverMass* solverMasses) {
  prepareBodies(bodyCount, counters, steps, masses, solverBodies, solverMasses);
  prepareContacts(WITH_CHECKS slotCapacity, counters, params, slots, infos, poses, steps, masses, materials, manifolds,
                  rows, tangent2, torsion);
}
#endif
