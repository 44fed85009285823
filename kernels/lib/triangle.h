// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A triangle of a mesh, in the axes of the shape that it meets and from that one's position.
#ifndef BTGPU_LIB_TRIANGLE_H
#define BTGPU_LIB_TRIANGLE_H
#include "../shared/mesh.h"
#include "collide.h"
#include "vec.h"

BTGPU_BEGIN

#define SLIVER_SINE 1e-6f  // a triangle whose corners are nearer to a line than this share of its length has no plane

STRUCT(Triangle) {
  float4 a, b, c;  // w = 0
  float4 plane;    // xyz: unit normal, about which a, b, c run anticlockwise; w: where it lies along the normal
  float size;      // longest side
};

LIB float4 triangleCorner(Triangle t, int i) { return i == 0 ? t.a : (i == 1 ? t.b : t.c); }

LIB int triangleSupport(Triangle t, float4 direction) {
  const float a = dot3(t.a, direction), b = dot3(t.b, direction), c = dot3(t.c, direction);
  return c > a && c > b ? 2 : (b > a ? 1 : 0);
}

// One that has no area gets any plane that it lies in.
LIB Triangle makeTriangle(float4 a, float4 b, float4 c) {
  Triangle t;
  t.a = xyz(a);
  t.b = xyz(b);
  t.c = xyz(c);
  const float4 ab = t.b - t.a, bc = t.c - t.b, ca = t.a - t.c;
  const float abSqr = dot3(ab, ab), bcSqr = dot3(bc, bc), caSqr = dot3(ca, ca);
  const float sizeSqr = fmax(abSqr, fmax(bcSqr, caSqr));
  t.size = sqrt(sizeSqr);
  const float4 across = cross3(ab, -ca);
  const float area = length3(across);
  float4 normal = across / area;
  if (!(area > SLIVER_SINE * sizeSqr)) {
    float4 other;
    const float4 along = abSqr == sizeSqr ? ab : (bcSqr == sizeSqr ? bc : ca);
    normal = vec3(0.0f, 1.0f, 0.0f);
    if (t.size > 0.0f) planeSpace(along / t.size, &normal, &other);
  }
  t.plane = withW(normal, dot3(normal, t.a));
  return t;
}

// Nearest to the origin. Regions by their barycentric signs, corners by the sides that meet in them.
LIB float4 nearestOfTriangle(Triangle t) {
  const float4 normal = xyz(t.plane), foot = normal * t.plane.w;
  const float ofA = dot3(normal, cross3(t.b - foot, t.c - foot)), ofB = dot3(normal, cross3(t.c - foot, t.a - foot)),
              ofC = dot3(normal, cross3(t.a - foot, t.b - foot));
  if (ofA > 0.0f && ofB > 0.0f && ofC > 0.0f) return foot;
  float4 best = t.a;
  float leastSqr = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const float4 from = triangleCorner(t, k), side = triangleCorner(t, k == 2 ? 0 : k + 1) - from;
    const float lengthSqr = dot3(side, side);
    const float share = lengthSqr > 0.0f ? clamp(-dot3(from, side) / lengthSqr, 0.0f, 1.0f) : 0.0f;
    const float4 at = from + side * share;
    const float distanceSqr = dot3(at, at);
    if (distanceSqr < leastSqr) {
      leastSqr = distanceSqr;
      best = at;
    }
  }
  return best;
}

// A sphere around the origin and a triangle (SphereTriangleDetector): 1 if they are nearer than the threshold. The normal
// points to the sphere; of a centre in the triangle it is that of the plane.
LIB int collideSphereTriangle(float radius, Triangle t, float threshold, REF(float4) normal, REF(float4) onTriangle) {
  const float reach = radius + threshold;
  if (!(fabs(t.plane.w) < reach)) return 0;
  const float4 nearest = nearestOfTriangle(t);
  const float distanceSqr = dot3(nearest, nearest);
  if (!(distanceSqr < reach * reach)) return 0;
  if (distanceSqr > BTGPU_EPSILON) {
    const float distance = sqrt(distanceSqr);
    *normal = -nearest / distance;
    *onTriangle = withW(nearest, distance - radius);
  } else {
    *normal = xyz(t.plane) * (t.plane.w > 0.0f ? -1.0f : 1.0f);
    *onTriangle = withW(nearest, -radius);
  }
  return 1;
}

BTGPU_END
#endif
