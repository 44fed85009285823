// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/bounds.h"
#include "../lib/kernel.h"
#include "../lib/manifold.h"
#include "../shared/shape.h"

// Of a pair that has none yet; without points.
static Manifold newManifold(uint bodyA, uint bodyB, Shape a, Shape b, BodyMaterial materialA, BodyMaterial materialB) {
  Manifold m;
  m.bodyA = bodyA;
  m.bodyB = bodyB;
  m.pointCount = 0;
  m.breakingThreshold = fmin(a.breakingThreshold, b.breakingThreshold);
  m.processingThreshold = fmin(materialA.contactProcessingThreshold, materialB.contactProcessingThreshold);
  m.unseen = m.axis = 0;
  return m;
}

// Points beyond the count are neither read nor written: most pairs have none, and a manifold with all of them is long.
static void loadPoints(__global const Manifold* from, REF(Manifold) m) {
  UNROLL
  for (int k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < m->pointCount) m->points[k] = from->points[k];
  }
}

static Manifold loadHead(__global const Manifold* from) {
  Manifold m;
  m.bodyA = from->bodyA;
  m.bodyB = from->bodyB;
  m.pointCount = from->pointCount;
  m.breakingThreshold = from->breakingThreshold;
  m.processingThreshold = from->processingThreshold;
  m.unseen = from->unseen;
  m.axis = from->axis;
  return m;
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
  UNROLL
  for (int k = 0; k < MANIFOLD_POINTS; ++k) {
    if (k < m->pointCount) to->points[k] = m->points[k];
  }
}

static void combine(ContactPoint* p, uint flags, BodyMaterial a, BodyMaterial b) {
  p->combined = combineMaterials(a, b);
  if (!(flags & BODY_STIFFNESS)) return;
  p->combinedStiffness = 1.0f / (1.0f / a.contactStiffness + 1.0f / b.contactStiffness);
  p->combinedDamping = a.contactDamping + b.contactDamping;
  p->flags |= POINT_STIFFNESS_DAMPING;
}

// Reduces each pair's candidates to four, merges them into its manifold of the last step, and drops the points
// that came apart. One manifold a pair, in pair order. A pair of inactive bodies keeps its points untouched.
KERNEL matchContacts(CHECKS uint pairCapacity, __global const StepCounters* counters, __global const StepParams* params,
                     __global const Pair* pairs, __global const RawContacts* contacts,
                     __global const Manifold* oldManifolds, __global const BodyInfo* infos,
                     __global const Shape* shapes, __global const BodyPose* poses,
                     __global const BodyMaterial* materials, __global Manifold* manifolds) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, itemCount(pairCapacity, &counters->pairCount)) {
    const Pair pair = AT(pairs, i);
    BodyInfo infoA = AT(infos, pair.bodyA), infoB = AT(infos, pair.bodyB);
    const int depth = max(infoA.depth, infoB.depth);
    const uint bodyA = ownerOf(infoA, pair.bodyA), bodyB = ownerOf(infoB, pair.bodyB);
    const uint children = (infoA.flags | infoB.flags) & BODY_CHILD;
    if (children) {
      infoA = AT(infos, bodyA);
      infoB = AT(infos, bodyB);
    }
    Manifold m;
    if (pair.oldManifold != NO_INDEX) {
      m = loadHead(&AT(oldManifolds, pair.oldManifold));
      ASSERT(m.pointCount >= 0 && m.pointCount <= MANIFOLD_POINTS, m.pointCount, pair.oldManifold);
      loadPoints(&AT(oldManifolds, pair.oldManifold), &m);
    } else {
      m = newManifold(bodyA, bodyB, AT(shapes, infoA.shapeIndex), AT(shapes, infoB.shapeIndex), AT(materials, bodyA),
                      AT(materials, bodyB));
    }
    m.bucket = pair.bucket;
    if (!(params->flags & STEP_CONTACTS_UNSEEN)) {
      m.unseen = 0;
      numberPoints(&m);
    }
    if (pair.bucket != BUCKET_CARRY && pair.bucket != BUCKET_NONE && pair.bucket != BUCKET_HOST) {
      // Bullet's sphere-sphere algorithm keeps nothing from step to step, impulses neither.
      const int persistent = pair.bucket != BUCKET_SPHERE_SPHERE;
      if (!persistent) m.pointCount = 0;
      m.unseen = 1;
      if (pair.bucket >= BUCKET_FIRST_CONVEX && pair.bucket <= BUCKET_LAST_CONVEX) m.axis = AT(contacts, i).axis;
      const int candidates = AT(contacts, i).count;
      ASSERT(candidates >= 0 && candidates <= RAW_POINTS, candidates, i);
      if (candidates > 0 || m.pointCount > 0) {
        const BodyMaterial materialA = AT(materials, bodyA), materialB = AT(materials, bodyB);
        const BodyPose a = AT(poses, bodyA), b = AT(poses, bodyB);
        const Matrix3 ra = matrixFromQuaternion(a.orientation), rb = matrixFromQuaternion(b.orientation);
        const float4 bFromA = b.position - a.position;
        RawContacts raw = AT(contacts, i);
        ASSERT_FLOATS(raw.count == 0 || isUnit(raw.normal), raw.normal.x, raw.normal.y);
        const int isMesh = pair.bucket == BUCKET_MESH;
        reduceContacts(&raw);
        // Candidates are relative to the shape that they were found for, points to its body.
        // Bullet's algorithms for compounds refresh what they hold before they go on to the shapes, each of nested ones.
        if (persistent) {
          for (int k = 0; k < depth; ++k) refreshPoints(&m, ra, rb, bFromA);
        }
        const float4 shift = children ? xyz(AT(poses, pair.bodyA).position - a.position) : vec3(0.0f, 0.0f, 0.0f);
        UNROLL
        for (int k = 0; k < MANIFOLD_POINTS; ++k) {
          if (k >= raw.count) continue;
          const float4 normal = isMesh ? raw.points[MANIFOLD_POINTS + k] : raw.normal;
          ContactPoint p = makePoint(normal, raw.points[k] + shift, ra, rb, bFromA);
          if (isMesh) p.lateralFrictionDir2.w = normal.w;
          combine(&p, infoA.flags | infoB.flags, materialA, materialB);
          addPoint(&m, p);
        }
        if (persistent) refreshPoints(&m, ra, rb, bFromA);
      }
    }
    ASSERT(m.pointCount >= 0 && m.pointCount <= MANIFOLD_POINTS, m.pointCount, i);
    store(&m, &AT(manifolds, i));
  }
}
