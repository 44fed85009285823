// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"
#include "../lib/rows.h"
#include "../shared/joint.h"

// How easily a body yields to a row; Bullet leaves both factors out here.
static float mobility(RowBody b, float4 linear, float4 angular) {
  return b.inverseMass * dot3(linear, linear) + dot3(mulMatrix(b.inverseInertia, angular), angular);
}

// Speed along a row, forces of the step included.
static float speedAlong(RowBody b, float4 linear, float4 angular) {
  return dot3(linear, b.linear + b.externalLinear) + dot3(angular, b.angular + b.externalAngular);
}

static JointEffect prepareRow(CHECKS Joint joint, JointRow row, __global const BodyStep* steps) {
  float sum = 0.0f, speed = 0.0f;
  if (joint.bodyA != NO_INDEX) {
    const RowBody a = makeRowBody(AT(steps, joint.bodyA), vec3(1.0f, 1.0f, 1.0f));
    sum += mobility(a, row.linearA, row.angularA);
    speed += speedAlong(a, row.linearA, row.angularA);
  }
  if (joint.bodyB != NO_INDEX) {
    const RowBody b = makeRowBody(AT(steps, joint.bodyB), vec3(1.0f, 1.0f, 1.0f));
    sum += mobility(b, row.linearB, row.angularB);
    speed += speedAlong(b, row.linearB, row.angularB);
  }
  JointEffect effect;
  effect.jac = fabs(sum) > joint.leastMobility ? 1.0f / sum : 0.0f;
  effect.rhs = (row.linearA.w - speed * joint.damping) * effect.jac;
  // A row that is no number must not spread.
  if (!isfinite(effect.jac) || !isfinite(effect.rhs) || !isFinite4(row.angularA) || !isFinite3(row.angularB)) {
    effect.jac = effect.rhs = 0.0f;
  }
  return effect;
}

// Completes the rows of every joint from the bodies' velocities, masses and inertia, and forgets their impulses:
// Bullet's convertJoint.
KERNEL prepareJoints(CHECKS uint jointCount, __global const StepCounters* counters, __global const Joint* joints,
                     __global const JointRow* rows, __global const BodyStep* steps, __global JointEffect* effects,
                     __global float* impulses) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, jointCount) {
    const Joint joint = joints[i];
    for (uint r = joint.firstRow; r < joint.firstRow + joint.rowCount; ++r) {
      AT(effects, r) = prepareRow(WITH_CHECKS joint, AT(rows, r), steps);
      AT(impulses, r) = 0.0f;
    }
  }
}
