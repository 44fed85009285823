// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs with a cylinder, a cone or spheres of several sizes: all that is asked of a core is its point farthest along a
// direction. GJK gives the closest points of cores that are apart. Where they overlap a polytope grows inside of their
// difference (EPA) until its face nearest to the origin lies on the surface: the shortest way out of all.
#ifndef BTGPU_LIB_CURVED_H
#define BTGPU_LIB_CURVED_H
#include "convex.h"

BTGPU_BEGIN

#define CURVED_ITERATIONS 64
#define CURVED_ACCURACY 1e-6f  // of the squared distance
#define CURVED_STALLS 6        // steps in a row that may bring no nearer point
#define EPA_VERTICES 64
#define EPA_FACES 128          // a closed surface of n vertices has 2 n - 4 triangles
#define EPA_EDGES 64           // around what a new vertex sees; more than that and it is left out
#define EPA_ACCURACY 1e-5f     // of the smaller core's size: how far outside of a face there may be something
#define EPA_ROUNDING 1e-6f     // of the pair's size: no better is known in float
#define FLAT_BEATS_CURVED 1e-5f  // of the pair's size: a cap's axis stays the same from step to step
#define EPA_FLAT 1e-12f        // squared sine: flatter triangles have no normal

// A point of the difference B - A, and A's point that it came from.
STRUCT(DifferencePoint) { float4 point, onA; };

// The point of the difference that lies farthest along the direction.
LIB DifferencePoint differenceSupport(CorePair pair, Hulls hulls, float4 direction) {
  DifferencePoint p;
  p.onA = xyz(supportOfA(pair, hulls, -direction));
  p.point = xyz(supportOfB(pair, hulls, direction)) - p.onA;
  return p;
}

LIB int samePoint(float4 p, float4 q) { return p.x == q.x && p.y == q.y && p.z == q.z; }

// A slot that no vertex of the simplex uses; there are five.
LIB int freeSlot(const Simplex* s) {
  int used = 0;
  for (int n = 0; n < s->count; ++n) used |= 1 << s->a[n];
  int slot = 0;
  while (used >> slot & 1) ++slot;
  return slot;
}

LIB void putVertex(REF(Simplex) s, int slot, float4 point) {
  s->a[s->count] = s->b[s->count] = slot;
  s->points[s->count] = withW(point, 0.0f);
  s->count += 1;
}

// The beginning of closestCurved.
LIB int beginCurved(CorePair pair, Hulls hulls, float4 start, float limit, REF(DifferencePoint) first,
                    REF(ClosestFeatures) out) {
  *first = differenceSupport(pair, hulls, -start);
  out->normal = start;
  const float ahead = dot3(start, first->point);
  return ahead > 0.0f && ahead * ahead > limit * limit * lengthSqr3(start) ? CORES_FAR : CORES_OPEN;
}

// As closestFeatures.
LIB int closestCurved(CorePair pair, Hulls hulls, float4 start, float limit, REF(ClosestFeatures) out) {
  DifferencePoint slots[5];
  Simplex s;
  s.count = 0;
  if (beginCurved(pair, hulls, start, limit, &slots[0], out) == CORES_FAR) return CORES_FAR;
  putVertex(&s, 0, slots[0].point);
  s.points[0].w = 1.0f;
  float4 v = slots[0].point;
  float reachSqr = 0.0f;  // of the largest vertex met
  int stalls = 0;
  for (int n = 0; n < CURVED_ITERATIONS; ++n) {
    const float distanceSqr = lengthSqr3(v);
    reachSqr = fmax(reachSqr, lengthSqr3(s.points[s.count - 1]));
    if (!(distanceSqr > CORES_TOUCH * CORES_TOUCH * fmax(reachSqr, pair.size * pair.size))) return CORES_OVERLAP;
    Simplex next = s;
    const int slot = freeSlot(&s);
    const DifferencePoint p = differenceSupport(pair, hulls, -v);
    const float bound = dot3(v, p.point);  // the cores are at least bound / |v| apart
    if (bound > 0.0f && bound * bound > limit * limit * distanceSqr) {
      out->normal = v;
      return CORES_FAR;
    }
    int isNew = 1;
    for (int k = 0; k < s.count; ++k) isNew = isNew && !samePoint(s.points[k], p.point);
    if (!isNew || distanceSqr - bound <= CURVED_ACCURACY * distanceSqr) break;
    putVertex(&next, slot, p.point);
    float4 nearer;
    if (!nearestOnSimplex(&next, &nearer)) return CORES_OVERLAP;
    if (!(lengthSqr3(nearer) < distanceSqr) && ++stalls > CURVED_STALLS) break;
    slots[slot] = p;
    s = next;
    v = nearer;
  }
  const float distance = length3(v);
  out->normal = v;
  if (distance >= limit) return CORES_FAR;
  out->normal = withW(v / distance, distance);
  out->onA = vec3(0.0f, 0.0f, 0.0f);
  for (int n = 0; n < s.count; ++n) out->onA += slots[s.a[n]].onA * s.points[n].w;
  out->onA.w = 0.0f;
  out->onB = xyz(out->onA + v);
  return CORES_NEAR;
}

