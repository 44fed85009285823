// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Fast mode (docs/fast_mode.md): bodies and rows as the substeps of stage 70 want them.
#include "../lib/kernel.h"
#include "../lib/soft.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/prepare_soft_wide.h"
#endif

// The solver's bodies with whole velocities, as the first substep begins, and no motion yet.
KERNEL prepareSoftBodies(uint bodyCount, __global const StepCounters* counters, __global const StepParams* params,
                         __global const BodyStep* steps, __global const BodyMass* masses,
                         __global SolverBody* solverBodies, __global SolverMass* solverMasses,
                         __global BodyVelocity* starts) {
  RETURN_ON_OVERFLOW(counters);
  const float part = 1.0f / (float)params->substeps;
  FOR_EACH(i, bodyCount) {
    const BodyStep step = steps[i];
    SolverBody body;
    body.deltaLinear = xyz(step.linearVelocity) + step.externalLinear * part;
    body.deltaAngular = xyz(step.angularVelocity) + step.externalAngular * part;
    body.pushLinear = body.turnAngular = vec3(0.0f, 0.0f, 0.0f);
    solverBodies[i] = body;
    solverMasses[i] = makeSolverMass(step, masses[i]);
    starts[i].linear = body.deltaLinear;
    starts[i].angular = body.deltaAngular;
  }
}

// Everything about one end of a manifold.
STRUCT(SoftEnd) {
  RowBody body;
  SolverMass mass;  // zero if the solver does not move it
  Matrix3 rotation;
  BodyMaterial material;
  uint flags;
  int pushed;  // canBePushed
  int held;    // the solver does not move it
};

static SoftEnd makeSoftEnd(CHECKS uint i, int held, __global const BodyInfo* infos, __global const BodyPose* poses,
                           __global const BodyStep* steps, __global const BodyMass* masses,
                           __global const BodyMaterial* materials, __global const SolverMass* solverMasses) {
  SoftEnd end;
  end.body = makeRowBody(AT(steps, i), AT(masses, i).angularFactor);
  end.mass = AT(solverMasses, i);
  if (held) end.mass.row0 = end.mass.row1 = end.mass.row2 = vec3(0.0f, 0.0f, 0.0f);
  end.rotation = matrixFromQuaternion(AT(poses, i).orientation);
  end.material = AT(materials, i);
  end.flags = AT(infos, i).flags;
  end.pushed = canBePushed(end.body.inverseMass, AT(masses, i).linearFactor);
  end.held = held;
  return end;
}

static float4 heldVelocity(SoftEnd e, float4 arm) {
  return e.held ? velocityAt(e.body, arm) : vec3(0.0f, 0.0f, 0.0f);
}

// n . M^-1 n for the row (linear, angular).
static float yieldOf(SolverMass m, float4 linear, float4 angular) {
  return dot3(linear, scale3(massLinear(m), linear)) + dot3(angular, massAngular(m, angular));
}

static float inverseOf(float sum) {
  const float mass = 1.0f / sum;
  return sum > 0.0f && isfinite(mass) ? mass : 0.0f;
}

static float4 scaleByFriction(uint wanted, SoftEnd a, SoftEnd b, float4 direction) {
  direction = anisotropic(a.flags, wanted, a.material, a.rotation, direction);
  return anisotropic(b.flags, wanted, b.material, b.rotation, direction);
}

