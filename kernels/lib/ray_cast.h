// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A ray against one shape, with Bullet's answers. Against a convex shape Bullet advances a point along the ray by
// support planes until the nearest point of a simplex is near enough (btSubsimplexConvexCast), which in its float build
// is 0.01 length units: hits lie that far before the surface, and rays that pass that near hit. So the fraction is
// Bullet's only if the steps are, with the simplex's points left where the ray was when they were found, and the
// limits at which Bullet gives up.
#ifndef BTGPU_LIB_RAY_CAST_H
#define BTGPU_LIB_RAY_CAST_H
#include "ray_mesh.h"

BTGPU_BEGIN

// Bullet's limits, of its float build.
#define CAST_NEAR_SQR 1e-4f     // MAX_CONVEX_CAST_EPSILON: squared distance at which the surface counts as reached
#define CAST_SAME_SQR 1e-4f     // VORONOI_DEFAULT_EQUAL_VERTEX_THRESHOLD: squared distance of points that are one
#define CAST_FLAT_VOLUME 1e-4f  // of a tetrahedron, times 6: flatter ones end the cast
#define CAST_ITERATIONS 32      // MAX_CONVEX_CAST_ITERATIONS

// ---- btVoronoiSimplexSolver: the point of a simplex nearest to the origin
//
// Which of these cases holds is often a matter of the last bit: a ray and the points of a sphere lie in one plane, and
// so do all of a simplex on a face. What comes of it may be 0.01 apart. So every number here is Bullet's to the bit, by
// the same operations in the same order on the same world coordinates.

// Points of the ray, where they were when each was found, less points of the shape.
STRUCT(CastSimplex) {
  float4 points[4], ofRay[4], ofShape[4];
  float4 last;  // of points[] that was added
  int count;
};

STRUCT(Nearest) {
  float4 point;
  float4 shares;  // of up to four points
  int used;       // bits of the points that have one
};

LIB Nearest nearestOf(float4 point, float a, float b, float c, int used) {
  Nearest n;
  n.point = point;
  n.shares = F4(a, b, c, 0.0f);
  n.used = used;
  return n;
}

LIB Nearest nearestOfTwo(float4 a, float4 b) {
  const float4 ab = b - a;
  float along = dot3(ab, -a);
  if (!(along > 0.0f)) return nearestOf(a, 1.0f, 0.0f, 0.0f, 1);
  const float lengthSqr = dot3(ab, ab);
  if (!(along < lengthSqr)) return nearestOf(b, 0.0f, 1.0f, 0.0f, 2);
  along /= lengthSqr;
  return nearestOf(a + ab * along, 1.0f - along, along, 0.0f, 3);
}

LIB Nearest nearestOfThree(float4 a, float4 b, float4 c) {
  const float4 ab = b - a, ac = c - a;
  const float d1 = dot3(ab, -a), d2 = dot3(ac, -a);
  if (d1 <= 0.0f && d2 <= 0.0f) return nearestOf(a, 1.0f, 0.0f, 0.0f, 1);
  const float d3 = dot3(ab, -b), d4 = dot3(ac, -b);
  if (d3 >= 0.0f && d4 <= d3) return nearestOf(b, 0.0f, 1.0f, 0.0f, 2);
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) {
    const float v = d1 / (d1 - d3);
    return nearestOf(a + ab * v, 1.0f - v, v, 0.0f, 3);
  }
  const float d5 = dot3(ab, -c), d6 = dot3(ac, -c);
  if (d6 >= 0.0f && d5 <= d6) return nearestOf(c, 0.0f, 0.0f, 1.0f, 4);
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) {
    const float w = d2 / (d2 - d6);
    return nearestOf(a + ac * w, 1.0f - w, 0.0f, w, 5);
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0.0f && d4 - d3 >= 0.0f && d5 - d6 >= 0.0f) {
    const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return nearestOf(b + (c - b) * w, 0.0f, 1.0f - w, w, 6);
  }
  const float share = 1.0f / (va + vb + vc), v = vb * share, w = vc * share;
  return nearestOf(a + ab * v + ac * w, 1.0f - v - w, v, w, 7);
}

// 1 if the origin lies on the other side of the plane a, b, c than d; -1 if the four are flat.
LIB int isOutside(float4 a, float4 b, float4 c, float4 d) {
  const float4 normal = cross3(b - a, c - a);
  const float ofOrigin = dot3(-a, normal), ofD = dot3(d - a, normal);
  if (ofD * ofD < CAST_FLAT_VOLUME * CAST_FLAT_VOLUME) return -1;
  return ofOrigin * ofD < 0.0f;
}