// How far the cores are apart along an axis from A to B; below zero: how far they overlap.
LIB float separationAlongAxis(CorePair pair, Hulls hulls, float4 axis) {
  return dot3(axis, supportOfB(pair, hulls, -axis)) - dot3(axis, supportOfA(pair, hulls, axis));
}

LIB void preferAxis(CorePair pair, Hulls hulls, float4 axis, float enough, REF(ClosestFeatures) c) {
  if (!(dot3(axis, c->normal) > NEARLY_FACE)) return;
  const float separation = separationAlongAxis(pair, hulls, axis);
  if (separation >= enough) c->normal = withW(axis, separation);
}

// As preferFace: caps, and the faces of boxes and hulls, are exact and steady.
LIB void preferFlat(CorePair pair, Hulls hulls, float slack, REF(ClosestFeatures) c) {
  const float enough = c->normal.w - slack;
  const float4 inB = -mulTransposed(pair.turn, c->normal);
  const int faceA = pair.a.isPolytope ? faceAlong(pair.a, hulls, c->normal) : 0;
  const int faceB = pair.b.isPolytope ? faceAlong(pair.b, hulls, inB) : 0;
  const int flatA = pair.a.isPolytope && !(IS_CURVED(pair.a) && faceA >= PATCH_LINE);
  const int flatB = pair.b.isPolytope && !(IS_CURVED(pair.b) && faceB >= PATCH_LINE);
  const float before = c->normal.w;
  if (flatA) preferAxis(pair, hulls, xyz(facePlane(pair.a, hulls, faceA)), enough, c);
  if (flatB && c->normal.w == before) {
    preferAxis(pair, hulls, -mulMatrix(pair.turn, facePlane(pair.b, hulls, faceB)), enough, c);
  }
}

// Faces: outward unit normal, w: its distance from the origin; and the vertices, anticlockwise from outside.
STRUCT(Epa) {
  DifferencePoint vertices[EPA_VERTICES];
  float4 planes[EPA_FACES];
  uint corners[EPA_FACES];  // a | b << 8 | c << 16
  int vertexCount, faceCount;
};

// A triangle too flat to have a normal closes the surface, but is never the nearest one. 0 if there is no room.
LIB int addEpaFace(REF(Epa) e, int a, int b, int c) {
  if (e->faceCount == EPA_FACES) return 0;
  const float4 p = e->vertices[a].point, u = e->vertices[b].point - p, v = e->vertices[c].point - p;
  const float4 normal = cross3(u, v);
  const float sizeSqr = lengthSqr3(normal);
  const int isFlat = !(sizeSqr > EPA_FLAT * lengthSqr3(u) * lengthSqr3(v));
  const float4 unit = normal / (isFlat ? 1.0f : sqrt(sizeSqr));
  e->planes[e->faceCount] = isFlat ? F4(0.0f, 0.0f, 0.0f, BTGPU_LARGE) : withW(unit, dot3(unit, p));
  e->corners[e->faceCount] = (uint)(a | b << 8 | c << 16);
  e->faceCount += 1;
  return 1;
}