// Rows of one point; false if it is not solved.
static int prepareSoftPoint(StepParams s, __global float* row, __global StepCounters* counters, SoftEnd a, SoftEnd b,
                            int solved, ContactPoint p, float4 ra, float4 rb) {
  const float4 n = xyz(p.normalWorldOnB), angularA = cross3(ra, n), angularB = cross3(rb, n);
  const float before = dot3(n, velocityAt(a.body, ra) - velocityAt(b.body, rb));
  float mass = inverseOf(yieldOf(a.mass, n, angularA) + yieldOf(b.mass, n, angularB));
  if (!solved || !isfinite(before) || !isfinite(p.localPointA.w)) mass = 0.0f;
  const float after = dot3(n, velocityWithForcesAt(a.body, ra) - velocityWithForcesAt(b.body, rb));
  const float bounce = mass != 0.0f ? reboundOf(s, p.combined.y, before, after, p.localPointA.w + s.linearSlop) : 0.0f;
  Softness spring;
  spring.share = spring.rate = 0.0f;
  if (p.flags & POINT_STIFFNESS_DAMPING) {
    spring = springSoftness(mass, p.combinedStiffness, p.combinedDamping, substepOf(s));
  }
  const int warm = mass != 0.0f && (s.flags & STEP_WARM_START);
  storeField3(row, SOFT_NORMAL, n);
  storeField3(row, SOFT_ANGULAR_A, angularA);
  storeField3(row, SOFT_ANGULAR_B, angularB);
  storeField(row, SOFT_MASS, mass);
  storeField(row, SOFT_SEPARATION, p.localPointA.w + s.linearSlop);
  storeField(row, SOFT_HELD, dot3(n, heldVelocity(a, ra) - heldVelocity(b, rb)));
  storeField(row, SOFT_SPRING_SHARE, spring.share);
  storeField(row, SOFT_SPRING_RATE, spring.rate);
  storeField(row, SOFT_IMPULSE, warm ? p.localPointB.w * (s.warmStartingFactor / (float)s.substeps) : 0.0f);
  storeField(row, SOFT_TOTAL, 0.0f);
  storeField(row, SOFT_BOUNCE, bounce);
  if (bounce > 0.0f) atomic_inc(&counters->bouncing);
  return mass != 0.0f;
}

// What the solved points of a manifold have in common, for its friction.
STRUCT(Touch) {
  float4 armA, armB, normal;
  float4 impulse;  // of friction in the step before, on A
  float friction, spin, roll, lever;
  uint first;  // of the solved points
};

static void chooseSoftTangents(StepParams s, SoftEnd a, SoftEnd b, Touch t, ContactPoint p, float4* t1, float4* t2) {
  if ((s.flags & STEP_FRICTION_CACHING) && (p.flags & POINT_LATERAL_FRICTION_INITIALIZED)) {
    *t1 = xyz(p.lateralFrictionDir1);
    *t2 = xyz(p.lateralFrictionDir2);
    return;
  }
  const float4 slip = velocityWithForcesAt(a.body, t.armA) - velocityWithForcesAt(b.body, t.armB);
  const float4 lateral = xyz(slip - t.normal * dot3(t.normal, slip));
  const float speedSqr = lengthSqr3(lateral);
  if (!(s.flags & STEP_NO_VELOCITY_FRICTION) && speedSqr > BTGPU_EPSILON) {
    *t1 = lateral / sqrt(speedSqr);
    *t2 = normalize3(cross3(*t1, t.normal));
  } else {
    planeSpace(t.normal, t1, t2);
  }
  *t1 = scaleByFriction(BODY_ANISOTROPIC, a, b, *t1);
  *t2 = scaleByFriction(BODY_ANISOTROPIC, a, b, *t2);
}

// The impulse along a direction that has been scaled.
static float impulseAlong(float4 impulse, float4 direction) {
  return dot3(impulse, direction) * inverseOf(lengthSqr3(direction));
}

