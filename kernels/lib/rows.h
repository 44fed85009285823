// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Contact rows with the semantics of Bullet's sequential impulse solver: how a contact point becomes rows
// (prepare) and how one row is solved (solve). A row is the triple (direction, effective mass, wanted impulse).
#ifndef BTGPU_LIB_ROWS_H
#define BTGPU_LIB_ROWS_H
#include "../shared/body.h"
#include "../shared/rows.h"
#include "../shared/step.h"
#include "motion.h"
#include "vec.h"

BTGPU_BEGIN

// Address of field 0 of a slot in an array with `fields` floats a slot; field f is at [f * BTGPU_LANES].
LIB ulong slotBase(uint slot, uint fields) {
  return (ulong)(slot / BTGPU_LANES) * fields * BTGPU_LANES + slot % BTGPU_LANES;
}
LIB float loadField(const __global float* slot, int field) { return slot[field * BTGPU_LANES]; }
LIB void storeField(__global float* slot, int field, float value) { slot[field * BTGPU_LANES] = value; }
LIB float4 loadField3(const __global float* slot, int field) {
  return vec3(loadField(slot, field), loadField(slot, field + 1), loadField(slot, field + 2));
}
LIB void storeField3(__global float* slot, int field, float4 v) {
  storeField(slot, field, v.x);
  storeField(slot, field + 1, v.y);
  storeField(slot, field + 2, v.z);
}

// ---- prepare

// One end of a row: what the solver knows of a body when it builds rows.
STRUCT(RowBody) {
  float4 linear, angular;                   // velocity before the step
  float4 externalLinear, externalAngular;   // velocity gained by forces in this step
  Matrix3 inverseInertia;                   // world axes
  float4 angularFactor;
  float inverseMass;
};

LIB RowBody makeRowBody(BodyStep step, float4 angularFactor) {
  RowBody b;
  b.linear = xyz(step.linearVelocity);
  b.angular = xyz(step.angularVelocity);
  b.externalLinear = step.externalLinear;
  b.externalAngular = step.externalAngular;
  b.inverseInertia.row0 = step.inverseInertia0;
  b.inverseInertia.row1 = step.inverseInertia1;
  b.inverseInertia.row2 = step.inverseInertia2;
  b.angularFactor = angularFactor;
  b.inverseMass = step.linearVelocity.w;
  return b;
}

// Whether impulses change the velocity of the body's centre. Bullet's convertContact leaves out contacts in which they
// do that to neither body, even if they could turn one (btVector3::fuzzyZero of both inverse masses times factor).
LIB int canBePushed(float inverseMass, float4 linearFactor) {
  return lengthSqr3(linearFactor * inverseMass) >= BTGPU_EPSILON * BTGPU_EPSILON;
}

LIB float4 velocityAt(RowBody b, float4 r) { return b.linear + cross3(b.angular, r); }
LIB float4 velocityWithForcesAt(RowBody b, float4 r) {
  return b.linear + b.externalLinear + cross3(b.angular + b.externalAngular, r);
}

// n . (M^-1 n) at the arm r: how easily the body yields along n.
LIB float compliance(RowBody b, float4 n, float4 r) {
  const float4 angular = scale3(mulMatrix(b.inverseInertia, cross3(r, n)), b.angularFactor);
  return b.inverseMass + dot3(n, cross3(angular, r));
}

// Relative velocity along n, forces of the step included.
LIB float approach(RowBody a, RowBody b, float4 n, float4 ra, float4 rb) {
  return dot3(n, a.linear + a.externalLinear) + dot3(cross3(ra, n), a.angular + a.externalAngular) -
         dot3(n, b.linear + b.externalLinear) - dot3(cross3(rb, n), b.angular + b.externalAngular);
}

STRUCT(NormalRow) { float jac, rhs, cfm, pushRhs; };

LIB NormalRow prepareNormal(StepParams s, RowBody a, RowBody b, ContactPoint p, float4 ra, float4 rb) {
  const float4 n = xyz(p.normalWorldOnB);
  const float inverseTimeStep = 1.0f / s.timeStep;
  float cfm = s.globalCfm, erp = s.erp2;
  if (p.flags & (POINT_CFM | POINT_ERP)) {
    if (p.flags & POINT_CFM) cfm = p.combinedStiffness;
    if (p.flags & POINT_ERP) erp = p.combinedDamping;
  } else if (p.flags & POINT_STIFFNESS_DAMPING) {
    const float stiffness = s.timeStep * p.combinedStiffness;
    const float denominator = fmax(stiffness + p.combinedDamping, BTGPU_EPSILON);
    cfm = 1.0f / denominator;
    erp = stiffness <= 3.402823466e38f ? stiffness / denominator : 1.0f;  // infinitely stiff is hard (Bullet: NaN)
  }
  cfm *= inverseTimeStep;

  NormalRow row;
  row.jac = s.sor / (compliance(a, n, ra) + compliance(b, n, rb) + cfm);
  row.cfm = cfm * row.jac;

  const float speed = dot3(n, velocityAt(a, ra) - velocityAt(b, rb));
  const float bounce = fabs(speed) < s.restitutionVelocityThreshold ? 0.0f : fmax(0.0f, -p.combined.y * speed);
  const float distance = p.localPointA.w + s.linearSlop;
  float velocityError = bounce - approach(a, b, n, ra, rb);
  float positionError = 0.0f;
  if (distance > 0.0f) {
    velocityError -= distance * inverseTimeStep;
  } else {
    positionError = -distance * erp * inverseTimeStep;
  }
  const int split = (s.flags & STEP_SPLIT_IMPULSE) && distance <= s.splitImpulsePenetrationThreshold;
  row.rhs = (velocityError + (split ? 0.0f : positionError)) * row.jac;
  row.pushRhs = split ? positionError * row.jac : 0.0f;
  return row;
}