// A first tetrahedron of four points of the difference, as large as can be. 0 if it has no volume: the cores touch in
// a plane, and `axis` (unit) is across it.
LIB int firstTetrahedron(CorePair pair, Hulls hulls, REF(Epa) e, REF(float4) axis) {
  const float small = CORES_TOUCH * pair.size;
  e->vertexCount = e->faceCount = 0;
  // The longest of three directions.
  float longest = -1.0f;
  for (int k = 0; k < 3; ++k) {
    const DifferencePoint p = differenceSupport(pair, hulls, unitVector(k)),
                          q = differenceSupport(pair, hulls, -unitVector(k));
    const float size = component(p.point - q.point, k);
    if (size <= longest) continue;
    longest = size;
    e->vertices[0] = p;
    e->vertices[1] = q;
    *axis = unitVector((k + 1) % 3);
  }
  if (!(longest > small)) return 0;
  const float4 line = normalize3(e->vertices[1].point - e->vertices[0].point);
  float4 u, v;
  planeSpace(line, &u, &v);
  float most = -1.0f;
  for (int k = 0; k < 4; ++k) {
    const DifferencePoint p = differenceSupport(pair, hulls, (k & 2 ? v : u) * (k & 1 ? -1.0f : 1.0f));
    const float size = length3(cross3(line, p.point - e->vertices[0].point));
    if (size <= most) continue;
    most = size;
    e->vertices[2] = p;
  }
  *axis = u;
  if (!(most > small)) return 0;
  const float4 normal = normalize3(cross3(line, e->vertices[2].point - e->vertices[0].point));
  *axis = normal;
  const DifferencePoint above = differenceSupport(pair, hulls, normal), below = differenceSupport(pair, hulls, -normal);
  const float up = dot3(normal, above.point - e->vertices[0].point), down = dot3(normal, e->vertices[0].point - below.point);
  if (!(fmax(up, down) > small)) return 0;
  e->vertices[3] = up >= down ? above : below;
  e->vertexCount = 4;
  const int i = up >= down ? 1 : 2, j = up >= down ? 2 : 1;  // 0, i, j anticlockwise seen from the fourth
  return addEpaFace(e, 0, j, i) && addEpaFace(e, 0, i, 3) && addEpaFace(e, i, j, 3) && addEpaFace(e, j, 0, 3);
}

LIB int nearestEpaFace(const Epa* e) {
  int best = 0;
  for (int f = 1; f < e->faceCount; ++f) {
    if (e->planes[f].w < e->planes[best].w) best = f;
  }
  return best;
}

// Adds or, where the neighbour's edge is there already, takes away an edge of the hole.
LIB int toggleEdge(int* from, int* to, int count, int a, int b) {
  for (int k = 0; k < count; ++k) {
    if (from[k] != b || to[k] != a) continue;
    from[k] = from[count - 1];
    to[k] = to[count - 1];
    return count - 1;
  }
  if (count == EPA_EDGES) return EPA_EDGES + 1;
  from[count] = a;
  to[count] = b;
  return count + 1;
}

LIB int seesFace(const Epa* e, DifferencePoint p, int f, int first, float slack) {
  return f == first || dot3(e->planes[f], p.point) - e->planes[f].w > slack;
}

