// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/bounds.h"
#include "../lib/kernel.h"
#include "../lib/manifold.h"
#include "../shared/shape.h"

// Of a pair that has none yet; without points.
static void makeManifold(NEAR Manifold* m, uint bodyA, uint bodyB, Shape a, Shape b, BodyMaterial materialA,
                         BodyMaterial materialB) {
  m->bodyA = bodyA;
  m->bodyB = bodyB;
  m->pointCount = 0;
  m->breakingThreshold = fmin(a.breakingThreshold, b.breakingThreshold);
  m->processingThreshold = fmin(materialA.contactProcessingThreshold, materialB.contactProcessingThreshold);
  m->unseen = m->axis = 0;
}

static void combine(ContactPoint* p, uint flags, BodyMaterial a, BodyMaterial b) {
  p->combined = combineMaterials(a, b);
  if (flags & BODY_FRICTION_ANCHOR) p->flags |= POINT_FRICTION_ANCHOR;
  if (!(flags & BODY_STIFFNESS)) return;
  p->combinedStiffness = 1.0f / (1.0f / a.contactStiffness + 1.0f / b.contactStiffness);
  p->combinedDamping = a.contactDamping + b.contactDamping;
  p->flags |= POINT_STIFFNESS_DAMPING;
}

// Reduces a pair's candidates to four, merges them into its manifold of the last step (`m`, if pair.oldManifold says
// that there was one), and drops the points that came apart. A pair of inactive bodies keeps its points untouched.
static void match(CHECKS uint i, Pair pair, NEAR Manifold* m, __global const StepParams* params,
                  __global const RawContacts* contacts, __global const BodyInfo* infos, __global const Shape* shapes,
                  __global const BodyPose* poses, __global const BodyMaterial* materials) {
  BodyInfo infoA = AT(infos, pair.bodyA), infoB = AT(infos, pair.bodyB);
  const int depth = max(infoA.depth, infoB.depth);
  const uint bodyA = ownerOf(infoA, pair.bodyA), bodyB = ownerOf(infoB, pair.bodyB);
  const uint children = (infoA.flags | infoB.flags) & BODY_CHILD;
  if (children) {
    infoA = AT(infos, bodyA);
    infoB = AT(infos, bodyB);
  }
  if (pair.oldManifold == NO_INDEX) {
    makeManifold(m, bodyA, bodyB, AT(shapes, infoA.shapeIndex), AT(shapes, infoB.shapeIndex), AT(materials, bodyA),
                 AT(materials, bodyB));
  }
  ASSERT(m->pointCount >= 0 && m->pointCount <= MANIFOLD_POINTS, m->pointCount, pair.oldManifold);
  // What no algorithm has ever run on has no manifold in Bullet, which stage 55 asks for.
  const int isMade = pair.oldManifold != NO_INDEX && m->bucket != BUCKET_NONE;
  m->bucket = pair.bucket == BUCKET_CARRY && !isMade ? BUCKET_NONE : pair.bucket;
  if (!(params->flags & STEP_CONTACTS_UNSEEN)) {
    m->unseen = 0;
    numberPoints(m);
  }
  if (pair.bucket == BUCKET_CARRY || pair.bucket == BUCKET_NONE || pair.bucket == BUCKET_HOST) return;
  // Bullet's sphere-sphere algorithm keeps nothing from step to step, impulses neither.
  const int persistent = pair.bucket != BUCKET_SPHERE_SPHERE;
  if (!persistent) m->pointCount = 0;
  m->unseen = 1;
  if (pair.bucket >= BUCKET_FIRST_CONVEX && pair.bucket <= BUCKET_LAST_CONVEX) m->axis = AT(contacts, i).axis;
  const int candidates = AT(contacts, i).count;
  ASSERT(candidates >= 0 && candidates <= RAW_POINTS, candidates, i);
  if (candidates == 0 && m->pointCount == 0) return;
  const BodyMaterial materialA = AT(materials, bodyA), materialB = AT(materials, bodyB);
  const BodyPose a = AT(poses, bodyA), b = AT(poses, bodyB);
  const Matrix3 ra = matrixFromQuaternion(a.orientation), rb = matrixFromQuaternion(b.orientation);
  const float4 bFromA = b.position - a.position;
  RawContacts raw = AT(contacts, i);
  ASSERT_FLOATS(raw.count == 0 || isUnit(raw.normal), raw.normal.x, raw.normal.y);
  const int isMesh = pair.bucket == BUCKET_MESH;
  reduceContacts(&raw);
  // Stock adds the deepest corner alone. Of two boxes it takes it first.
  if (pair.bucket == BUCKET_BOX_PLANE || pair.bucket == BUCKET_HULL_PLANE) deepestLast(&raw);
  // Candidates are relative to the shape that they were found for, points to its body.
  // Bullet's algorithms for compounds refresh what they hold before they go on to the shapes, each of nested ones.
  if (persistent) {
    for (int k = 0; k < depth; ++k) refreshPoints(m, ra, rb, bFromA);
  }
  const float4 shift = children ? xyz(AT(poses, pair.bodyA).position - a.position) : vec3(0.0f, 0.0f, 0.0f);
  UNROLL
  for (int k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k >= raw.count) continue;
    const float4 normal = isMesh ? raw.points[MANIFOLD_POINTS + k] : raw.normal;
    ContactPoint p = makePoint(normal, raw.points[k] + shift, ra, rb, bFromA);
    if (isMesh) p.lateralFrictionDir2.w = normal.w;
    combine(&p, infoA.flags | infoB.flags, materialA, materialB);
    addPoint(m, p);
  }
  if (persistent) refreshPoints(m, ra, rb, bFromA);
}

