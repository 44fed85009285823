// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Contacts of the primitive pairs. All work relative to A's position, so that nothing is lost far from the
// origin. A normal points from B to A; a point lies on B; a distance below zero is a penetration.
#ifndef BTGPU_LIB_COLLIDE_H
#define BTGPU_LIB_COLLIDE_H
#include "../shared/contact.h"
#include "../shared/shape.h"
#include "bounds.h"
#include "vec.h"

BTGPU_BEGIN

LIB RawContacts noContacts(void) {
  RawContacts raw;
  raw.normal = vec3(0.0f, 1.0f, 0.0f);
  for (int k = 0; k < RAW_POINTS; ++k) raw.points[k] = vec3(0.0f, 0.0f, 0.0f);
  raw.count = 0;
  raw.axis = 0;
  raw.unused[0] = raw.unused[1] = 0;
  return raw;
}

LIB void addRaw(REF(RawContacts) out, float4 pointOnB, float distance) {
  out->points[out->count] = withW(pointOnB, distance);
  out->count += 1;
}

// Two spheres. As in Bullet a new contact arises only when they touch.
LIB void collideSphereSphere(float radiusA, float radiusB, float4 bFromA, REF(RawContacts) out) {
  const float distance = length3(bFromA);
  if (distance > radiusA + radiusB) return;
  out->normal = distance > BTGPU_EPSILON ? xyz(bFromA) * (-1.0f / distance) : vec3(1.0f, 0.0f, 0.0f);
  addRaw(out, xyz(bFromA) + out->normal * radiusB, distance - radiusA - radiusB);
}

// Sphere A on plane B; a contact arises within the breaking threshold.
LIB void collideSpherePlane(float radius, float4 planeInWorld, float4 bFromA, float threshold, REF(RawContacts) out) {
  // planeInWorld: xyz = normal in world axes, w = constant along it from B's position.
  const float distance = -dot3(planeInWorld, bFromA) - planeInWorld.w - radius;
  if (distance >= threshold) return;
  out->normal = xyz(planeInWorld);
  addRaw(out, out->normal * (-radius - distance), distance);
}

// Box A on plane B: every corner within the breaking threshold, at most four of them (the lowest face's or those
// that cover it best are picked by the reduction; a thin box has eight).
LIB void collideBoxPlane(float4 halfExtents, Matrix3 rotationA, float4 planeInWorld, float4 bFromA, float threshold,
                         REF(RawContacts) out) {
  out->normal = xyz(planeInWorld);
  const float centre = -dot3(planeInWorld, bFromA) - planeInWorld.w;
  for (int i = 0; i < 8; ++i) {
    const float4 corner = vec3(i & 1 ? halfExtents.x : -halfExtents.x, i & 2 ? halfExtents.y : -halfExtents.y,
                               i & 4 ? halfExtents.z : -halfExtents.z);
    const float4 p = mulMatrix(rotationA, corner);
    const float distance = centre + dot3(out->normal, p);
    if (distance < threshold) addRaw(out, p - out->normal * distance, distance);
  }
}

// Distance from a point inside a box to its nearest face; the face's outward normal in box axes.
LIB float nearestFace(float4 point, float4 halfExtents, REF(float4) normal) {
  const float4 gap = halfExtents - abs3(point);
  int axis = gap.x <= gap.y ? 0 : 1;
  if (gap.z < component(gap, axis)) axis = 2;
  *normal = unitVector(axis) * (component(point, axis) < 0.0f ? -1.0f : 1.0f);
  return component(gap, axis);
}

