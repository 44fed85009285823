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

#define MAX_FRICTION 10.0f  // Bullet clamps combined friction to this

// Reduces the candidates to at most four: the deepest, the one farthest from it, and on either side of the line
// through these two the one that spans the largest triangle.
LIB void reduceContacts(REF(RawContacts) raw) {
  if (raw->count <= MANIFOLD_POINTS) return;
  int deepest = 0;
  for (int i = 1; i < raw->count; ++i) {
    if (raw->points[i].w < raw->points[deepest].w) deepest = i;
  }
  const float4 p0 = raw->points[deepest];
  int farthest = deepest;
  float farthestSqr = -1.0f;
  for (int i = 0; i < raw->count; ++i) {
    const float distanceSqr = lengthSqr3(raw->points[i] - p0);
    if (i != deepest && distanceSqr > farthestSqr) {
      farthestSqr = distanceSqr;
      farthest = i;
    }
  }
  const float4 p1 = raw->points[farthest];
  const float4 side = cross3(raw->normal, p1 - p0);
  int left = -1, right = -1;
  float leftArea = 0.0f, rightArea = 0.0f;
  for (int i = 0; i < raw->count; ++i) {
    const float area = dot3(side, raw->points[i] - p0);
    if (i != deepest && i != farthest && area > leftArea) {
      leftArea = area;
      left = i;
    }
    if (i != deepest && i != farthest && area < rightArea) {
      rightArea = area;
      right = i;
    }
  }
  int count = 2;
  const float4 p2 = left >= 0 ? raw->points[left] : p0, p3 = right >= 0 ? raw->points[right] : p0;
  raw->points[0] = p0;
  raw->points[1] = p1;
  if (left >= 0) raw->points[count++] = p2;
  if (right >= 0) raw->points[count++] = p3;
  raw->count = count;
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
LIB int findMatch(const Manifold* m, float4 localPointA) {
  float nearestSqr = m->breakingThreshold * m->breakingThreshold;
  int nearest = -1;
  for (int i = 0; i < m->pointCount; ++i) {
    const float distanceSqr = lengthSqr3(m->points[i].localPointA - localPointA);
    if (distanceSqr < nearestSqr) {
      nearestSqr = distanceSqr;
      nearest = i;
    }
  }
  return nearest;
}

// Squared area measure of the quadrilateral p, a, b, c: its diagonals' cross product.
LIB float diagonalArea(float4 p, float4 a, float4 b, float4 c) { return lengthSqr3(cross3(p - a, c - b)); }

// Which of four points a fifth should replace: never the deepest, else the one whose loss leaves most area.
LIB int pointToReplace(const Manifold* m, const ContactPoint* p) {
  int deepest = -1;
  float depth = p->localPointA.w;
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
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (i != deepest && (best < 0 || area[i] > area[best])) best = i;
  }
  return best;
}

// Notes in each point which one it is, before points come and go.
LIB void numberPoints(REF(Manifold) m) {
  for (int i = 0; i < m->pointCount; ++i) {
    m->points[i].flags = (m->points[i].flags & POINT_BULLET_FLAGS) | ((i + 1) << POINT_ORIGIN_SHIFT);
  }
}

// Adds a point, keeping impulses and age of the one it matches.
LIB void addPoint(REF(Manifold) m, ContactPoint p) {
  if (p.localPointA.w > m->breakingThreshold) return;
  const int match = findMatch(m, p.localPointA);
  if (match >= 0) {
    const ContactPoint old = m->points[match];
    p.localPointB = withW(p.localPointB, old.localPointB.w);
    p.normalWorldOnB = withW(p.normalWorldOnB, old.normalWorldOnB.w);
    p.lateralFrictionDir1 = withW(p.lateralFrictionDir1, old.lateralFrictionDir1.w);
    p.lifeTime = old.lifeTime;
    p.flags |= old.flags & POINT_ORIGIN;
    m->points[match] = p;
  } else if (m->pointCount < MANIFOLD_POINTS) {
    m->points[m->pointCount] = p;
    m->pointCount += 1;
  } else {
    m->points[pointToReplace(m, &p)] = p;
  }
}

// Recomputes the distances for the bodies' present poses and drops points that came apart, along the normal or
// sideways. Points are visited from the last to the first and the last one fills a gap, as in Bullet.
LIB void refreshPoints(REF(Manifold) m, Matrix3 ra, Matrix3 rb, float4 bFromA) {
  for (int i = m->pointCount - 1; i >= 0; --i) {
    const ContactPoint p = m->points[i];
    const float4 between = mulMatrix(ra, p.localPointA) - mulMatrix(rb, p.localPointB) - xyz(bFromA);
    const float distance = dot3(between, p.normalWorldOnB);
    const float4 drift = between - xyz(p.normalWorldOnB) * distance;
    const float limit = m->breakingThreshold;
    m->points[i].localPointA.w = distance;
    m->points[i].lifeTime += 1;
    if (distance > limit || lengthSqr3(drift) > limit * limit) {
      m->pointCount -= 1;
      m->points[i] = m->points[m->pointCount];
    }
  }
}

BTGPU_END
#endif