#ifdef BTGPU_SHAPE_CPU

// Points beyond the count are neither read nor written: most pairs have none, and a manifold with all of them is long.
static void copyManifold(const __global Manifold* from, Manifold* to) {
  to->bodyA = from->bodyA;
  to->bodyB = from->bodyB;
  to->pointCount = from->pointCount;
  to->bucket = from->bucket;
  to->breakingThreshold = from->breakingThreshold;
  to->processingThreshold = from->processingThreshold;
  to->unseen = from->unseen;
  to->axis = from->axis;
  for (int k = 0; k < min(from->pointCount, MANIFOLD_POINTS); ++k) to->points[k] = from->points[k];
}

static void store(const Manifold* m, __global Manifold* to) {
  to->bodyA = m->bodyA;
  to->bodyB = m->bodyB;
  to->pointCount = m->pointCount;
  to->bucket = m->bucket;
  to->breakingThreshold = m->breakingThreshold;
  to->processingThreshold = m->processingThreshold;
  to->unseen = m->unseen;
  to->axis = m->axis;
  for (int k = 0; k < m->pointCount; ++k) to->points[k] = m->points[k];
}

#define POINTS_AHEAD (ITEMS_AHEAD / 2)  // once it is known how many there are

static int hasCandidates(const __global Pair* pair) {
  return pair->bucket != BUCKET_NONE && pair->bucket != BUCKET_CARRY && pair->bucket != BUCKET_HOST;
}

// Manifolds are too far from each other for the CPU to guess where the next one is.
static void askForPair(const __global Pair* pair, const __global RawContacts* raw,
                       const __global Manifold* oldManifolds, const __global Manifold* to) {
  if (pair->oldManifold != NO_INDEX) prefetchSoon(&oldManifolds[pair->oldManifold], 64);
  if (hasCandidates(pair)) prefetchSoon(&raw->count, 8);
  prefetchToWrite(to, 64);
}
static void askForPoints(const __global Pair* pair, const __global RawContacts* raw,
                         const __global Manifold* oldManifolds, const __global Manifold* to) {
  const int candidates = hasCandidates(pair) ? raw->count : 0;
  const int kept = pair->oldManifold == NO_INDEX ? 0 : oldManifolds[pair->oldManifold].pointCount;
  const uint size = sizeof(ContactPoint), points = (uint)min(max(candidates, kept), MANIFOLD_POINTS);
  if (kept > 0) prefetchSoon(oldManifolds[pair->oldManifold].points, size * (uint)min(kept, MANIFOLD_POINTS));
  if (points > 0) prefetchToWrite(to->points, size * points);
  if (candidates > 0) prefetchSoon(raw, 64);
}

