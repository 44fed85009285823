// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/convex_clip.h"
#include "../lib/kernel.h"
#include "../shared/body.h"

// Contact candidates of the convex pairs near each other; nearPairs[] lists their positions among the convex pairs.
KERNEL clipConvexFaces(__global const StepCounters* counters, uint pairCapacity, __global const uint* nearCount,
                       __global const uint* nearPairs, __global const uint* bucketFirst, __global const uint* items,
                       __global const Pair* pairs, __global const BodyInfo* infos, __global const Shape* shapes,
                       __global const BodyPose* poses, __global const Manifold* oldManifolds,
                       __global const float4* hullVertices, __global const HullFace* hullFaces,
                       __global const uint* hullCorners, __global const ClosestFeatures* closest,
                       __global RawContacts* contacts) {
  RETURN_ON_OVERFLOW(counters);
  Hulls hulls;
  hulls.vertices = hullVertices;
  hulls.faces = hullFaces;
  hulls.corners = hullCorners;
  hulls.edges = 0;
  FOR_EACH(n, itemCount(pairCapacity, nearCount)) {
    const uint k = nearPairs[n];
    const uint i = items[bucketFirst[BUCKET_FIRST_CONVEX] + k];
    const Pair pair = pairs[i];
    const Shape a = shapes[infos[pair.bodyA].shapeIndex], b = shapes[infos[pair.bodyB].shapeIndex];
    const BodyPose poseA = poses[pair.bodyA], poseB = poses[pair.bodyB];
    const Matrix3 ra = matrixFromQuaternion(poseA.orientation);
    const CorePair cores =
        corePairOf(a, b, ra, matrixFromQuaternion(poseB.orientation), poseB.position - poseA.position);
    float threshold = fmin(a.breakingThreshold, b.breakingThreshold);
    if (pair.oldManifold != NO_INDEX) threshold = oldManifolds[pair.oldManifold].breakingThreshold;
    RawContacts raw = noContacts();
    collideConvex(cores, hulls, closest[k], ra, threshold, &raw);
    contacts[i] = raw;
  }
}
