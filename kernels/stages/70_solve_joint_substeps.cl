// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Joints of the fast mode (docs/fast_mode.md), in the substeps of 70_solve_substeps.cl. Their rows are those of the whole
// step, as getInfo2 made them: a row with a position error has moved as far at the end of each substep as it is to have
// moved by then, whatever went wrong in those before.
#include "../lib/kernel.h"
#include "../lib/soft.h"

static int rowIs(uint rows, uint r) { return r < 32u && (rows >> r & 1u); }

static float speedOf(float4 linear, float4 angular, float4 linearVelocity, float4 angularVelocity) {
  return dot3(linear, linearVelocity) + dot3(angular, angularVelocity);
}

// Speeds that each row wants, and the impulses that it starts with.
KERNEL prepareSoftJoints(CHECKS uint jointCount, __global const StepCounters* counters,
                         __global const StepParams* params, __global const Joint* joints, __global const JointRow* rows,
                         __global const float* lastImpulses, __global const BodyStep* steps,
                         __global SoftJointRow* softRows, __global float* impulses) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams s = *params;
  FOR_EACH(j, jointCount) {
    const Joint joint = AT(joints, j);
    for (uint k = 0; k < joint.rowCount; ++k) {
      const uint r = joint.firstRow + k;
      const JointRow row = AT(rows, r);
      float speed = 0.0f;  // forces of the step included
      if (joint.bodyA != NO_INDEX) {
        const BodyStep b = AT(steps, joint.bodyA);
        speed += speedOf(row.linearA, row.angularA, b.linearVelocity + b.externalLinear,
                         b.angularVelocity + b.externalAngular);
      }
      if (joint.bodyB != NO_INDEX) {
        const BodyStep b = AT(steps, joint.bodyB);
        speed += speedOf(row.linearB, row.angularB, b.linearVelocity + b.externalLinear,
                         b.angularVelocity + b.externalAngular);
      }
      SoftJointRow soft;
      // Of a velocity error a row removes no more than `damping`.
      soft.wanted = row.linearA.w + (1.0f - joint.damping) * speed;
      soft.impulse = s.flags & STEP_WARM_START ? AT(lastImpulses, r) * (s.warmStartingFactor / (float)s.substeps) : 0.0f;
      if (!isfinite(soft.wanted)) soft.wanted = 0.0f;
      AT(softRows, r) = soft;
      AT(impulses, r) = 0.0f;
    }
  }
}

STRUCT(JointEnds) {
  SlotBodies bodies;
  float4 movedLinearA, movedAngularA, movedLinearB, movedAngularB;
  int same;
};

static JointEnds loadEnds(CHECKS Joint joint, __global const SolverBody* bodies, __global const SolverMass* masses) {
  JointEnds e;
  SlotBodies* s = &e.bodies;
  s->linearA = s->angularA = s->linearB = s->angularB = vec3(0.0f, 0.0f, 0.0f);
  e.movedLinearA = e.movedAngularA = e.movedLinearB = e.movedAngularB = s->linearA;
  s->massA.row0 = s->massA.row1 = s->massA.row2 = vec3(0.0f, 0.0f, 0.0f);
  s->massB = s->massA;
  if (joint.bodyA != NO_INDEX) {
    const SolverBody b = AT(bodies, joint.bodyA);
    s->linearA = b.deltaLinear;
    s->angularA = b.deltaAngular;
    e.movedLinearA = b.pushLinear;
    e.movedAngularA = b.turnAngular;
    s->massA = AT(masses, joint.bodyA);
  }
  if (joint.bodyB != NO_INDEX) {
    const SolverBody b = AT(bodies, joint.bodyB);
    s->linearB = b.deltaLinear;
    s->angularB = b.deltaAngular;
    e.movedLinearB = b.pushLinear;
    e.movedAngularB = b.turnAngular;
    s->massB = AT(masses, joint.bodyB);
  }
  e.same = joint.bodyA == joint.bodyB;
  return e;
}

static void applyJointImpulse(JointEnds* e, JointRow row, float impulse) {
  SlotBodies* s = &e->bodies;
  s->linearA += scale3(massLinear(s->massA), row.linearA) * impulse;
  s->angularA += massAngular(s->massA, row.angularA) * impulse;
  if (e->same) {
    s->linearB = s->linearA;
    s->angularB = s->angularA;
  }
  s->linearB += scale3(massLinear(s->massB), row.linearB) * impulse;
  s->angularB += massAngular(s->massB, row.angularB) * impulse;
  if (e->same) {
    s->linearA = s->linearB;
    s->angularA = s->angularB;
  }
}

// What a row's speed is to be in a pass. With a position error it is to move evenly, in a step, as far as getInfo2 wants:
// what is lacking is made up for softly, what there is too much of may be given back where the row has one limit only.
static float targetOf(Joint joint, uint k, SoftJointRow soft, JointRow row, const JointEnds* e, uint pass, float h,
                      float time, float rate) {
  const int equal = rowIs(joint.equalRows, k), bound = rowIs(joint.boundRows, k);
  if (!equal && !bound) return soft.wanted;
  const float moved = speedOf(row.linearA, row.angularA, e->movedLinearA, e->movedAngularA) +
                      speedOf(row.linearB, row.angularB, e->movedLinearB, e->movedAngularB);
  const float lacking = soft.wanted * time - moved;
  if (bound && (row.linearB.w < 0.0f ? lacking > 0.0f : lacking < 0.0f)) return soft.wanted + lacking / h;
  return pass == SUB_RELAX ? soft.wanted : soft.wanted + lacking * rate;
}