// One manifold a pair, in pair order.
KERNEL matchContacts(CHECKS uint pairCapacity, __global const StepCounters* counters, __global const StepParams* params,
                     __global const Pair* pairs, __global const RawContacts* contacts,
                     __global const Manifold* oldManifolds, __global const BodyInfo* infos,
                     __global const Shape* shapes, __global const BodyPose* poses,
                     __global const BodyMaterial* materials, __global Manifold* manifolds) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, itemCount(pairCapacity, &counters->pairCount)) {
    const Pair pair = AT(pairs, i);
    if (i + ITEMS_AHEAD < i_end) {
      askForPair(pairs + i + ITEMS_AHEAD, contacts + i + ITEMS_AHEAD, oldManifolds, manifolds + i + ITEMS_AHEAD);
      askForPoints(pairs + i + POINTS_AHEAD, contacts + i + POINTS_AHEAD, oldManifolds, manifolds + i + POINTS_AHEAD);
    }
    Manifold m;
    if (pair.oldManifold != NO_INDEX) copyManifold(&AT(oldManifolds, pair.oldManifold), &m);
    match(WITH_CHECKS i, pair, &m, params, contacts, infos, shapes, poses, materials);
    ASSERT(m.pointCount >= 0 && m.pointCount <= MANIFOLD_POINTS, m.pointCount, i);
    store(&m, &AT(manifolds, i));
  }
}

#else

// In words of 16 bytes.
#define POINT_WORDS ((uint)(sizeof(ContactPoint) / 16))
#define MANIFOLD_WORDS ((uint)(sizeof(Manifold) / 16))
#define HEAD_WORDS (MANIFOLD_WORDS - MANIFOLD_POINTS * POINT_WORDS)
#define ROW_WORDS (MANIFOLD_WORDS | 1)  // odd, so that lanes of a quarter warp find theirs in different banks
#define COPY_LANES 32                   // that carry a manifold; no fewer than it has words

static uint wordsOf(int pointCount) { return HEAD_WORDS + POINT_WORDS * (uint)clamp(pointCount, 0, MANIFOLD_POINTS); }

// One manifold a pair, in pair order. A tile of pairs at a time, one a lane.
KERNEL_OF(MATCH_GROUP)
matchContacts(CHECKS uint pairCapacity, __global const StepCounters* counters, __global const StepParams* params,
              __global const Pair* pairs, __global const RawContacts* contacts, __global const Manifold* oldManifolds,
              __global const BodyInfo* infos, __global const Shape* shapes, __global const BodyPose* poses,
              __global const BodyMaterial* materials, __global Manifold* manifolds) {
  __local float4 tile[MATCH_GROUP * ROW_WORDS];
  __local uint from[MATCH_GROUP], words[MATCH_GROUP];  // of each lane's manifold
  RETURN_ON_OVERFLOW(counters);
  const uint lane = get_local_id(0), count = itemCount(pairCapacity, &counters->pairCount);
  const uint word = lane % COPY_LANES;
  NEAR Manifold* mine = (NEAR Manifold*)(tile + lane * ROW_WORDS);
  for (uint first = get_group_id(0) * MATCH_GROUP; first < count; first += get_global_size(0)) {
    const uint i = first + lane;
    Pair pair;
    pair.oldManifold = NO_INDEX;
    if (i < count) pair = AT(pairs, i);
    from[lane] = pair.oldManifold;
    words[lane] = pair.oldManifold == NO_INDEX ? 0 : wordsOf(AT(oldManifolds, pair.oldManifold).pointCount);
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint row = lane / COPY_LANES; row < MATCH_GROUP; row += MATCH_GROUP / COPY_LANES) {
      if (word < words[row]) {
        tile[row * ROW_WORDS + word] = ((__global const float4*)&AT(oldManifolds, from[row]))[word];
      }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    uint used = 0;
    if (i < count) {
      match(WITH_CHECKS i, pair, mine, params, contacts, infos, shapes, poses, materials);
      ASSERT(mine->pointCount >= 0 && mine->pointCount <= MANIFOLD_POINTS, mine->pointCount, i);
      used = wordsOf(mine->pointCount);
    }
    words[lane] = used;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint row = lane / COPY_LANES; row < MATCH_GROUP; row += MATCH_GROUP / COPY_LANES) {
      if (word < words[row]) ((__global float4*)&AT(manifolds, first + row))[word] = tile[row * ROW_WORDS + word];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}

#endif
