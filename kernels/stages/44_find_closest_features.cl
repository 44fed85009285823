// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs in which a hull or something curved takes part, and capsules on boxes: where they are closest. Positions count
// from the first such pair in items[]; the buckets lie side by side.
#include "../lib/closest_cores.h"
#include "../lib/convex_buckets.h"
#include "../lib/contact_threshold.h"
#include "../lib/kernel.h"
#include "../shared/body.h"
#if defined(BTGPU_SHAPE_CPU) && !defined(BTGPU_DEBUG)  // the vector code checks nothing
#include "../lib/first_look_wide.h"
#define BTGPU_FIRST_LOOK
#endif

// A hull's part of the arrays of all hulls is there.
#define ASSERT_HULL(s)                                                                                                 \
  ASSERT(((s).type != SHAPE_HULL && (s).type != SHAPE_MULTI_SPHERE && (s).type != SHAPE_SUM) ||                        \
             (uint)((s).firstVertex + (s).vertexCount) <= LENGTH(hullVertices),                                        \
         (s).firstVertex, (s).vertexCount);                                                                            \
  ASSERT((s).type != SHAPE_HULL || (uint)((s).firstFace + (s).faceCount) <= LENGTH(hullFaces), (s).firstFace,          \
         (s).faceCount);                                                                                               \
  ASSERT((s).type != SHAPE_HULL || (uint)((s).firstEdge + (s).edgeCount) <= LENGTH(hullEdges), (s).firstEdge,          \
         (s).edgeCount)

// Single work item: number of convex pairs, for the compactions that follow.
SINGLE_KERNEL countConvexPairs(__global const StepCounters* counters, __global const uint* bucketFirst,
                               __global uint* convexCount) {
  *convexCount =
      counters->overflow ? 0 : bucketFirst[BUCKET_LAST_CONVEX + 1] - bucketFirst[BUCKET_FIRST_CONVEX];
}

// Writes what was found of the pair at position k; i: its index.
static void storeClosest(CHECKS CorePair cores, Hulls hulls, Matrix3 ra, int what, ClosestFeatures found, uint k,
                         uint i, __global RawContacts* contacts, __global ClosestFeatures* closest, __global uint* near,
                         __global uint* overlap) {
  if (what == CORES_NEAR) preferFaces(cores, hulls, &found);
  AT(near, k) = what != CORES_FAR;
#ifdef BTGPU_SHAPE_CPU
  if (what != CORES_FAR) AT(closest, k) = what == CORES_OVERLAP ? wayOutOf(cores, hulls) : found;
#else
  if (what != CORES_FAR) AT(closest, k) = found;
  AT(overlap, k) = what == CORES_OVERLAP;
#endif
  AT(contacts, i).count = 0;
  AT(contacts, i).axis = what == CORES_OVERLAP ? 0 : packAxis(mulMatrix(ra, found.normal / length3(found.normal)));
}

#ifdef BTGPU_SHAPE_CPU

// Pairs that wait for GJK.
typedef struct PairBlock {
  GjkBlock gjk;
  uint positions[BTGPU_WIDE], indices[BTGPU_WIDE];
  Matrix3 ra[BTGPU_WIDE];
} PairBlock;

static void findInBlock(CHECKS PairBlock* block, Hulls hulls, __global RawContacts* contacts,
                        __global ClosestFeatures* closest, __global uint* near, __global uint* overlap) {
  closestWide(&block->gjk, hulls);
  for (int l = 0; l < block->gjk.count; ++l) {
    storeClosest(WITH_CHECKS block->gjk.pairs[l], hulls, block->ra[l], block->gjk.what[l], block->gjk.found[l],
                 block->positions[l], block->indices[l], contacts, closest, near, overlap);
  }
  block->gjk.count = 0;
}

#endif

#ifdef BTGPU_FIRST_LOOK