// used = 0: the origin is inside, or the four are flat.
LIB Nearest nearestOfFour(float4 a, float4 b, float4 c, float4 d) {
  Nearest best = nearestOf(a, 0.0f, 0.0f, 0.0f, 0);
  const int abc = isOutside(a, b, c, d), acd = isOutside(a, c, d, b);
  const int adb = isOutside(a, d, b, c), bdc = isOutside(b, d, c, a);
  if (abc < 0 || acd < 0 || adb < 0 || bdc < 0) return best;
  float bestSqr = INFINITY;
  if (abc) {
    best = nearestOfThree(a, b, c);
    bestSqr = lengthSqr3(best.point);
  }
  if (acd) {
    const Nearest n = nearestOfThree(a, c, d);
    if (lengthSqr3(n.point) < bestSqr) {
      bestSqr = lengthSqr3(n.point);
      best.point = n.point;
      best.shares = F4(n.shares.x, 0.0f, n.shares.y, n.shares.z);
      best.used = (n.used & 1) | (n.used & 6) << 1;
    }
  }
  if (adb) {
    const Nearest n = nearestOfThree(a, d, b);
    if (lengthSqr3(n.point) < bestSqr) {
      bestSqr = lengthSqr3(n.point);
      best.point = n.point;
      best.shares = F4(n.shares.x, n.shares.z, 0.0f, n.shares.y);
      best.used = (n.used & 1) | (n.used & 2) << 2 | (n.used & 4) >> 1;
    }
  }
  if (bdc) {
    const Nearest n = nearestOfThree(b, d, c);
    if (lengthSqr3(n.point) < bestSqr) {
      best.point = n.point;
      best.shares = F4(0.0f, n.shares.x, n.shares.z, n.shares.y);
      best.used = (n.used & 1) << 1 | (n.used & 2) << 2 | (n.used & 4);
    }
  }
  return best;
}

LIB float4 mixPoints(const float4* points, int count, float4 shares) {
  if (count == 2) return points[0] + (points[1] - points[0]) * shares.y;
  float4 sum = points[0] * shares.x + points[1] * shares.y + points[2] * shares.z;
  if (count == 4) sum += points[3] * shares.w;
  return sum;
}

// The nearest point, and the simplex without the points that have no share in it. 0 if there is no telling, or no
// distance: the cast ends.
LIB int nearestOfSimplex(REF(CastSimplex) s, REF(float4) nearest) {
  const int count = s->count;
  if (count == 1) {
    *nearest = s->ofRay[0] - s->ofShape[0];
    return 1;
  }
  Nearest n;
  if (count == 2) {
    n = nearestOfTwo(s->points[0], s->points[1]);
  } else if (count == 3) {
    n = nearestOfThree(s->points[0], s->points[1], s->points[2]);
  } else {
    n = nearestOfFour(s->points[0], s->points[1], s->points[2], s->points[3]);
    if (n.used == 0) return 0;
  }
  *nearest = mixPoints(s->ofRay, count, n.shares) - mixPoints(s->ofShape, count, n.shares);
  // As Bullet takes them out: the last one comes in the place of one that goes.
  for (int i = count - 1; i >= 0; --i) {
    if (n.used >> i & 1) continue;
    const int end = --s->count;
    s->points[i] = s->points[end];
    s->ofRay[i] = s->ofRay[end];
    s->ofShape[i] = s->ofShape[end];
  }
  return n.shares.x >= 0.0f && n.shares.y >= 0.0f && n.shares.z >= 0.0f && n.shares.w >= 0.0f;
}

LIB int isInSimplex(const CastSimplex* s, float4 w) {
  for (int i = 0; i < s->count; ++i) {
    if (lengthSqr3(w - s->points[i]) <= CAST_SAME_SQR) return 1;
  }
  return w.x == s->last.x && w.y == s->last.y && w.z == s->last.z;
}

