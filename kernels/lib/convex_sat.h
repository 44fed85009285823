// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Two convex cores that overlap: the shortest way out, by the separating axis test over the faces of both and those
// pairs of edges that form a face of the difference (their arcs of normals cross: Gregorius, "The separating axis
// test between convex polyhedra").
#ifndef BTGPU_LIB_CONVEX_SAT_H
#define BTGPU_LIB_CONVEX_SAT_H
#include "convex.h"

BTGPU_BEGIN

#define ARC_SLACK 1e-4f        // arcs that miss each other by this angle are tried too; the full test decides
#define PARALLEL_EDGES 1e-4f   // sine below which two edges give no axis
#define EDGE_BEATS_FACE 1e-5f  // of the pair's size: a face's axis stays the same from step to step

// An edge in the axes of its core. Its direction is along normalB x normalA.
STRUCT(CoreEdge) { float4 from, to, direction, normalA, normalB; };

// 0 if the edge has no length.
LIB int coreEdge(Core core, Hulls hulls, int i, REF(CoreEdge) e) {
#ifdef BTGPU_TRIANGLE_CORES
  // The arc of an edge's normals is half a circle; its two halves are listed.
  if (core.isTriangle) {
    const int first = i >> 1;
    e->to = triangleCorner(core.triangle, first);
    e->from = triangleCorner(core.triangle, first == 2 ? 0 : first + 1);
    const float4 along = e->to - e->from;
    const float length = length3(along);
    if (!(length > 0.0f)) return 0;
    e->direction = along / length;
    const float4 normal = xyz(core.triangle.plane), outward = cross3(normal, e->direction);
    e->normalA = i & 1 ? outward : normal;
    e->normalB = i & 1 ? -normal : outward;
    return 1;
  }
#endif
  if (core.isHull) {
    const HullEdge edge = hulls.edges[core.firstEdge + i];
    e->from = hulls.vertices[core.firstVertex + edge.from];
    e->to = hulls.vertices[core.firstVertex + edge.to];
    e->normalA = edge.normalA;
    e->normalB = edge.normalB;
  } else {
    const int axis = i >> 2, u = (axis + 1) % 3, v = (axis + 2) % 3, atU = i & 1, atV = i >> 1 & 1;
    if (!(component(core.extents, axis) > 0.0f)) return 0;
    const int flip = atU == atV;
    const int vertex = atU << u | atV << v;
    e->from = boxVertex(core.extents, flip ? vertex | 1 << axis : vertex);
    e->to = boxVertex(core.extents, flip ? vertex : vertex | 1 << axis);
    e->normalA = unitVector(u) * (atU ? 1.0f : -1.0f);
    e->normalB = unitVector(v) * (atV ? 1.0f : -1.0f);
  }
  e->direction = normalize3(e->to - e->from);
  return 1;
}

LIB int sameSide(float p, float q) { return fmin(p, q) > ARC_SLACK || fmax(p, q) < -ARC_SLACK; }

// 1 if the arc of A's normals crosses that of B's, negated. All in the same axes.
LIB int arcsCross(CoreEdge a, CoreEdge b) {
  const float cba = -dot3(b.normalA, a.direction), dba = -dot3(b.normalB, a.direction);
  if (sameSide(cba, dba)) return 0;
  const float adc = dot3(a.normalA, b.direction), bdc = dot3(a.normalB, b.direction);
  if (sameSide(adc, bdc)) return 0;
  // Each crosses the other's great circle, at the same one of its two points with the other's.
  return (cba - dba) * (bdc - adc) > 0.0f;
}

STRUCT(WayOut) {
  float separation;
  float4 normal;     // from A to B, A's axes
  int edgeA, edgeB;  // -1: by a face
};

// Takes the axis of two edges if the cores overlap less along it than along the best one so far. The separation is
// measured over all vertices, so that an axis that is none does no harm.
LIB void tryEdges(CorePair pair, Hulls hulls, CoreEdge a, CoreEdge b, float slack, int edgeA, int edgeB,
                  REF(WayOut) best) {
  const float4 across = cross3(a.direction, b.direction);
  const float sine = length3(across);
  if (sine < PARALLEL_EDGES) return;
  const float4 outward = across * ((dot3(across, a.normalA + a.normalB) < 0.0f ? -1.0f : 1.0f) / sine);
  if (!(dot3(outward, b.from - a.from) > best->separation + slack)) return;
  const float4 normal = mulMatrix(pair.turn, outward);  // to A's axes
  const float separation =
      dot3(normal, supportOfB(pair, hulls, -normal)) - dot3(normal, supportOfA(pair, hulls, normal));
  if (!(separation > best->separation + slack)) return;
  best->separation = separation;
  best->normal = normal;
  best->edgeA = edgeA;
  best->edgeB = edgeB;
}

