// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The persistent manifold: candidates are reduced to four, matched with last step's points by their anchor on A,
// and points that drifted apart are dropped, with the rules of Bullet's btPersistentManifold. Accumulated
// impulses live on in the points, which is what warm starting feeds on.
#ifndef BTGPU_LIB_MANIFOLD_H
#define BTGPU_LIB_MANIFOLD_H
#include "../shared/body.h"
#include "../shared/contact.h"
#include "vec.h"

BTGPU_BEGIN

// Where a manifold is while it is worked on. On the GPU shape that is local memory: it is too long for a lane's registers.
#if defined(__OPENCL_C_VERSION__) && !defined(BTGPU_SHAPE_CPU)
#define NEAR __local
#else
#define NEAR
#endif

#define MAX_FRICTION 10.0f  // Bullet clamps combined friction to this

// Arrays in private memory are only indexed by loops of a fixed length: what is indexed otherwise can't be in registers,
// and on a GPU goes through memory.

// Reduces the candidates to at most four: the deepest, the one farthest from it, and on either side of the line
// through these two the one that spans the largest triangle.
LIB void reduceContacts(REF(RawContacts) raw) {
  if (raw->count <= MANIFOLD_POINTS) return;
  int deepest = 0;
  float4 p0 = raw->points[0];
  UNROLL
  for (int i = 1; i < RAW_POINTS; ++i) {
    if (i < raw->count && raw->points[i].w < p0.w) {
      p0 = raw->points[i];
      deepest = i;
    }
  }
  int farthest = deepest;
  float4 p1 = p0;
  float farthestSqr = -1.0f;
  UNROLL
  for (int i = 0; i < RAW_POINTS; ++i) {
    const float distanceSqr = lengthSqr3(raw->points[i] - p0);
    if (i < raw->count && i != deepest && distanceSqr > farthestSqr) {
      farthestSqr = distanceSqr;
      farthest = i;
      p1 = raw->points[i];
    }
  }
  const float4 side = cross3(raw->normal, p1 - p0);
  float4 p2 = p0, p3 = p0;
  float leftArea = 0.0f, rightArea = 0.0f;
  UNROLL
  for (int i = 0; i < RAW_POINTS; ++i) {
    const float area = dot3(side, raw->points[i] - p0);
    if (i >= raw->count || i == deepest || i == farthest) continue;
    if (area > leftArea) {
      leftArea = area;
      p2 = raw->points[i];
    }
    if (area < rightArea) {
      rightArea = area;
      p3 = raw->points[i];
    }
  }
  const int left = leftArea > 0.0f, right = rightArea < 0.0f;
  raw->points[0] = p0;
  raw->points[1] = p1;
  raw->points[2] = left ? p2 : p3;
  raw->points[3] = p3;
  raw->count = 2 + left + right;
}

// Puts the deepest of at most four candidates last: what is added to a full manifold replaces another point by the depths
// of the last step, and so may push out what was added before it.
LIB void deepestLast(REF(RawContacts) raw) {
  int deepest = 0;
  float4 p = raw->points[0], last = raw->points[0];
  UNROLL
  for (int i = 1; i < MANIFOLD_POINTS; ++i) {
    if (i >= raw->count) continue;
    last = raw->points[i];
    if (!(last.w <= p.w)) continue;
    p = last;
    deepest = i;
  }
  UNROLL
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (i == deepest) raw->points[i] = last;
    if (i == raw->count - 1) raw->points[i] = p;
  }
}

LIB float combineFriction(float product) { return clamp(product, -MAX_FRICTION, MAX_FRICTION); }

// Bullet's default combination of two materials: friction, restitution, rolling, spinning.
LIB float4 combineMaterials(BodyMaterial a, BodyMaterial b) {
  return F4(combineFriction(a.friction * b.friction), a.restitution * b.restitution,
            combineFriction(a.rollingFriction * b.friction + b.rollingFriction * a.friction),
            combineFriction(a.spinningFriction * b.friction + b.spinningFriction * a.friction));
}

// A new point from candidate `point` (RawContacts.points); rotations are the bodies' body-to-world matrices.
LIB ContactPoint makePoint(float4 normalOnB, float4 point, Matrix3 ra, Matrix3 rb, float4 bFromA) {
  ContactPoint p;
  const float4 onA = xyz(point) + normalOnB * point.w;
  p.localPointA = withW(mulTransposed(ra, onA), point.w);
  p.localPointB = mulTransposed(rb, xyz(point) - xyz(bFromA));
  p.normalWorldOnB = xyz(normalOnB);
  float4 t1, t2;
  planeSpace(normalOnB, &t1, &t2);
  p.lateralFrictionDir1 = t1;
  p.lateralFrictionDir2 = t2;
  p.combined = F4(0.0f, 0.0f, 0.0f, 0.0f);
  p.combinedStiffness = p.combinedDamping = 0.0f;
  p.lifeTime = 0;
  p.flags = 0;
  return p;
}

