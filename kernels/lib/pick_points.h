// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Picks at most four of any number of contact candidates without storing them: the deepest, the one farthest from it,
// and on either side of the line through these two the one that spans the largest triangle. The candidates are shown
// three times (passes 0, 1, 2), in the same order.
#ifndef BTGPU_LIB_PICK_POINTS_H
#define BTGPU_LIB_PICK_POINTS_H
#include "../shared/contact.h"
#include "collide.h"
#include "vec.h"

BTGPU_BEGIN

#define PICK_PASSES 3

STRUCT(PointPicker) {
  int pass, count;
  float limit;    // candidates farther apart are none
#ifdef BTGPU_TRIANGLE_CORES
  float least;    // nor are those deeper than this, which are rounding: of a face seen from its side
#endif
  float slack;    // the first of those equally deep within this stays the deepest one from step to step
  float spacing;  // nearer points, seen along the normal, are one: the manifold would let one replace the other
  float4 normal;
  float4 points[4];  // w: distance; deepest, farthest, left, right
  float scores[4];
  float4 side;  // unit, across the line through the first two
};

LIB PointPicker makePicker(float4 normal, float limit, float slack, float spacing) {
  PointPicker p;
  p.pass = p.count = 0;
  p.limit = limit;
#ifdef BTGPU_TRIANGLE_CORES
  p.least = -INFINITY;
#endif
  p.slack = slack;
  p.spacing = spacing;
  p.normal = xyz(normal);
  p.side = vec3(0.0f, 0.0f, 0.0f);
  for (int k = 0; k < 4; ++k) {
    p.points[k] = vec3(0.0f, 0.0f, 0.0f);
    p.scores[k] = -1.0f;  // none yet
  }
  return p;
}

LIB void pickPoint(REF(PointPicker) p, int k, float4 point, float score) {
  p->points[k] = point;
  p->scores[k] = score;
}

// Shows one candidate, relative to any point that stays the same.
LIB void offerPoint(REF(PointPicker) p, float4 point, float distance) {
  if (!(distance < p->limit)) return;
#ifdef BTGPU_TRIANGLE_CORES
  if (distance < p->least) return;
#endif
  const float4 candidate = withW(point, distance);
  if (p->pass == 0) {
    p->count += 1;
    if (p->scores[0] < 0.0f || distance < p->points[0].w - p->slack) pickPoint(p, 0, candidate, 0.0f);
    return;
  }
  float4 offset = xyz(candidate) - xyz(p->points[0]);
  offset -= p->normal * dot3(p->normal, offset);
  if (p->pass == 1) {
    const float score = lengthSqr3(offset);
    if (score > fmax(p->scores[1], p->spacing * p->spacing)) pickPoint(p, 1, candidate, score);
    return;
  }
  const float across = dot3(p->side, offset);
  if (across > fmax(p->scores[2], p->spacing)) pickPoint(p, 2, candidate, across);
  if (-across > fmax(p->scores[3], p->spacing)) pickPoint(p, 3, candidate, -across);
}

// After each pass; 0 if there is nothing left to find.
LIB int nextPass(REF(PointPicker) p) {
  p->pass += 1;
  if (p->pass == 1) return p->count > 1;
  if (p->pass > 2 || p->scores[1] < 0.0f) return 0;
  p->side = normalize3(cross3(p->normal, p->points[1] - p->points[0]));
  return isFinite3(p->side);
}

BTGPU_END
#endif