// Nearest points of two edges, not parallel.
LIB void nearestOnEdges(CoreEdge a, CoreEdge b, REF(ClosestFeatures) out) {
  const float4 between = b.from - a.from;
  const float along = dot3(a.direction, b.direction), rest = 1.0f - along * along;
  const float ofA = dot3(a.direction, between), ofB = dot3(b.direction, between);
  const float lengthA = length3(a.to - a.from), lengthB = length3(b.to - b.from);
  const float s = clamp((ofA - along * ofB) / rest, 0.0f, lengthA);
  const float t = clamp(s * along - ofB, 0.0f, lengthB);
  out->onA = xyz(a.from + a.direction * s);
  out->onB = xyz(b.from + b.direction * t);
}

LIB CoreEdge edgeInAxesOfB(CorePair pair, CoreEdge e) {
  e.from = mulTransposed(pair.turn, e.from - pair.offset);
  e.to = mulTransposed(pair.turn, e.to - pair.offset);
  e.direction = mulTransposed(pair.turn, e.direction);
  e.normalA = mulTransposed(pair.turn, e.normalA);
  e.normalB = mulTransposed(pair.turn, e.normalB);
  return e;
}

LIB ClosestFeatures shortestWayOut(CorePair pair, Hulls hulls) {
  WayOut best;
  best.separation = -BTGPU_LARGE;
  best.normal = vec3(1.0f, 0.0f, 0.0f);
  best.edgeA = best.edgeB = -1;
  for (int f = 0; f < pair.a.faceCount; ++f) {
    const float4 plane = facePlane(pair.a, hulls, f);
    const float separation = separationByFaceOfA(pair, hulls, plane);
    if (separation <= best.separation) continue;
    best.separation = separation;
    best.normal = xyz(plane);
  }
  int byFaceOfB = 0;
  const float faceSlack = FACE_AS_GOOD * pair.size;
  for (int f = 0; f < pair.b.faceCount; ++f) {
    const float4 plane = facePlane(pair.b, hulls, f);
    const float4 normal = mulMatrix(pair.turn, plane);
    const float separation = separationByFaceOfB(pair, hulls, normal, plane.w);
    if (separation <= best.separation + faceSlack * (byFaceOfB ? 0.0f : 1.0f)) continue;
    best.separation = separation;
    best.normal = -normal;
    byFaceOfB = 1;
  }
  float slack = EDGE_BEATS_FACE * pair.size;
  for (int i = 0; i < pair.a.edgeCount; ++i) {
    CoreEdge a, b;
    if (!coreEdge(pair.a, hulls, i, &a)) continue;
    a = edgeInAxesOfB(pair, a);
    for (int j = 0; j < pair.b.edgeCount; ++j) {
      if (pair.b.isHull) {
        // Most edges go by the first half of the test.
        const HullEdge edge = hulls.edges[pair.b.firstEdge + j];
        if (sameSide(dot3(edge.normalA, a.direction), dot3(edge.normalB, a.direction))) continue;
      }
      if (!coreEdge(pair.b, hulls, j, &b) || !arcsCross(a, b)) continue;
      tryEdges(pair, hulls, a, b, slack, i, j, &best);
      if (best.edgeA >= 0) slack = 0.0f;
    }
  }
  ClosestFeatures out;
  out.normal = withW(best.normal, best.separation);
  if (best.edgeA >= 0) {
    CoreEdge a, b;
    coreEdge(pair.a, hulls, best.edgeA, &a);
    coreEdge(pair.b, hulls, best.edgeB, &b);
    nearestOnEdges(edgeInAxesOfB(pair, a), b, &out);
    out.onA = xyz(pair.offset + mulMatrix(pair.turn, out.onA));
    out.onB = xyz(pair.offset + mulMatrix(pair.turn, out.onB));
  } else if (byFaceOfB) {
    out.onA = xyz(supportOfA(pair, hulls, best.normal));
    out.onB = xyz(out.onA + best.normal * best.separation);
  } else {
    out.onB = xyz(supportOfB(pair, hulls, -best.normal));
    out.onA = xyz(out.onB - best.normal * best.separation);
  }
  return out;
}

BTGPU_END
#endif
