// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Picks at most four of the contacts that a shape has with all triangles of a mesh: the deepest, the one farthest from
// it, the one that spans the largest triangle with these two, and the one farthest on the other side of their line. What
// touches goes before what is only near: contacts with triangles beside a shape lie farthest out. The contacts are shown
// four times, in the same order.
#ifndef BTGPU_LIB_PICK_TOUCHES_H
#define BTGPU_LIB_PICK_TOUCHES_H
#include "../shared/contact.h"
#include "../shared/mesh.h"
#include "vec.h"

BTGPU_BEGIN

#define TOUCH_PASSES 4
#define TOUCH_SLACK 1e-3f  // of the threshold: the first of those equally deep within this is the deepest
#define TOUCHES_WITHIN 0.1f  // of the threshold, farther out than the deepest: touches too

STRUCT(TouchPicker) {
  int pass, count;
  float threshold;  // nearer points are one: the manifold would let one replace the other
  float4 points[4], normals[4];  // w: distance; triangle
  float4 side;     // pass 2: along the line through the first two; 3: across it, towards the third
  int touches;     // of the pass's best so far
  float score;
};

LIB TouchPicker makeTouchPicker(float threshold) {
  TouchPicker p;
  p.pass = p.count = p.touches = 0;
  p.threshold = threshold;
  p.side = vec3(0.0f, 0.0f, 0.0f);
  p.score = 0.0f;
  for (int k = 0; k < 4; ++k) p.points[k] = p.normals[k] = vec3(0.0f, 0.0f, 0.0f);
  return p;
}

LIB void takeTouch(REF(TouchPicker) p, float4 point, float4 normal, int touches, float score) {
  UNROLL
  for (int k = 0; k < 4; ++k) {
    if (k != p->pass) continue;
    p->points[k] = point;
    p->normals[k] = normal;
  }
  p->count = p->pass + 1;
  p->touches = touches;
  p->score = score;
}

// point.w: distance; normal.w: the triangle.
LIB void offerTouch(REF(TouchPicker) p, float4 point, float4 normal) {
  if (p->pass == 0) {
    if (p->count == 0 || point.w < p->points[0].w - TOUCH_SLACK * p->threshold) takeTouch(p, point, normal, 1, 0.0f);
    return;
  }
  const float4 offset = xyz(point - p->points[0]);
  float score = dot3(offset, p->side);
  if (p->pass == 1) {
    score = length3(offset);
  } else if (p->pass == 2) {
    score = length3(offset - p->side * score);
  } else {
    score = -score;
  }
  const int touches = point.w <= fmax(p->points[0].w, 0.0f) + TOUCHES_WITHIN * p->threshold;
  if (!(score > p->threshold) || (p->count > p->pass && (touches < p->touches ||
                                                         (touches == p->touches && !(score > p->score)))))
    return;
  takeTouch(p, point, normal, touches, score);
}

// After each pass; 0 if there is nothing left to find.
LIB int nextTouchPass(REF(TouchPicker) p) {
  if (p->count <= p->pass) return 0;
  p->pass += 1;
  if (p->pass == 2) {
    p->side = normalize3(p->points[1] - p->points[0]);
  } else if (p->pass == 3) {
    const float4 offset = xyz(p->points[2] - p->points[0]);
    p->side = normalize3(offset - p->side * dot3(offset, p->side));
  }
  return p->pass < TOUCH_PASSES;
}

BTGPU_END
#endif
