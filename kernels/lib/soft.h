// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The rows of the fast mode (shared/soft.h): softness, and one update of a row. Velocities are whole ones here, not
// changes since the start of the step.
#ifndef BTGPU_LIB_SOFT_H
#define BTGPU_LIB_SOFT_H
#include "../shared/joint.h"
#include "../shared/soft.h"
#include "rows.h"

BTGPU_BEGIN

LIB float substepOf(StepParams s) { return s.timeStep / (float)s.substeps; }

// What a soft row gives way by: it asks for `rate` of the penetration as a speed, and settles for `share` of the
// impulse that this takes (and of what it had).
STRUCT(Softness) { float rate, share; };

// A damped spring on the row's own effective mass, implicit over a substep of length h.
LIB Softness softnessOf(float hertz, float dampingRatio, float h) {
  const float turn = 6.2831853f * hertz * h, stiff = turn * (2.0f * dampingRatio + turn);
  Softness s;
  s.rate = turn > 0.0f ? turn / ((2.0f * dampingRatio + turn) * h) : 0.0f;
  s.share = stiff / (1.0f + stiff);
  return s;
}

// A contact with a body that can't give way is twice as stiff; none is stiffer than substeps can follow.
LIB Softness contactSoftness(StepParams s, int toFixed) {
  const float h = substepOf(s);
  return softnessOf(fmin(toFixed ? 2.0f * s.contactHertz : s.contactHertz, 0.25f / h), s.contactDampingRatio, h);
}

// A contact with stiffness and damping of its own; `mass` is that of its hard row.
LIB Softness springSoftness(float mass, float stiffness, float damping, float h) {
  const float spring = h * stiffness, sum = fmax(spring + damping, BTGPU_EPSILON);
  Softness s;
  s.rate = spring <= 3.402823466e38f ? spring / sum / h : 1.0f / h;  // infinitely stiff is hard, as in rows.h
  s.share = 1.0f / (1.0f + mass / (sum * h));
  return s;
}

// ---- contacts

STRUCT(SoftPoint) {
  float4 normal, angularA, angularB;
  float mass, separation, held, springShare, springRate, impulse, total;
};

// Motion since the start of the step; velocities times time.
STRUCT(SlotMotion) { float4 linearA, angularA, linearB, angularB; };

LIB float alongNormal(SoftPoint p, float4 linearA, float4 angularA, float4 linearB, float4 angularB) {
  return dot3(p.normal, linearA - linearB) + dot3(p.angularA, angularA) - dot3(p.angularB, angularB);
}

LIB void applySoftNormal(REF(SlotBodies) s, SoftPoint p, float impulse) {
  const float4 push = p.normal * impulse;
  s->linearA += scale3(massLinear(s->massA), push);
  s->angularA += massAngular(s->massA, p.angularA * impulse);
  s->linearB -= scale3(massLinear(s->massB), push);
  s->angularB -= massAngular(s->massB, p.angularB * impulse);
}

// The settings of a pass over the contacts of a slot.
STRUCT(SoftPass) {
  Softness contact;
  float pushSpeed;  // most that penetration asks for
  float h, time;    // length of a substep; time since the start of the step
  int relax;        // without what penetration asks for
};

LIB SoftPass makeSoftPass(StepParams s, uint pass, uint substep, int toFixed) {
  SoftPass p;
  p.contact = contactSoftness(s, toFixed);
  p.pushSpeed = s.pushSpeed;
  p.h = substepOf(s);
  p.relax = pass == SUB_RELAX;
  p.time = p.h * (float)(substep + (p.relax ? 1u : 0u));
  return p;
}

LIB void solveSoftNormal(REF(SlotBodies) s, SlotMotion m, SoftPass pass, REF(SoftPoint) p) {
  const float speed = alongNormal(*p, s->linearA, s->angularA, s->linearB, s->angularB) + p->held;
  const float separation =
      p->separation + (alongNormal(*p, m.linearA, m.angularA, m.linearB, m.angularB) + p->held * pass.time);
  float share = 1.0f, bias = 0.0f;
  if (separation > 0.0f) {
    bias = separation / pass.h;
  } else if (p->springShare != 0.0f) {
    bias = p->springRate * separation;
    share = p->springShare;
  } else if (!pass.relax) {
    bias = fmax(pass.contact.rate * separation, -pass.pushSpeed);
    share = pass.contact.share;
  }
  const float impulse = fmax(share * (p->impulse - p->mass * (speed + bias)), 0.0f);
  applySoftNormal(s, *p, impulse - p->impulse);
  p->impulse = impulse;
}