// A ray against a convex shape. 1 if it hits: fraction, and the normal, of any length. Nothing is hit from inside.
LIB int castConvex(Shape shape, ItemForm form, ItemPose pose, QueryShapes q, float4 from, float4 to,
                   REF(float) fraction, REF(float4) normal) {
  CastSimplex s;
  s.count = 0;
  s.last = vec3(BTGPU_LARGE, BTGPU_LARGE, BTGPU_LARGE);
  const float4 along = to - from, origin = originOf(pose);
  float4 at = from, originNow = origin;
  float4 n = vec3(0.0f, 0.0f, 0.0f);
  float lambda = 0.0f;
  const float scale = form.scaling.x;
  float4 v = from - toWorldPoint(pose, origin, supportPoint(shape, form, q, toLocalDirection(pose, along)) * scale);
  float distanceSqr = lengthSqr3(v);
  for (int i = 0; i < CAST_ITERATIONS && distanceSqr > CAST_NEAR_SQR; ++i) {
    const float4 ofRay = at;
    const float4 ofShape =
        toWorldPoint(pose, originNow, supportPoint(shape, form, q, toLocalDirection(pose, v)) * scale);
    const float4 w = ofRay - ofShape;
    const float ahead = dot3(v, w);
    if (lambda > 1.0f) return 0;
    int advanced = 0;
    if (ahead > 0.0f) {
      const float speed = dot3(v, along);
      if (!(speed < -(BTGPU_EPSILON * BTGPU_EPSILON))) return 0;
      const float before = lambda;
      lambda -= ahead / speed;
      at = from * (1.0f - lambda) + to * lambda;
      originNow = origin * (1.0f - lambda) + origin * lambda;  // which need not be what it was
      n = v;
      advanced = lambda != before;
    }
    if (!isInSimplex(&s, w)) {
      s.points[s.count] = s.last = w;
      s.ofRay[s.count] = ofRay;
      s.ofShape[s.count] = ofShape;
      ++s.count;
      distanceSqr = nearestOfSimplex(&s, &v) ? lengthSqr3(v) : 0.0f;
    } else if (!advanced) {
      break;  // and so on until the iterations are used up
    }
  }
  *fraction = lambda;
  *normal = n;
  return dot3(n, along) < 0.0f && lambda < 1.0f;
}

// A ray against a sphere at the origin, in a double world: there Bullet's cast comes as near to the surface as that.
LIB int castSphere(float radius, float4 from, float4 to, REF(float) fraction, REF(float4) normal) {
  const float4 along = to - from;
  const float lengthSqr = lengthSqr3(along), before = -dot3(from, along) / lengthSqr;  // before: it is nearest
  const float4 nearest = from + along * before;
  const float gapSqr = radius * radius - lengthSqr3(nearest);
  if (!(gapSqr >= 0.0f) || lengthSqr3(from) <= radius * radius) return 0;
  *fraction = before - sqrt(gapSqr / lengthSqr);
  *normal = from + along * *fraction;
  return *fraction >= 0.0f && *fraction < 1.0f;
}

// A ray in a plane's own axes: of Bullet's two triangles around the foot of the ray's middle it always meets one, from
// either side. They face downwards, which the flags go by.
LIB int castPlane(float4 plane, float4 from, float4 to, uint flags, REF(float) fraction, REF(float4) normal) {
  const float a = dot3(plane, from) - plane.w, b = dot3(plane, to) - plane.w;
  if (!(a * b < 0.0f)) return 0;
  const int isFront = a < 0.0f;
  if ((flags & RAY_FILTER_BACKFACES) && !isFront) return 0;
  *fraction = a / (a - b);
  *normal = isFront || (flags & RAY_KEEP_UNFLIPPED_NORMAL) ? -xyz(plane) : xyz(plane);
  return *fraction < 1.0f;
}

// Which of the two triangles that is.
LIB int planeTriangle(float4 plane, float4 from, float4 to, float fraction) {
  float4 p, q;
  planeSpace(xyz(plane), &p, &q);
  const float4 offset = from + (to - from) * fraction - (from + to) * 0.5f;
  return dot3(offset, p) >= dot3(offset, q) ? 0 : 1;
}

