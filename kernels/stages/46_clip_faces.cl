// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/box_box.h"
#include "../lib/kernel.h"

// Contact candidates of the box-box pairs that overlap.
KERNEL clipFaces(CHECKS __global const StepCounters* counters, __global const uint* bucketFirst,
                 __global const uint* items, __global const Pair* pairs, __global const BodyInfo* infos,
                 __global const Shape* shapes, __global const BodyPose* poses, __global const SeparatingAxis* axes,
                 __global RawContacts* contacts) {
  RETURN_ON_OVERFLOW(counters);
  const uint first = bucketFirst[BUCKET_BOX_BOX];
  FOR_EACH(k, bucketFirst[BUCKET_BOX_BOX + 1] - first) {
    const SeparatingAxis axis = AT(axes, k);
    ASSERT(axis.code >= -1 && axis.code <= 14, axis.code, k);
    if (axis.code < 0) continue;
    const uint i = AT(items, first + k);
    const Pair pair = AT(pairs, i);
    ASSERT_FLOATS(isUnit(axis.normal), axis.normal.x, axis.normal.w);
    const BodyPose a = AT(poses, pair.bodyA), b = AT(poses, pair.bodyB);
    const Matrix3 ra = matrixFromQuaternion(a.orientation), rb = matrixFromQuaternion(b.orientation);
    const float4 ha = AT(shapes, AT(infos, pair.bodyA).shapeIndex).extents;
    const float4 hb = AT(shapes, AT(infos, pair.bodyB).shapeIndex).extents;
    const float4 bFromA = b.position - a.position;
    RawContacts raw = noContacts();
    if (axis.code >= 6) {
      collideEdges(ha, ra, hb, rb, bFromA, axis, &raw);
    } else {
      collideFaces(ha, ra, hb, rb, bFromA, axis, &raw);
    }
    ASSERT(raw.count >= 0 && raw.count <= RAW_POINTS, raw.count, i);
    AT(contacts, i) = raw;
  }
}
