// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A ray and a box. A ray is a point on its way: what is around the point is put around the box instead.
#ifndef BTGPU_LIB_RAY_BOUNDS_H
#define BTGPU_LIB_RAY_BOUNDS_H
#include "../shared/body.h"
#include "vec.h"

BTGPU_BEGIN

// 1 / direction, and never infinity times zero.
LIB float4 inverseDirection(float4 d) {
  return vec3(d.x == 0.0f ? BTGPU_LARGE : 1.0f / d.x, d.y == 0.0f ? BTGPU_LARGE : 1.0f / d.y,
              d.z == 0.0f ? BTGPU_LARGE : 1.0f / d.z);
}

// The way of a box from one place to another: that of a point, to which what it meets is larger by that box. Where the
// point begins for the lower sides of that, and for the upper ones.
STRUCT(Way) { float4 fromLower, fromUpper, inverse; };

LIB Way wayOfBox(float4 from, float4 to, float4 lower, float4 upper) {
  Way way;
  way.fromLower = xyz(from) + upper;
  way.fromUpper = xyz(from) + lower;
  way.inverse = inverseDirection(to - from);
  return way;
}
LIB Way wayOfPoint(float4 from, float4 to) {
  Way way;
  way.fromLower = way.fromUpper = xyz(from);
  way.inverse = inverseDirection(to - from);
  return way;
}

// Where it enters a box, as a fraction of its length; more than `limit` if it does not before that.
LIB float enterOnWay(Aabb box, Way way, float limit) {
  const float4 a = scale3(box.lower - way.fromLower, way.inverse), b = scale3(box.upper - way.fromUpper, way.inverse);
  const float4 first = fmin(a, b), last = fmax(a, b);
  const float enter = fmax(fmax(first.x, first.y), fmax(first.z, 0.0f));
  const float leave = fmin(fmin(last.x, last.y), fmin(last.z, limit));
  return enter <= leave ? enter : INFINITY;
}

// Likewise, of a ray.
LIB float enterAabb(Aabb box, float4 from, float4 inverse, float limit) {
  Way way;
  way.fromLower = way.fromUpper = from;
  way.inverse = inverse;
  return enterOnWay(box, way, limit);
}

BTGPU_END
#endif