// Stores what there is to store of the pairs that are far apart along the axis that they begin with, of `count` at the
// positions from k on, which are those of items[]. Bits of the result: which ones.
// `behind`: how many more follow, whose memory is asked for.
static uint findFarPairs(uint k, uint count, uint behind, __global const uint* items, __global const Pair* pairs,
                         __global const BodyInfo* infos, __global const Shape* shapes, __global const BodyPose* poses,
                         __global const Manifold* oldManifolds, Hulls hulls, __global RawContacts* contacts,
                         __global uint* near) {
  FirstLook look;
  for (uint l = 0; l < min((uint)BTGPU_WIDE, behind); ++l) {
    const uint i = items[BTGPU_WIDE + l], old = pairs[i].oldManifold;
    if (old != NO_INDEX) prefetchSoon(&oldManifolds[old], 64);
    prefetchSoon(&contacts[i].count, 8);
  }
  for (uint l = 0; l < BTGPU_WIDE; ++l) {
    const Pair pair = pairs[items[l < count ? l : 0]];
    look.bodiesA[l] = pair.bodyA;
    look.bodiesB[l] = pair.bodyB;
    if (pair.oldManifold == NO_INDEX || oldManifolds[pair.oldManifold].pointCount == 0) continue;
    prefetchSoon(&oldManifolds[pair.oldManifold].points[0].normalWorldOnB, 16);
  }
  for (uint l = 0; l < BTGPU_WIDE; ++l) {
    const Pair pair = pairs[items[l < count ? l : 0]];
    const Shape a = shapes[infos[pair.bodyA].shapeIndex], b = shapes[infos[pair.bodyB].shapeIndex];
    addFirstLook(&look, (int)l, a, b, contactThreshold(pair, infos, shapes, oldManifolds));
    look.starts[l] = START_CENTRES;
    setLane(look.axes, (int)l, vec3(0.0f, 0.0f, 0.0f));
    if (l >= count) look.lanes[l] = 0;
    if (pair.oldManifold == NO_INDEX) continue;
    __global const Manifold* old = &oldManifolds[pair.oldManifold];
    if (old->pointCount > 0) {
      look.starts[l] = START_CONTACT;
      setLane(look.axes, (int)l, old->points[0].normalWorldOnB);
    } else if (old->axis != 0) {
      look.starts[l] = START_APART;
      setLane(look.axes, (int)l, unpackAxis(old->axis));
    }
  }
  lookFirst(&look, hulls, poses);
  uint far = 0;
  for (uint l = 0; l < count; ++l) {
    if (!look.isFar[l]) continue;
    far |= 1u << l;
    near[k + l] = 0;
    contacts[items[l]].count = 0;
    contacts[items[l]].axis = look.packed[l];
  }
  return far;
}

#endif

