// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"
#include "../lib/manifold.h"
#include "../shared/shape.h"

static ContactPoint noPoint(void) {
  ContactPoint p;
  p.localPointA = p.localPointB = p.normalWorldOnB = vec3(0.0f, 0.0f, 0.0f);
  p.lateralFrictionDir1 = p.lateralFrictionDir2 = p.combined = vec3(0.0f, 0.0f, 0.0f);
  p.combinedStiffness = p.combinedDamping = 0.0f;
  p.lifeTime = p.flags = 0;
  return p;
}

static Manifold newManifold(Pair pair, Shape a, Shape b, BodyMaterial materialA, BodyMaterial materialB) {
  Manifold m;
  m.bodyA = pair.bodyA;
  m.bodyB = pair.bodyB;
  m.pointCount = 0;
  m.breakingThreshold = fmin(a.breakingThreshold, b.breakingThreshold);
  m.processingThreshold = fmin(materialA.contactProcessingThreshold, materialB.contactProcessingThreshold);
  m.unseen = m.unused = 0;
  for (int k = 0; k < MANIFOLD_POINTS; ++k) m.points[k] = noPoint();
  return m;
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
    const BodyInfo infoA = AT(infos, pair.bodyA), infoB = AT(infos, pair.bodyB);
    const BodyMaterial materialA = AT(materials, pair.bodyA), materialB = AT(materials, pair.bodyB);
    Manifold m;
    if (pair.oldManifold != NO_INDEX) {
      m = AT(oldManifolds, pair.oldManifold);
      ASSERT(m.pointCount >= 0 && m.pointCount <= MANIFOLD_POINTS, m.pointCount, pair.oldManifold);
    } else {
      m = newManifold(pair, AT(shapes, infoA.shapeIndex), AT(shapes, infoB.shapeIndex), materialA, materialB);
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
      const BodyPose a = AT(poses, pair.bodyA), b = AT(poses, pair.bodyB);
      const Matrix3 ra = matrixFromQuaternion(a.orientation), rb = matrixFromQuaternion(b.orientation);
      const float4 bFromA = b.position - a.position;
      RawContacts raw = AT(contacts, i);
      ASSERT(raw.count >= 0 && raw.count <= RAW_POINTS, raw.count, i);
      ASSERT_FLOATS(raw.count == 0 || isUnit(raw.normal), raw.normal.x, raw.normal.y);
      reduceContacts(&raw);
      for (int k = 0; k < raw.count; ++k) {
        ContactPoint p = makePoint(raw.normal, raw.points[k], ra, rb, bFromA);
        combine(&p, infoA.flags | infoB.flags, materialA, materialB);
        addPoint(&m, p);
      }
      if (persistent) refreshPoints(&m, ra, rb, bFromA);
    }
    ASSERT(m.pointCount >= 0 && m.pointCount <= MANIFOLD_POINTS, m.pointCount, i);
    AT(manifolds, i) = m;
  }
}