// The same as Bullet's friction rows see it: what torque and gyroscopic term add in this step is left out there.
LIB float slide(RowBody a, RowBody b, float4 t, float4 ra, float4 rb) {
  return dot3(t, a.linear + a.externalLinear) + dot3(cross3(ra, t), a.angular) - dot3(t, b.linear + b.externalLinear) -
         dot3(cross3(rb, t), b.angular);
}

// Effective mass and right-hand side of a friction row along t.
LIB float frictionJac(StepParams s, RowBody a, RowBody b, float4 t, float4 ra, float4 rb) {
  return s.sor / (compliance(a, t, ra) + compliance(b, t, rb));
}
LIB float frictionRhs(RowBody a, RowBody b, float4 t, float4 ra, float4 rb, float jac) {
  return -slide(a, b, t, ra, rb) * jac;
}

// What a friction row along t wants besides: to draw the point back to its anchor. `between`: from the point on B to
// the one on A.
LIB float anchorRhs(StepParams s, float4 t, float4 between, float jac) {
  return -dot3(between, t) * s.frictionErp / s.timeStep * jac;
}

// Torsional row about `axis`: the angular parts are -axis for A and +axis for B. No external torque, as above.
LIB float torsionJac(RowBody a, RowBody b, float4 axis) {
  return 1.0f / (dot3(mulMatrix(a.inverseInertia, axis), axis) + dot3(mulMatrix(b.inverseInertia, axis), axis));
}
LIB float torsionRhs(RowBody a, RowBody b, float4 axis, float jac) {
  return dot3(axis, a.angular - b.angular) * jac;
}

// A direction scaled by a body's anisotropic friction, per body axis.
LIB float4 anisotropic(uint flags, uint wanted, BodyMaterial m, Matrix3 rotation, float4 direction) {
  if (!(flags & wanted)) return direction;
  return mulMatrix(rotation, scale3(mulTransposed(rotation, direction), m.anisotropicFriction));
}

// ---- solve

// Response to impulses with both factors applied twice, as Bullet does (once in the row, once when the impulse is
// applied).
LIB SolverMass makeSolverMass(BodyStep step, BodyMass body) {
  const float4 lf = body.linearFactor, af = body.angularFactor;
  const float m = step.linearVelocity.w;
  SolverMass mass;
  mass.row0 = withW(step.inverseInertia0 * (af.x * af.x), m * lf.x * lf.x);
  mass.row1 = withW(step.inverseInertia1 * (af.y * af.y), m * lf.y * lf.y);
  mass.row2 = withW(step.inverseInertia2 * (af.z * af.z), m * lf.z * lf.z);
  return mass;
}

// Velocity change of the two bodies of a slot, and how they answer to impulses.
STRUCT(SlotBodies) {
  float4 linearA, angularA, linearB, angularB;
  SolverMass massA, massB;
};

LIB float4 massAngular(SolverMass m, float4 torque) {
  return vec3(dot3(m.row0, torque), dot3(m.row1, torque), dot3(m.row2, torque));
}
LIB float4 massLinear(SolverMass m) { return vec3(m.row0.w, m.row1.w, m.row2.w); }

LIB float rowVelocity(const SlotBodies* s, float4 n, float4 ra, float4 rb) {
  return dot3(n, s->linearA) + dot3(cross3(ra, n), s->angularA) - dot3(n, s->linearB) - dot3(cross3(rb, n), s->angularB);
}

LIB void applyRowImpulse(REF(SlotBodies) s, float4 n, float4 ra, float4 rb, float impulse) {
  const float4 p = n * impulse;
  s->linearA += scale3(massLinear(s->massA), p);
  s->angularA += massAngular(s->massA, cross3(ra, p));
  s->linearB -= scale3(massLinear(s->massB), p);
  s->angularB -= massAngular(s->massB, cross3(rb, p));
}

// One projected Gauss-Seidel update; the new accumulated impulse is returned, the change applied to the bodies.
LIB float solveRow(REF(SlotBodies) s, float4 n, float4 ra, float4 rb, float jac, float rhs, float cfm, float impulse,
                   float lower, float upper) {
  const float wanted = impulse + rhs - impulse * cfm - rowVelocity(s, n, ra, rb) * jac;
  const float clamped = fmin(fmax(wanted, lower), upper);
  applyRowImpulse(s, n, ra, rb, clamped - impulse);
  return clamped;
}

// The same for a torsional row about `axis`.
LIB float solveTorsion(REF(SlotBodies) s, float4 axis, float jac, float rhs, float impulse, float limit) {
  const float velocity = dot3(axis, s->angularB - s->angularA);
  const float wanted = impulse + rhs - velocity * jac;
  const float clamped = fmin(fmax(wanted, -limit), limit);
  const float4 p = axis * (clamped - impulse);
  s->angularA -= massAngular(s->massA, p);
  s->angularB += massAngular(s->massB, p);
  return clamped;
}

BTGPU_END
#endif