// Begins with the normal of the last step, or with the axis that the two were apart along. Of the pair at position k:
// near[k] is 1 where a contact is possible, overlap[k] where the cores overlap and findWaysOut has to find the axis; on the
// CPU shape, where no lane waits for another, it is found at once.
// Clears the pair's candidates, and says in their `axis` where to begin in the next step.
KERNEL findClosestFeatures(CHECKS __global const StepCounters* counters, __global const uint* bucketFirst,
                           __global const uint* items, __global const Pair* pairs, __global const BodyInfo* infos,
                           __global const Shape* shapes, __global const BodyPose* poses,
                           __global const Manifold* oldManifolds, __global const float4* hullVertices,
                           __global const HullFace* hullFaces, __global const uint* hullCorners,
                           __global const HullEdge* hullEdges, __global RawContacts* contacts,
                           __global ClosestFeatures* closest, __global uint* near, __global uint* overlap) {
  RETURN_ON_OVERFLOW(counters);
  const Hulls hulls = hullsOf(hullVertices, hullFaces, hullCorners, hullEdges);
  const uint first = bucketFirst[FIRST_BUCKET], before = first - bucketFirst[BUCKET_FIRST_CONVEX];
  ASSERT(first <= bucketFirst[LAST_BUCKET + 1], first, bucketFirst[LAST_BUCKET + 1]);
#ifdef BTGPU_SHAPE_CPU
  PairBlock block;
  block.gjk.count = 0;
#endif
#ifdef BTGPU_FIRST_LOOK
  uint looked = NO_INDEX, far = 0;  // BTGPU_WIDE pairs from `looked` on; bits: which ones are settled
#endif
  FOR_EACH(n, bucketFirst[LAST_BUCKET + 1] - first) {
    const uint k = before + n, i = AT(items, first + n);
#ifdef BTGPU_FIRST_LOOK
    if (looked == NO_INDEX || n - looked == BTGPU_WIDE) {
      looked = n;
      const uint count = min((uint)BTGPU_WIDE, n_end - n);
      far = findFarPairs(k, count, n_end - n - count, items + first + n, pairs, infos, shapes, poses, oldManifolds,
                         hulls, contacts, near);
    }
    if (far >> (n - looked) & 1u) continue;
#endif
    const Pair pair = AT(pairs, i);
    const Shape a = AT(shapes, AT(infos, pair.bodyA).shapeIndex), b = AT(shapes, AT(infos, pair.bodyB).shapeIndex);
    ASSERT_HULL(a);
    ASSERT_HULL(b);
    const BodyPose poseA = AT(poses, pair.bodyA), poseB = AT(poses, pair.bodyB);
    const Matrix3 ra = matrixFromQuaternion(poseA.orientation);
    const CorePair cores =
        corePairOf(a, b, ra, matrixFromQuaternion(poseB.orientation), poseB.position - poseA.position);
    const float threshold = contactThreshold(WITH_CHECKS pair, infos, shapes, oldManifolds);
    float4 start = cores.offset;
    if (pair.oldManifold != NO_INDEX) {
      if (AT(oldManifolds, pair.oldManifold).pointCount > 0) {
        start = -mulTransposed(ra, AT(oldManifolds, pair.oldManifold).points[0].normalWorldOnB);
      } else if (AT(oldManifolds, pair.oldManifold).axis != 0) {
        start = mulTransposed(ra, unpackAxis(AT(oldManifolds, pair.oldManifold).axis));
      }
    }
    ClosestFeatures found = nothingFound();
    const float limit = cores.a.margin + cores.b.margin + threshold;
#ifdef BTGPU_SHAPE_CPU
    ClosestBegun begun;
    const int what = beginCores(cores, hulls, start, limit, &begun, &found);
    if (what == CORES_OPEN) {
      const int l = block.gjk.count;
      block.positions[l] = k;
      block.indices[l] = i;
      block.ra[l] = ra;
      addToBlock(&block.gjk, &cores, limit, begun);
      if (block.gjk.count == BTGPU_WIDE) findInBlock(WITH_CHECKS &block, hulls, contacts, closest, near, overlap);
      continue;
    }
#else
    const int what = closestCores(cores, hulls, start, limit, &found);
#endif
    storeClosest(WITH_CHECKS cores, hulls, ra, what, found, k, i, contacts, closest, near, overlap);
  }
#ifdef BTGPU_SHAPE_CPU
  if (block.gjk.count > 0) findInBlock(WITH_CHECKS &block, hulls, contacts, closest, near, overlap);
#endif
}

// GPU shape: the axes of the pairs whose cores overlap; overlapping[] lists their positions.
KERNEL findWaysOut(CHECKS __global const StepCounters* counters, uint pairCapacity, __global const uint* overlapCount,
                   __global const uint* overlapping, __global const uint* bucketFirst, __global const uint* items,
                   __global const Pair* pairs, __global const BodyInfo* infos, __global const Shape* shapes,
                   __global const BodyPose* poses, __global const float4* hullVertices,
                   __global const HullFace* hullFaces, __global const uint* hullCorners,
                   __global const HullEdge* hullEdges, __global ClosestFeatures* closest) {
  RETURN_ON_OVERFLOW(counters);
  const Hulls hulls = hullsOf(hullVertices, hullFaces, hullCorners, hullEdges);
  FOR_EACH(n, itemCount(pairCapacity, overlapCount)) {
    const uint k = AT(overlapping, n);
    const Pair pair = AT(pairs, AT(items, bucketFirst[BUCKET_FIRST_CONVEX] + k));
    if (pair.bucket < FIRST_BUCKET || pair.bucket > LAST_BUCKET) continue;
    const BodyPose a = AT(poses, pair.bodyA), b = AT(poses, pair.bodyB);
    const CorePair cores =
        corePairOf(AT(shapes, AT(infos, pair.bodyA).shapeIndex), AT(shapes, AT(infos, pair.bodyB).shapeIndex),
                   matrixFromQuaternion(a.orientation), matrixFromQuaternion(b.orientation), b.position - a.position);
    AT(closest, k) = wayOutOf(cores, hulls);
  }
}