// Index of the manifold's point whose anchor on A is nearest to `p`'s, nearer than the threshold; or -1.
LIB int findMatch(NEAR const Manifold* m, float4 localPointA) {
  float nearestSqr = m->breakingThreshold * m->breakingThreshold;
  int nearest = -1;
  UNROLL
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    const float distanceSqr = lengthSqr3(m->points[i].localPointA - localPointA);
    if (i < m->pointCount && distanceSqr < nearestSqr) {
      nearestSqr = distanceSqr;
      nearest = i;
    }
  }
  return nearest;
}

// Squared area measure of the quadrilateral p, a, b, c: its diagonals' cross product.
LIB float diagonalArea(float4 p, float4 a, float4 b, float4 c) { return lengthSqr3(cross3(p - a, c - b)); }

// Which of four points a fifth should replace: never the deepest, else the one whose loss leaves most area.
LIB int pointToReplace(NEAR const Manifold* m, const ContactPoint* p) {
  int deepest = -1;
  float depth = p->localPointA.w;
  UNROLL
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (m->points[i].localPointA.w < depth) {
      depth = m->points[i].localPointA.w;
      deepest = i;
    }
  }
  const float4 q = p->localPointA;
  const float4 q0 = m->points[0].localPointA, q1 = m->points[1].localPointA;
  const float4 q2 = m->points[2].localPointA, q3 = m->points[3].localPointA;
  float area[MANIFOLD_POINTS];
  area[0] = diagonalArea(q, q1, q2, q3);
  area[1] = diagonalArea(q, q0, q2, q3);
  area[2] = diagonalArea(q, q0, q1, q3);
  area[3] = diagonalArea(q, q0, q1, q2);
  int best = -1;
  float bestArea = 0.0f;
  UNROLL
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (i == deepest || (best >= 0 && !(area[i] > bestArea))) continue;
    best = i;
    bestArea = area[i];
  }
  return best;
}

// Notes in each point which one it is, before points come and go.
LIB void numberPoints(NEAR Manifold* m) {
  UNROLL
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (i >= m->pointCount) continue;
    m->points[i].flags = (m->points[i].flags & POINT_BULLET_FLAGS) | ((i + 1) << POINT_ORIGIN_SHIFT);
  }
}

// Whether the friction of a point reached its limit: then a friction anchor gives way to a new one.
LIB int slips(NEAR const ContactPoint* p) {
  const float first = p->normalWorldOnB.w, second = p->lateralFrictionDir1.w;
  const float limit = p->combined.x * p->localPointB.w;
  return first * first + second * second > limit * limit;
}

// Adds a point, keeping impulses and age of the one it matches.
LIB void addPoint(NEAR Manifold* m, ContactPoint p) {
  if (p.localPointA.w > m->breakingThreshold) return;
  const int match = findMatch(m, p.localPointA), isFull = m->pointCount == MANIFOLD_POINTS;
  const int place = match >= 0 ? match : isFull ? pointToReplace(m, &p) : m->pointCount;
  m->pointCount += match < 0 && !isFull;
  UNROLL
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (i != place) continue;
    if (match >= 0 && (p.flags & POINT_FRICTION_ANCHOR) && !slips(&m->points[i])) continue;
    if (match >= 0) {
      const ContactPoint old = m->points[i];
      p.localPointB = withW(p.localPointB, old.localPointB.w);
      p.normalWorldOnB = withW(p.normalWorldOnB, old.normalWorldOnB.w);
      p.lateralFrictionDir1 = withW(p.lateralFrictionDir1, old.lateralFrictionDir1.w);
      p.lifeTime = old.lifeTime;
      p.flags |= old.flags & POINT_ORIGIN;
    }
    m->points[i] = p;
  }
}

// Recomputes the distances for the bodies' present poses and drops points that came apart, along the normal or
// sideways. Points are visited from the last to the first and the last one fills a gap, as in Bullet.
LIB void refreshPoints(NEAR Manifold* m, Matrix3 ra, Matrix3 rb, float4 bFromA) {
  const float limit = m->breakingThreshold;
  UNROLL
  for (int i = MANIFOLD_POINTS - 1; i >= 0; --i) {
    if (i >= m->pointCount) continue;
    const ContactPoint p = m->points[i];
    const float4 between = mulMatrix(ra, p.localPointA) - mulMatrix(rb, p.localPointB) - xyz(bFromA);
    const float distance = dot3(between, p.normalWorldOnB);
    const float4 drift = between - xyz(p.normalWorldOnB) * distance;
    m->points[i].localPointA.w = distance;
    m->points[i].lifeTime += 1;
    if (distance <= limit && lengthSqr3(drift) <= limit * limit) continue;
    m->pointCount -= 1;
    UNROLL
    for (int last = i + 1; last < MANIFOLD_POINTS; ++last) {
      if (last == m->pointCount) m->points[i] = m->points[last];
    }
  }
}

BTGPU_END
#endif