// Restitution: what the contact is to have after the step, where it was hit.
LIB void bounceSoftNormal(REF(SlotBodies) s, float bounce, REF(SoftPoint) p) {
  const float speed = alongNormal(*p, s->linearA, s->angularA, s->linearB, s->angularB) + p->held;
  const float impulse = fmax(p->impulse - p->mass * (speed - bounce), 0.0f);
  applySoftNormal(s, *p, impulse - p->impulse);
  p->total += impulse - p->impulse;
  p->impulse = impulse;
}

// The speed apart that restitution asks for. `before`, `after`: along the normal, at the start of the step and with its
// forces. A body leaves with the energy that it came with, as Bullet integrates free flight: it falls on for the
// separation, and its speed counts from after the forces of a step.
LIB float reboundOf(StepParams s, float restitution, float before, float after, float separation) {
  if (fabs(before) < s.restitutionVelocityThreshold || !(restitution * before < 0.0f)) return 0.0f;
  const float fall = 2.0f * fmax(before - after, 0.0f) / s.timeStep * fmax(separation, 0.0f);
  return restitution * sqrt(after * after + fall);
}

// ---- friction of a manifold

STRUCT(SoftFriction) {
  float4 armA, armB, tangent1, tangent2, axis;
  float mass11, mass12, mass22, twistMass;
  float coefficient, lever, spin;
  float held1, held2, heldTwist;
  float impulse1, impulse2, twist;
};

LIB void applySoftFriction(REF(SlotBodies) s, SoftFriction f, float4 push, float twist) {
  s->linearA += scale3(massLinear(s->massA), push);
  s->angularA += massAngular(s->massA, cross3(f.armA, push) + f.axis * twist);
  s->linearB -= scale3(massLinear(s->massB), push);
  s->angularB -= massAngular(s->massB, cross3(f.armB, push) + f.axis * twist);
}

// Both tangents at once, within a circle; then the twist. `load`: the impulse of all normals; `step`: the length of a
// substep as a part of the step.
LIB void solveSoftFriction(REF(SlotBodies) s, float load, float step, REF(SoftFriction) f) {
  const float4 slip =
      s->linearA + cross3(s->angularA, f->armA) - s->linearB - cross3(s->angularB, f->armB);
  const float slip1 = dot3(f->tangent1, slip) + f->held1, slip2 = dot3(f->tangent2, slip) + f->held2;
  const float wanted1 = f->impulse1 - (f->mass11 * slip1 + f->mass12 * slip2);
  const float wanted2 = f->impulse2 - (f->mass12 * slip1 + f->mass22 * slip2);
  const float limit = f->coefficient * load, sizeSqr = wanted1 * wanted1 + wanted2 * wanted2;
  const float scale = sizeSqr > limit * limit ? limit / sqrt(sizeSqr) : 1.0f;
  const float impulse1 = wanted1 * scale, impulse2 = wanted2 * scale;

  const float spinning = dot3(f->axis, s->angularA - s->angularB) + f->heldTwist;
  const float twistLimit = limit * f->lever + f->spin * fmin(load, step);  // Bullet's limit of the latter
  const float twist = fmin(fmax(f->twist - f->twistMass * spinning, -twistLimit), twistLimit);

  const float4 push = f->tangent1 * (impulse1 - f->impulse1) + f->tangent2 * (impulse2 - f->impulse2);
  applySoftFriction(s, *f, push, twist - f->twist);
  f->impulse1 = impulse1;
  f->impulse2 = impulse2;
  f->twist = twist;
}

// One row of rolling friction; the new impulse.
LIB float solveSoftRoll(REF(SlotBodies) s, float4 axis, float mass, float held, float limit, float impulse) {
  const float speed = dot3(axis, s->angularA - s->angularB) + held;
  const float wanted = fmin(fmax(impulse - mass * speed, -limit), limit);
  const float4 turn = axis * (wanted - impulse);
  s->angularA += massAngular(s->massA, turn);
  s->angularB -= massAngular(s->massB, turn);
  return wanted;
}

BTGPU_END
#endif
