// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Motion of BTGPU_WIDE bodies at once (wide.h). Every lane is rounded as in motion.h and vec.h, operation by operation.
// OpenCL C only.
#ifndef BTGPU_LIB_MOTION_WIDE_H
#define BTGPU_LIB_MOTION_WIDE_H
#include "../shared/contact.h"
#include "motion.h"
#include "wide.h"

// The share of work item `get_global_id(0)` in blocks of BTGPU_WIDE items that lie side by side; `first` is that of a
// block, of which the last one may have fewer.
#define FOR_EACH_BLOCK(first, count)                                                                                  \
  for (uint first##_count = ((count) + BTGPU_WIDE - 1) / BTGPU_WIDE,                                                  \
            first = (uint)((ulong)first##_count * get_global_id(0) / get_global_size(0)) * BTGPU_WIDE,                \
            first##_end = (uint)((ulong)first##_count * (get_global_id(0) + 1) / get_global_size(0)) * BTGPU_WIDE;    \
       first < first##_end; first += BTGPU_WIDE)

// Element from[stride * lane].
WIDE Lanes4 gatherEvery(__global const float4* from, uint stride) {
#define ROW(l) from[stride * l]
  return transposeWide((Lanes)(ROW(0), ROW(4), ROW(8), ROW(12)), (Lanes)(ROW(1), ROW(5), ROW(9), ROW(13)),
                       (Lanes)(ROW(2), ROW(6), ROW(10), ROW(14)), (Lanes)(ROW(3), ROW(7), ROW(11), ROW(15)));
#undef ROW
}
WIDE void scatterEvery(__global float4* to, uint stride, Lanes3 v, Lanes w) {
  const uint lanes[BTGPU_WIDE] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  scatterWide(to, stride, lanes, v, w);
}

WIDE Lanes3 zeroWide(void) { return broadcastWide(vec3(0.0f, 0.0f, 0.0f)); }
WIDE Lanes4 withWWide(Lanes3 v, Lanes w) {
  Lanes4 r;
  r.x = v.x;
  r.y = v.y;
  r.z = v.z;
  r.w = w;
  return r;
}
WIDE Lanes4 pick4(LaneMask mask, Lanes4 yes, Lanes4 no) {
  yes.x = pick(mask, yes.x, no.x);
  yes.y = pick(mask, yes.y, no.y);
  yes.z = pick(mask, yes.z, no.z);
  yes.w = pick(mask, yes.w, no.w);
  return yes;
}
WIDE Lanes3 scaleWide(Lanes3 a, Lanes3 b) {
  a.x *= b.x;
  a.y *= b.y;
  a.z *= b.z;
  return a;
}
WIDE LaneMask anyBit(int16 flags, uint bits) { return (flags & (int)bits) != 0; }

// solverHasVelocity, solverMoves, isStaticOrKinematic, isActiveState
WIDE LaneMask solverHasVelocityWide(int16 flags, Lanes inverseMass) {
  return anyBit(flags, BODY_RIGID) & ~anyBit(flags, BODY_QUARANTINED) &
         ((inverseMass != 0.0f) | anyBit(flags, BODY_KINEMATIC));
}
WIDE LaneMask solverMovesWide(int16 flags, Lanes4 inverseInertiaLocalAndMass) {
  const Lanes3 inertia = xyzWide(inverseInertiaLocalAndMass);
  return solverHasVelocityWide(flags, inverseInertiaLocalAndMass.w) &
         ((inverseInertiaLocalAndMass.w != 0.0f) | (dotWide(inertia, inertia) != 0.0f));
}
WIDE LaneMask isStaticOrKinematicWide(int16 flags) { return anyBit(flags, BODY_STATIC | BODY_KINEMATIC); }
WIDE LaneMask isActiveStateWide(int16 state) {
  return (state != STATE_SLEEPING) & (state != STATE_DISABLE_SIMULATION) & (state != STATE_FIXED_BASE);
}

WIDE WideMatrix worldTensorWide(WideMatrix r, Lanes3 d) {
  const Lanes3 c0 = scaleWide(r.row0, d), c1 = scaleWide(r.row1, d), c2 = scaleWide(r.row2, d);
  WideMatrix m;
  m.row0.x = dotWide(c0, r.row0);
  m.row0.y = dotWide(c0, r.row1);
  m.row0.z = dotWide(c0, r.row2);
  m.row1.x = dotWide(c1, r.row0);
  m.row1.y = dotWide(c1, r.row1);
  m.row1.z = dotWide(c1, r.row2);
  m.row2.x = dotWide(c2, r.row0);
  m.row2.y = dotWide(c2, r.row1);
  m.row2.z = dotWide(c2, r.row2);
  return m;
}

STRUCT(WidePose) {
  Lanes3 position;
  Lanes4 orientation;
};

WIDE WidePose loadPoses(__global const BodyPose* poses) {
  WidePose p;
  p.position = xyzWide(gatherEvery(&poses->position, sizeof(BodyPose) / 16));
  p.orientation = gatherEvery(&poses->orientation, sizeof(BodyPose) / 16);
  return p;
}

WIDE WidePose pickPose(LaneMask mask, WidePose yes, WidePose no) {
  yes.position = pick3(mask, yes.position, no.position);
  yes.orientation = pick4(mask, yes.orientation, no.orientation);
  return yes;
}

WIDE Lanes4 quaternionProductWide(Lanes4 a, Lanes4 b) {
  Lanes4 q;
  q.x = a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y;
  q.y = a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z;
  q.z = a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x;
  q.w = a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z;
  return q;
}

WIDE WidePose integratePoseWide(WidePose pose, Lanes3 linear, Lanes3 angular, float timeStep) {
  WidePose next;
  next.position = addWide(pose.position, timesWide(linear, (Lanes)timeStep));
  const Lanes rateSqr = dotWide(angular, angular);
  Lanes rate = pick(rateSqr > BTGPU_EPSILON, sqrt(rateSqr), (Lanes)0.0f);
  rate = pick(rate * timeStep > MAX_ROTATION_PER_STEP, (Lanes)(MAX_ROTATION_PER_STEP / timeStep), rate);
  const float half_ = 0.5f * timeStep;
  const Lanes series = half_ - timeStep * timeStep * timeStep * (1.0f / 48.0f) * rate * rate;
  const Lanes scale = pick(rate < SMALL_ANGLE_RATE, series, sin(rate * half_) / rate);
  const Lanes4 q = quaternionProductWide(withWWide(timesWide(angular, scale), cos(rate * half_)), pose.orientation);
  const Lanes lengthSqr = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, length = sqrt(lengthSqr);
  next.orientation.x = q.x / length;
  next.orientation.y = q.y / length;
  next.orientation.z = q.z / length;
  next.orientation.w = q.w / length;
  next.orientation = pick4(lengthSqr <= BTGPU_EPSILON, pose.orientation, next.orientation);
  return next;
}

WIDE WideMatrix skewWide(Lanes3 v) {
  const Lanes zero = (Lanes)0.0f;
  WideMatrix m;
  m.row0.x = m.row1.y = m.row2.z = zero;
  m.row0.y = -v.z;
  m.row0.z = v.y;
  m.row1.x = v.z;
  m.row1.z = -v.x;
  m.row2.x = -v.y;
  m.row2.y = v.x;
  return m;
}

WIDE WideMatrix productWide(WideMatrix a, WideMatrix b) {
  WideMatrix m;
  m.row0 = addWide(addWide(timesWide(b.row0, a.row0.x), timesWide(b.row1, a.row0.y)), timesWide(b.row2, a.row0.z));
  m.row1 = addWide(addWide(timesWide(b.row0, a.row1.x), timesWide(b.row1, a.row1.y)), timesWide(b.row2, a.row1.z));
  m.row2 = addWide(addWide(timesWide(b.row0, a.row2.x), timesWide(b.row1, a.row2.y)), timesWide(b.row2, a.row2.z));
  return m;
}

WIDE Lanes3 columnWide(WideMatrix m, int i) {
  Lanes3 c;
  c.x = i == 0 ? m.row0.x : (i == 1 ? m.row0.y : m.row0.z);
  c.y = i == 0 ? m.row1.x : (i == 1 ? m.row1.y : m.row1.z);
  c.z = i == 0 ? m.row2.x : (i == 1 ? m.row2.y : m.row2.z);
  return c;
}

WIDE Lanes3 solve3Wide(WideMatrix m, Lanes3 b) {
  const Lanes3 c0 = columnWide(m, 0), c1 = columnWide(m, 1), c2 = columnWide(m, 2);
  const Lanes det = dotWide(c0, crossWide(c1, c2));
  const Lanes inverse = pick(fabs(det) > BTGPU_EPSILON, 1.0f / det, (Lanes)0.0f);
  Lanes3 x;
  x.x = dotWide(b, crossWide(c1, c2)) * inverse;
  x.y = dotWide(c0, crossWide(b, c2)) * inverse;
  x.z = dotWide(c0, crossWide(c1, b)) * inverse;
  return x;
}

WIDE Lanes3 gyroscopicChangeImplicitWide(WideMatrix inertia, Lanes3 w, float timeStep) {
  const Lanes3 momentum = mulMatrixWide(inertia, w);
  const WideMatrix a = productWide(skewWide(w), inertia), b = skewWide(momentum);
  const Lanes step = (Lanes)timeStep;
  WideMatrix jacobian;
  jacobian.row0 = addWide(inertia.row0, timesWide(subtractWide(a.row0, b.row0), step));
  jacobian.row1 = addWide(inertia.row1, timesWide(subtractWide(a.row1, b.row1), step));
  jacobian.row2 = addWide(inertia.row2, timesWide(subtractWide(a.row2, b.row2), step));
  const Lanes3 x = solve3Wide(jacobian, timesWide(crossWide(w, momentum), step));
  Lanes3 change;
  change.x = -x.x;
  change.y = -x.y;
  change.z = -x.z;
  return change;
}

// gyroscopicChange of bodies that have BODY_GYRO_IMPLICIT_BODY set and no other such flag.
WIDE Lanes3 gyroscopicChangeInBodyWide(WideMatrix orientation, Lanes3 inverseInertiaLocal, Lanes3 w, float timeStep) {
  const Lanes3 d = inverseInertiaLocal;
  const Lanes zero = (Lanes)0.0f;
  WideMatrix inertia;
  inertia.row0.y = inertia.row0.z = inertia.row1.x = inertia.row1.z = inertia.row2.x = inertia.row2.y = zero;
  inertia.row0.x = pick(d.x != 0.0f, 1.0f / d.x, zero);
  inertia.row1.y = pick(d.y != 0.0f, 1.0f / d.y, zero);
  inertia.row2.z = pick(d.z != 0.0f, 1.0f / d.z, zero);
  const Lanes3 inBody = gyroscopicChangeImplicitWide(inertia, mulTransposedWide(orientation, w), timeStep);
  return addWide(zeroWide(), mulMatrixWide(orientation, inBody));
}

// dampingFactor of each lane, and of what `last` holds none.
WIDE Lanes dampingFactorWide(Lanes damping, float timeStep, DampingFactor* last) {
  if (anyLane((damping != last->damping) & (damping != 0.0f))) {
    float each[BTGPU_WIDE];
    vstore16(damping, 0, each);
    for (int lane = 0; lane < BTGPU_WIDE; ++lane) {
      each[lane] = each[lane] != 0.0f ? dampingFactor(each[lane], timeStep, last) : 1.0f;
    }
    return vload16(0, each);
  }
  return pick(damping != 0.0f, (Lanes)last->factor, (Lanes)1.0f);
}

#endif
