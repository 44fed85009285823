// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/convex_buckets.h"
#include "../lib/convex_clip.h"
#include "../lib/contact_threshold.h"
#include "../lib/kernel.h"
#include "../shared/body.h"

#define PAIRS_AHEAD 4u  // that memory is asked for before it is needed

// Contact candidates of the convex pairs near each other; nearPairs[] lists their positions among the convex pairs.
KERNEL clipConvexFaces(CHECKS __global const StepCounters* counters, uint pairCapacity, __global const uint* nearCount,
                       __global const uint* nearPairs, __global const uint* bucketFirst, __global const uint* items,
                       __global const Pair* pairs, __global const BodyInfo* infos, __global const Shape* shapes,
                       __global const BodyPose* poses, __global const Manifold* oldManifolds,
                       __global const float4* hullVertices, __global const HullFace* hullFaces,
                       __global const uint* hullCorners, __global const ClosestFeatures* closest,
                       __global RawContacts* contacts) {
  RETURN_ON_OVERFLOW(counters);
  const Hulls hulls = hullsOf(hullVertices, hullFaces, hullCorners, 0);
  FOR_EACH(n, itemCount(pairCapacity, nearCount)) {
#ifdef BTGPU_SHAPE_CPU
    if (n + PAIRS_AHEAD < n_end) {
      const uint next = AT(items, bucketFirst[BUCKET_FIRST_CONVEX] + AT(nearPairs, n + PAIRS_AHEAD));
      const uint old = AT(pairs, next).oldManifold;
      prefetchSoon(&AT(closest, AT(nearPairs, n + PAIRS_AHEAD)), sizeof(ClosestFeatures));
      if (old != NO_INDEX) prefetchSoon(&AT(oldManifolds, old), 32);
      prefetchToWrite(&AT(contacts, next), sizeof(RawContacts));
    }
#endif
    const uint k = AT(nearPairs, n);
    const uint i = AT(items, bucketFirst[BUCKET_FIRST_CONVEX] + k);
    const Pair pair = AT(pairs, i);
    if (pair.bucket < FIRST_BUCKET || pair.bucket > LAST_BUCKET) continue;
    const Shape a = AT(shapes, AT(infos, pair.bodyA).shapeIndex), b = AT(shapes, AT(infos, pair.bodyB).shapeIndex);
    const BodyPose poseA = AT(poses, pair.bodyA), poseB = AT(poses, pair.bodyB);
    const Matrix3 ra = matrixFromQuaternion(poseA.orientation);
    const CorePair cores =
        corePairOf(a, b, ra, matrixFromQuaternion(poseB.orientation), poseB.position - poseA.position);
    const float threshold = contactThreshold(WITH_CHECKS pair, infos, shapes, oldManifolds);
    RawContacts raw = noContacts();
    raw.axis = AT(contacts, i).axis;
    ASSERT_FLOATS(isUnit(AT(closest, k).normal), AT(closest, k).normal.x, AT(closest, k).normal.w);
    collideConvex(cores, hulls, AT(closest, k), ra, threshold, &raw);
    ASSERT(raw.count >= 0 && raw.count <= RAW_POINTS, raw.count, i);
    AT(contacts, i) = raw;
  }
}