// The impulse of the step so far. At its limit in all substeps it is the limit itself, to the bit: that breaks a joint.
static float totalOf(float total, JointRow row, StepParams s, uint substep) {
  if (substep + 1u < s.substeps) return total;
  if (total >= row.angularB.w * (1.0f - 1e-6f) && row.angularB.w > 0.0f) return row.angularB.w;
  if (total <= row.linearB.w * (1.0f - 1e-6f) && row.linearB.w < 0.0f) return row.linearB.w;
  return total;
}

static void solveSoftJoint(CHECKS uint j, StepParams s, uint pass, uint substep, __global const Joint* joints,
                           __global const JointRow* rows, __global const JointEffect* effects,
                           __global const uint* jointSolved, __global const SolverMass* masses,
                           __global SolverBody* bodies, __global SoftJointRow* softRows, __global float* impulses) {
  const Joint joint = AT(joints, j);
  if (!AT(jointSolved, j)) return;
  JointEnds e = loadEnds(WITH_CHECKS joint, bodies, masses);
  const float parts = (float)s.substeps, h = substepOf(s);
  const float time = h * (float)(substep + (pass == SUB_RELAX ? 1u : 0u));
  const Softness softness = softnessOf(fmin(s.jointHertz, 0.25f / h), s.jointDampingRatio, h);
  for (uint k = 0; k < joint.rowCount; ++k) {
    const uint r = joint.firstRow + k;
    const JointRow row = AT(rows, r);
    const float jac = AT(effects, r).jac;
    if (jac == 0.0f) continue;
    const SoftJointRow soft = AT(softRows, r);
    if (pass == SUB_WARM_START) {
      applyJointImpulse(&e, row, soft.impulse);
      continue;
    }
    const float speed = speedOf(row.linearA, row.angularA, e.bodies.linearA, e.bodies.angularA) +
                        speedOf(row.linearB, row.angularB, e.bodies.linearB, e.bodies.angularB);
    const float target = targetOf(joint, k, soft, row, &e, pass, h, time, softness.rate);
    const float share = rowIs(joint.equalRows, k) && pass != SUB_RELAX ? softness.share : 1.0f;
    const float lower = row.linearB.w / parts, upper = row.angularB.w / parts;
    const float wanted = share * (soft.impulse - soft.impulse * fmin(row.angularA.w * parts, 1.0f) - (speed - target) * jac);
    const float impulse = wanted < lower ? lower : wanted > upper ? upper : wanted;
    applyJointImpulse(&e, row, impulse - soft.impulse);
    AT(softRows, r).impulse = impulse;
    if (pass == SUB_RELAX) AT(impulses, r) = totalOf(AT(impulses, r) + impulse, row, s, substep);
  }
  if (joint.bodyA != NO_INDEX) {
    AT(bodies, joint.bodyA).deltaLinear = e.bodies.linearA;
    AT(bodies, joint.bodyA).deltaAngular = e.bodies.angularA;
  }
  if (joint.bodyB != NO_INDEX) {
    AT(bodies, joint.bodyB).deltaLinear = e.bodies.linearB;
    AT(bodies, joint.bodyB).deltaAngular = e.bodies.angularB;
  }
}

// One pass over the joints order[first ...] of one colour.
KERNEL substepJointColour(CHECKS uint pass, uint substep, uint first, uint count, __global const StepCounters* counters,
                          __global const StepParams* params, __global const uint* order, __global const Joint* joints,
                          __global const JointRow* rows, __global const JointEffect* effects,
                          __global const uint* jointSolved, __global const SolverMass* masses,
                          __global SolverBody* bodies, __global SoftJointRow* softRows, __global float* impulses) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams s = *params;
  FOR_EACH(i, count) {
    solveSoftJoint(WITH_CHECKS AT(order, first + i), s, pass, substep, joints, rows, effects, jointSolved, masses,
                   bodies, softRows, impulses);
  }
}

// One pass over joints that share bodies, one after the other. Single work item.
SINGLE_KERNEL substepJointsSerial(CHECKS uint pass, uint substep, uint first, uint count,
                                  __global const StepCounters* counters, __global const StepParams* params,
                                  __global const uint* order, __global const Joint* joints,
                                  __global const JointRow* rows, __global const JointEffect* effects,
                                  __global const uint* jointSolved, __global const SolverMass* masses,
                                  __global SolverBody* bodies, __global SoftJointRow* softRows,
                                  __global float* impulses) {
  RETURN_ON_OVERFLOW(counters);
  const StepParams s = *params;
  for (uint i = 0; i < count; ++i) {
    const uint at = pass == SUB_RELAX ? first + count - 1 - i : first + i;
    solveSoftJoint(WITH_CHECKS AT(order, at), s, pass, substep, joints, rows, effects, jointSolved, masses, bodies,
                   softRows, impulses);
  }
}