// Grows the polytope by a vertex in front of face `first`. 0 if it can't.
LIB int growEpa(REF(Epa) e, DifferencePoint p, int first, float slack) {
  if (e->vertexCount == EPA_VERTICES) return 0;
  int from[EPA_EDGES + 1], to[EPA_EDGES + 1];
  int edges = 0, kept = 0;
  for (int f = 0; f < e->faceCount && edges <= EPA_EDGES; ++f) {
    if (!seesFace(e, p, f, first, slack)) continue;
    const uint corners = e->corners[f];
    const int a = (int)(corners & 255u), b = (int)(corners >> 8 & 255u), c = (int)(corners >> 16);
    edges = toggleEdge(from, to, edges, a, b);
    if (edges <= EPA_EDGES) edges = toggleEdge(from, to, edges, b, c);
    if (edges <= EPA_EDGES) edges = toggleEdge(from, to, edges, c, a);
  }
  if (edges < 3 || edges > EPA_EDGES) return 0;
  const int vertex = e->vertexCount;
  e->vertices[vertex] = p;
  e->vertexCount += 1;
  for (int f = 0; f < e->faceCount; ++f) {
    if (seesFace(e, p, f, first, slack)) continue;
    e->planes[kept] = e->planes[f];
    e->corners[kept] = e->corners[f];
    kept += 1;
  }
  e->faceCount = kept;
  for (int k = 0; k < edges; ++k) {
    if (!addEpaFace(e, from[k], to[k], vertex)) return 0;
  }
  return 1;
}

// The points of A and B that belong to the origin's foot on a face.
LIB void footOnFace(const Epa* e, uint corners, REF(ClosestFeatures) out) {
  const DifferencePoint a = e->vertices[corners & 255u], b = e->vertices[corners >> 8 & 255u],
                        c = e->vertices[corners >> 16];
  Simplex s;
  s.count = 3;
  s.points[0] = a.point;
  s.points[1] = b.point;
  s.points[2] = c.point;
  float share[4];
  nearestOnTriangle(&s, 0, 1, 2, share);
  out->onA = xyz(a.onA * share[0] + b.onA * share[1] + c.onA * share[2]);
  out->onB = xyz(out->onA + a.point * share[0] + b.point * share[1] + c.point * share[2]);
}

LIB void wayOutAlong(CorePair pair, Hulls hulls, float4 axis, REF(ClosestFeatures) out) {
  // The farther away of the two ways.
  const float forward = separationAlongAxis(pair, hulls, axis), back = separationAlongAxis(pair, hulls, -axis);
  const float4 normal = forward >= back ? axis : -axis;
  out->normal = withW(normal, fmax(forward, back));
  out->onA = xyz(supportOfA(pair, hulls, normal));
  out->onB = xyz(out->onA + normal * out->normal.w);
}

// The shortest way out of two cores that overlap or touch.
LIB ClosestFeatures shortestCurvedWayOut(CorePair pair, Hulls hulls) {
  ClosestFeatures out;
  Epa e;
  float4 axis = vec3(1.0f, 0.0f, 0.0f);
  if (!firstTetrahedron(pair, hulls, &e, &axis)) {
    wayOutAlong(pair, hulls, axis, &out);
    return out;
  }
  const float smaller = fmin(length3(pair.a.extents), length3(pair.b.extents));
  const float slack = fmax(EPA_ACCURACY * smaller, EPA_ROUNDING * pair.size);
  int best = nearestEpaFace(&e);
  float4 plane = e.planes[best], shortest = plane;
  footOnFace(&e, e.corners[best], &out);
  // How far the difference reaches along the best normal so far: no way out that was looked at is shorter.
  float reach = BTGPU_LARGE;
  for (int n = 0; n < EPA_VERTICES; ++n) {
    const DifferencePoint p = differenceSupport(pair, hulls, plane);
    const float along = dot3(plane, p.point);
    if (along < reach) {
      reach = along;
      shortest = plane;
    }
    if (!(along - plane.w > slack) || !growEpa(&e, p, best, EPA_ROUNDING * pair.size)) break;
    best = nearestEpaFace(&e);
    plane = e.planes[best];
    footOnFace(&e, e.corners[best], &out);
    if (plane.w >= reach - slack) break;
  }
  // The difference B - A reaches past the origin along the face's normal: A leaves there, and B the other way.
  out.normal = withW(-xyz(shortest), -reach);
  preferFlat(pair, hulls, FLAT_BEATS_CURVED * pair.size, &out);
  return out;
}

BTGPU_END
#endif