static void prepareSoftFriction(StepParams s, __global float* row, SoftEnd a, SoftEnd b, Touch t, float4 t1,
                                float4 t2) {
  const float4 a1 = cross3(t.armA, t1), a2 = cross3(t.armA, t2), b1 = cross3(t.armB, t1), b2 = cross3(t.armB, t2);
  const float k11 = yieldOf(a.mass, t1, a1) + yieldOf(b.mass, t1, b1);
  const float k22 = yieldOf(a.mass, t2, a2) + yieldOf(b.mass, t2, b2);
  const float k12 = dot3(t1, scale3(massLinear(a.mass), t2)) + dot3(a1, massAngular(a.mass, a2)) +
                    dot3(t1, scale3(massLinear(b.mass), t2)) + dot3(b1, massAngular(b.mass, b2));
  // Where one of the two says nothing new (friction in one direction only), each goes by itself.
  const float det = k11 * k22 - k12 * k12;
  const int both = det > 1e-4f * k11 * k22;
  const float4 held = heldVelocity(a, t.armA) - heldVelocity(b, t.armB);
  const float4 turning = (a.held ? a.body.angular : vec3(0.0f, 0.0f, 0.0f)) -
                         (b.held ? b.body.angular : vec3(0.0f, 0.0f, 0.0f));
  const float4 impulse = t.impulse * (s.warmStartingFactor / (float)s.substeps);
  const int warm = (s.flags & STEP_WARM_START) && isFinite3(impulse);
  storeField3(row, SOFT_ARM_A, t.armA);
  storeField3(row, SOFT_ARM_B, t.armB);
  storeField3(row, SOFT_TANGENT1, t1);
  storeField3(row, SOFT_TANGENT2, t2);
  storeField3(row, SOFT_AXIS, t.normal);
  storeField(row, SOFT_MASS11, both ? k22 / det : inverseOf(k11));
  storeField(row, SOFT_MASS12, both ? -k12 / det : 0.0f);
  storeField(row, SOFT_MASS22, both ? k11 / det : inverseOf(k22));
  storeField(row, SOFT_TWIST_MASS,
             inverseOf(dot3(t.normal, massAngular(a.mass, t.normal)) + dot3(t.normal, massAngular(b.mass, t.normal))));
  storeField(row, SOFT_COEFFICIENT, t.friction);
  storeField(row, SOFT_LEVER, t.lever);
  storeField(row, SOFT_SPIN, t.spin);
  storeField(row, SOFT_HELD1, dot3(t1, held));
  storeField(row, SOFT_HELD2, dot3(t2, held));
  storeField(row, SOFT_HELD_TWIST, dot3(t.normal, turning));
  storeField(row, SOFT_IMPULSE1, warm ? impulseAlong(impulse, t1) : 0.0f);
  storeField(row, SOFT_IMPULSE2, warm ? impulseAlong(impulse, t2) : 0.0f);
  storeField(row, SOFT_TWIST_IMPULSE, 0.0f);
  storeField(row, SOFT_TOTAL1, 0.0f);
  storeField(row, SOFT_TOTAL2, 0.0f);
}

static void prepareRoll(__global float* row, SoftEnd a, SoftEnd b, float4 axis, float coefficient) {
  axis = scaleByFriction(BODY_ANISOTROPIC_ROLLING, a, b, axis);
  const float yield = dot3(axis, massAngular(a.mass, axis)) + dot3(axis, massAngular(b.mass, axis));
  const float4 turning = (a.held ? a.body.angular : vec3(0.0f, 0.0f, 0.0f)) -
                         (b.held ? b.body.angular : vec3(0.0f, 0.0f, 0.0f));
  const int live = coefficient > 0.0f && length3(axis) > 0.001f;  // Bullet's limit
  storeField3(row, SOFT_ROLL_AXIS, axis);
  storeField(row, SOFT_ROLL_MASS, live ? inverseOf(yield) : 0.0f);
  storeField(row, SOFT_ROLL_COEFFICIENT, coefficient);
  storeField(row, SOFT_ROLL_HELD, dot3(axis, turning));
  storeField(row, SOFT_ROLL_IMPULSE, 0.0f);
}