// The box around a shape in its own axes that a ray has to meet to hit it: grown by the distance at which Bullet's cast
// takes the surface for reached.
LIB Aabb castBounds(Shape shape, float scale) {
  const float radius = shape.type == SHAPE_CAPSULE ? shape.margin : 0.0f;
  const float grown = 1.01f * sqrt(CAST_NEAR_SQR);
  float4 half_ = xyz(shape.extents) + vec3(radius, radius, radius);
  if (shape.type == SHAPE_SPHERE) half_ = vec3(shape.extents.x, shape.extents.x, shape.extents.x);
  if (shape.type == SHAPE_CYLINDER) {
    // Of its two extents across the axis only one is its radius, which is more than Bullet's bounds have of the other.
    const float across = shape.radius + shape.margin;
    half_ = fmax(half_, vec3(shape.variant == 0 ? 0.0f : across, shape.variant == 1 ? 0.0f : across,
                             shape.variant == 2 ? 0.0f : across));
  }
  half_ = half_ * fabs(scale) + vec3(grown, grown, grown);
  const int isCentred = shape.type != SHAPE_HULL && shape.type != SHAPE_MULTI_SPHERE;
  const float4 centre = isCentred ? vec3(0.0f, 0.0f, 0.0f) : xyz(shape.centre) * scale;
  Aabb box;
  box.lower = centre - half_;
  box.upper = centre + half_;
  return box;
}

// A ray against one shape. 1 if it is hit before `best`: then `hit` has all but the object.
LIB int castShape(Shape shape, ItemForm form, ItemPose pose, QueryShapes q, Ray ray, uint isDouble, float best,
                  REF(RayHit) hit) {
  const float4 from = toLocalDirection(pose, ray.from - originOf(pose));
  const float4 to = toLocalDirection(pose, ray.to - originOf(pose));
  float fraction = 1.0f;
  float4 normal = vec3(0.0f, 0.0f, 0.0f);
  hit->part = hit->triangle = -1;
  if (shape.type == SHAPE_PLANE) {
    if (!castPlane(shape.extents, from, to, ray.flags, &fraction, &normal) || !(fraction <= best)) return 0;
    hit->part = 0;
    hit->triangle = planeTriangle(shape.extents, from, to, fraction);
    normal = toWorldPoint(pose, vec3(0.0f, 0.0f, 0.0f), normal);
  } else if (shape.type == SHAPE_MESH) {
    fraction = best;
    if (!castMesh(q.meshes[shape.firstVertex], form, q, from, to, ray.flags, &fraction, &normal, hit)) return 0;
    normal = toWorldPoint(pose, vec3(0.0f, 0.0f, 0.0f), normal);
  } else if (isDouble) {
    // Only spheres: what Bullet comes to with other shapes there depends on bits that floats don't have.
    if (!castSphere(shape.extents.x, from, to, &fraction, &normal) || !(fraction <= best)) return 0;
    normal = normalize3(toWorldPoint(pose, vec3(0.0f, 0.0f, 0.0f), normal));
  } else {
    // Of a box Bullet's cast finds simplices that are flat to the last bit, and then says hit for some rays that pass
    // it far by: so a box is asked even then.
    if (!isBoxToRays(shape) &&
        enterAabb(castBounds(shape, form.scaling.x), from, inverseDirection(to - from), best) > best) {
      return 0;
    }
    if (!castConvex(shape, form, pose, q, xyz(ray.from), xyz(ray.to), &fraction, &normal)) return 0;
    if (!(fraction <= best)) return 0;
    normal = normalize3(normal);
  }
  hit->normal = withW(normal, fraction);
  return 1;
}

// Whether a child of a compound is asked at all.
LIB int meetsChild(CompoundChild child, Ray ray) {
  const float4 along = ray.to - ray.from;
  if (enterAabb(child.objectAabb, ray.from, inverseDirection(along), 1.0f) > 1.0f) return 0;
  const float4 from = toLocalDirection(child.pose, ray.from - originOf(child.pose));
  return enterAabb(child.childAabb, from, inverseDirection(toLocalDirection(child.pose, along)), 1.0f) <= 1.0f;
}

LIB int rayMayHit(Ray ray, BodyInfo info) {
  return mayMeet(ray.filterGroup, ray.filterMask, ray.ignored, info);
}

LIB RayHit noRayHit(void) {
  RayHit hit;
  hit.normal = F4(0.0f, 0.0f, 0.0f, 1.0f);
  hit.object = NO_INDEX;
  hit.part = hit.triangle = -1;
  hit.unused = 0;
  return hit;
}

// A hit found is better than another: nearer, or of several as near that of the first object in the world.
LIB int isBetterHit(RayHit hit, RayHit best) {
  return hit.normal.w < best.normal.w || (hit.normal.w == best.normal.w && hit.object < best.object);
}

BTGPU_END
#endif