// Sphere and box. Bullet's GJK works on the box shrunk by its margin, so edges and corners are rounded by the
// margin; a sphere whose centre is inside that core leaves by the nearest face.
// Returns the distance of the surfaces; normal from the box to the sphere and the point on the box, box axes.
LIB float sphereBoxDistance(float4 centre, float radius, float4 halfExtents, float margin, REF(float4) normal,
                            REF(float4) pointOnBox) {
  const float4 core = halfExtents - vec3(margin, margin, margin);
  const float4 nearest = fmax(fmin(centre, core), -core);
  const float4 offset = xyz(centre - nearest);
  const float lengthSqr = lengthSqr3(offset);
  if (lengthSqr > BTGPU_EPSILON * BTGPU_EPSILON) {
    const float length = sqrt(lengthSqr);
    *normal = offset / length;
    *pointOnBox = xyz(nearest) + *normal * margin;
    return length - margin - radius;
  }
  const float depth = nearestFace(centre, halfExtents, normal);
  *pointOnBox = xyz(centre) + *normal * depth;
  return -depth - radius;
}

// One of A, B is the sphere, the other the box; a contact arises within the breaking threshold.
LIB void collideSphereBox(int sphereIsA, Shape sphere, Shape box, Matrix3 boxRotation, float4 bFromA, float threshold,
                          REF(RawContacts) out) {
  const float4 sphereFromBox = sphereIsA ? -xyz(bFromA) : xyz(bFromA);
  float4 normal, point;
  const float distance = sphereBoxDistance(mulTransposed(boxRotation, sphereFromBox), sphere.extents.x, box.extents,
                                           box.margin, &normal, &point);
  if (distance >= threshold) return;
  normal = mulMatrix(boxRotation, normal);
  point = mulMatrix(boxRotation, point);
  out->normal = sphereIsA ? normal : -normal;
  // On B: the box's surface if B is the box, else the sphere's, found across the gap.
  addRaw(out, sphereIsA ? xyz(bFromA) + point : point + normal * distance, distance);
}

// Two segments with radii: spheres (length zero) and capsules. `u`, `v`: unit directions of A and B in world axes, `a`,
// `b` their half lengths. The parameters of the closest points are found as in Bullet (segmentsClosestPoints), which
// takes the middle of A where the segments are parallel; a contact arises within the threshold.
LIB void collideCapsules(float4 u, float a, float radiusA, float4 v, float b, float radiusB, float4 bFromA,
                         float threshold, REF(RawContacts) out) {
  const float along = dot3(u, v), ofA = dot3(u, bFromA), ofB = dot3(v, bFromA);
  const float rest = 1.0f - along * along;
  float s = rest == 0.0f ? 0.0f : clamp((ofA - ofB * along) / rest, -a, a);
  float t = s * along - ofB;
  if (t < -b || t > b) {
    t = clamp(t, -b, b);
    s = clamp(t * along + ofA, -a, a);
  }
  const float4 onA = u * s, onB = xyz(bFromA) + v * t;
  const float4 between = onB - onA;
  const float lengthSqr = lengthSqr3(between);
  const float length = sqrt(lengthSqr), distance = length - radiusA - radiusB;
  if (distance >= threshold) return;
  float4 across;
  if (lengthSqr > BTGPU_EPSILON * BTGPU_EPSILON) {
    out->normal = between * (-1.0f / length);
  } else {
    planeSpace(u, &out->normal, &across);
  }
  addRaw(out, onB + out->normal * radiusB, distance);
}

// Capsule A on plane B: both ends within the threshold, the lower one last; only that one of two so near each other
// that the manifold would let one replace the other. `u`: its direction, `halfLength` half the length of its segment.
LIB void collideCapsulePlane(float4 u, float halfLength, float radius, float4 planeInWorld, float4 bFromA,
                             float threshold, REF(RawContacts) out) {
  out->normal = xyz(planeInWorld);
  const float centre = -dot3(planeInWorld, bFromA) - planeInWorld.w - radius;
  const float slope = dot3(out->normal, u);
  const float lower = slope > 0.0f ? -halfLength : halfLength;
  for (int end = 0; end < 2; ++end) {
    const float along = end ? lower : -lower;
    const float distance = centre + slope * along;
    if (distance >= threshold || (!end && 2.0f * halfLength <= threshold)) continue;
    addRaw(out, u * along - out->normal * (radius + distance), distance);
  }
}

BTGPU_END
#endif