static void prepareSoftSlot(CHECKS uint i, StepParams s, __global StepCounters* counters,
                            __global const SlotHeader* slots, __global const BodyInfo* infos,
                            __global const BodyPose* poses, __global const BodyStep* steps,
                            __global const BodyMass* masses, __global const BodyMaterial* materials,
                            __global const SolverMass* solverMasses, __global Manifold* manifolds,
                            __global float* rows, __global float* rolls) {
  const SlotHeader header = AT(slots, i);
  if (header.manifold == NO_INDEX) return;
  __global Manifold* manifold = &AT(manifolds, header.manifold);
  ASSERT(header.pointCount <= MANIFOLD_POINTS, header.pointCount, header.manifold);
  const SoftEnd a = makeSoftEnd(WITH_CHECKS manifold->bodyA, header.bodyA == NO_INDEX, infos, poses, steps, masses,
                                materials, solverMasses);
  const SoftEnd b = makeSoftEnd(WITH_CHECKS manifold->bodyB, header.bodyB == NO_INDEX, infos, poses, steps, masses,
                                materials, solverMasses);
  __global float* slot = rows + slotBase(i, SLOT_SOFT_FIELDS);
  Touch t;
  t.armA = t.armB = t.normal = t.impulse = vec3(0.0f, 0.0f, 0.0f);
  t.friction = t.spin = t.roll = t.lever = 0.0f;
  t.first = MANIFOLD_POINTS;
  float count = 0.0f;
  float4 arms[MANIFOLD_POINTS];
  for (uint k = 0; k < header.pointCount; ++k) {
    const ContactPoint p = manifold->points[k];
    const float4 ra = mulMatrix(a.rotation, p.localPointA), rb = mulMatrix(b.rotation, p.localPointB);
    const int wanted = p.localPointA.w <= manifold->processingThreshold && (a.pushed || b.pushed);
    __global float* row = slot + k * SOFT_POINT_FIELDS * BTGPU_LANES;
    const int solved = prepareSoftPoint(s, row, counters, a, b, wanted, p, ra, rb);
    arms[k] = withW(ra, solved ? 1.0f : 0.0f);
    if (!solved) continue;
    if (t.first == MANIFOLD_POINTS) t.first = k;
    count += 1.0f;
    t.armA += ra;
    t.armB += rb;
    t.normal += xyz(p.normalWorldOnB);
    t.impulse += xyz(p.lateralFrictionDir1) * p.normalWorldOnB.w + xyz(p.lateralFrictionDir2) * p.lateralFrictionDir1.w;
    t.friction += p.combined.x;
    t.roll += p.combined.z;
    t.spin += p.combined.z > 0.0f ? p.combined.w : 0.0f;  // Bullet looks at it only then
  }
  const float part = count > 0.0f ? 1.0f / count : 0.0f;
  t.armA *= part;
  t.armB *= part;
  t.friction *= part;
  t.roll *= part;
  t.spin *= part;
  const float size = length3(t.normal);
  t.normal = size > 0.0f ? t.normal / size : vec3(0.0f, 0.0f, 0.0f);
  for (uint k = 0; k < header.pointCount; ++k) {
    if (arms[k].w == 0.0f) continue;
    const float4 away = xyz(arms[k]) - t.armA;
    t.lever += part * length3(away - t.normal * dot3(t.normal, away));
  }
  float4 t1 = vec3(0.0f, 0.0f, 0.0f), t2 = t1;
  if (count > 0.0f) chooseSoftTangents(s, a, b, t, manifold->points[t.first], &t1, &t2);
  prepareSoftFriction(s, slot + SOFT_FRICTION * BTGPU_LANES, a, b, t, t1, t2);
  for (uint k = 0; k < header.pointCount; ++k) {
    if (arms[k].w == 0.0f) continue;
    manifold->points[k].lateralFrictionDir1 = withW(t1, manifold->points[k].lateralFrictionDir1.w);
    manifold->points[k].lateralFrictionDir2 = withW(t2, manifold->points[k].lateralFrictionDir2.w);
  }
  if (!(s.flags & STEP_TORSION)) return;
  __global float* roll = rolls + slotBase(i, SLOT_ROLL_FIELDS);
  float4 p1 = t.normal, p2 = t.normal;
  if (size > 0.0f) planeSpace(t.normal, &p1, &p2);
  prepareRoll(roll, a, b, p1, t.roll);
  prepareRoll(roll + SOFT_ROLL_FIELDS * BTGPU_LANES, a, b, p2, t.roll);
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
KERNEL prepareSoftContacts(CHECKS uint slotCapacity, __global StepCounters* counters,
                           __global const StepParams* params, __global const SlotHeader* slots,
                           __global const BodyInfo* infos, __global const BodyPose* poses,
                           __global const BodyStep* steps, __global const BodyMass* masses,
                           __global const BodyMaterial* materials, __global const SolverMass* solverMasses,
                           __global Manifold* manifolds, __global float* rows, __global float* rolls) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams s = *params;
  const uint count = itemCount(slotCapacity, &counters->slotCount);
#ifdef BTGPU_SHAPE_CPU
  // Colours fill whole blocks of BTGPU_LANES.
  const int wide = canPrepareSoftWide(s.flags);
  FOR_EACH(block, count / BTGPU_WIDE) {
    const uint first = block * BTGPU_WIDE;
    if (wide && BLOCK_IS_SOUND(slots, first, manifolds, infos) &&
        prepareSoftWide(s, counters, slots + first, infos, poses, steps, masses, solverMasses, manifolds,
                        rows + slotBase(first, SLOT_SOFT_FIELDS))) {
      continue;
    }
    for (uint i = first; i < first + BTGPU_WIDE; ++i) {
      prepareSoftSlot(WITH_CHECKS i, s, counters, slots, infos, poses, steps, masses, materials, solverMasses,
                      manifolds, rows, rolls);
    }
  }
#else
  FOR_EACH(i, count) {
    prepareSoftSlot(WITH_CHECKS i, s, counters, slots, infos, poses, steps, masses, materials, solverMasses, manifolds,
                    rows, rolls);
  }
#endif
}
