// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/box_box.h"
#include "../lib/kernel.h"

// Separating axis test of all box-box pairs. axes[] and overlap[] are indexed by position in the bucket;
// overlap[k] is 1 where no axis separates the boxes, ready for stream compaction.
KERNEL findSeparatingAxis(CHECKS __global const StepCounters* counters, __global const uint* bucketFirst,
                          __global const uint* items, __global const Pair* pairs, __global const BodyInfo* infos,
                          __global const Shape* shapes, __global const BodyPose* poses, __global RawContacts* contacts,
                          __global SeparatingAxis* axes, __global uint* overlap) {
  RETURN_ON_OVERFLOW(counters);
  const uint first = bucketFirst[BUCKET_BOX_BOX];
  ASSERT(first <= bucketFirst[BUCKET_BOX_BOX + 1], first, bucketFirst[BUCKET_BOX_BOX + 1]);
  FOR_EACH(k, bucketFirst[BUCKET_BOX_BOX + 1] - first) {
    const uint i = AT(items, first + k);
    const Pair pair = AT(pairs, i);
    const BodyPose a = AT(poses, pair.bodyA), b = AT(poses, pair.bodyB);
    const SeparatingAxis axis =
        separatingAxisBoxBox(AT(shapes, AT(infos, pair.bodyA).shapeIndex).extents, matrixFromQuaternion(a.orientation),
                             AT(shapes, AT(infos, pair.bodyB).shapeIndex).extents, matrixFromQuaternion(b.orientation),
                             b.position - a.position);
    AT(axes, k) = axis;
    AT(overlap, k) = axis.code >= 0;
    AT(contacts, i).count = 0;
  }
}

// Single work item: number of box-box pairs, for the compaction that follows.
SINGLE_KERNEL countBoxPairs(__global const StepCounters* counters, __global const uint* bucketFirst,
                            __global uint* boxPairCount) {
  *boxPairCount = counters->overflow ? 0 : bucketFirst[BUCKET_BOX_BOX + 1] - bucketFirst[BUCKET_BOX_BOX];
}
