// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/box_box.h"
#include "../lib/kernel.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/box_box_wide.h"
#endif

// Separating axis test of all box-box pairs. axes[] is indexed by position in the bucket.
KERNEL findSeparatingAxis(CHECKS __global const StepCounters* counters, __global const uint* bucketFirst,
                          __global const uint* items, __global const Pair* pairs, __global const BodyInfo* infos,
                          __global const Shape* shapes, __global const BodyPose* poses, __global RawContacts* contacts,
                          __global SeparatingAxis* axes) {
  RETURN_ON_OVERFLOW(counters);
  const uint first = bucketFirst[BUCKET_BOX_BOX];
  ASSERT(first <= bucketFirst[BUCKET_BOX_BOX + 1], first, bucketFirst[BUCKET_BOX_BOX + 1]);
  const uint count = bucketFirst[BUCKET_BOX_BOX + 1] - first;
  // The vector code checks nothing.
#if defined(BTGPU_SHAPE_CPU) && !defined(BTGPU_DEBUG)
  FOR_EACH(block, (count + BTGPU_WIDE - 1) / BTGPU_WIDE) {
    findAxesWide(block * BTGPU_WIDE, count, items + first, pairs, infos, shapes, poses, contacts, axes);
  }
#else
  FOR_EACH(k, count) {
    const uint i = AT(items, first + k);
    const Pair pair = AT(pairs, i);
    const BodyPose a = AT(poses, pair.bodyA), b = AT(poses, pair.bodyB);
    const SeparatingAxis axis =
        separatingAxisBoxBox(AT(shapes, AT(infos, pair.bodyA).shapeIndex).extents, matrixFromQuaternion(a.orientation),
                             AT(shapes, AT(infos, pair.bodyB).shapeIndex).extents, matrixFromQuaternion(b.orientation),
                             b.position - a.position);
    AT(axes, k) = axis;
    AT(contacts, i).count = 0;
  }
#endif
}
