// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Contacts of two convex cores whose axis is known: where it is a face's, the corners of the region in which that face
// and the nearest one of the other shape lie over each other. Faces may have any number of corners: the region's
// corners are edges of the one clipped by the other, found edge by edge and never stored.
#ifndef BTGPU_LIB_CONVEX_CLIP_H
#define BTGPU_LIB_CONVEX_CLIP_H
#include "convex.h"
#include "pick_points.h"
#ifdef BTGPU_WIDE_SUPPORT
#include "clip_wide.h"
#endif

BTGPU_BEGIN

#define FACE_ALONG_AXIS 0.995f  // cosine: nearly along the axis, so that other points than the closest may touch
#define FACE_ACROSS_AXIS 1e-3f  // cosine: seen from the side, a face covers nothing
#define SAME_DEPTH 1e-5f        // of twice the smaller core's size
#define DEPTH_ROUNDING 1e-6f    // of the pair's size: no better is known in float

// A face in A's axes.
STRUCT(FaceView) {
  Core core;
  Matrix3 turn;  // of the core's axes to A's
  float4 offset;
  int face, corners;
  float4 plane;   // normal and constant in A's axes
  float winding;  // +1 if its corners run anticlockwise about the axis, else -1
};

LIB FaceView viewFace(CorePair pair, Hulls hulls, int ofA, int face, float4 axis) {
  FaceView v;
  v.core = ofA ? pair.a : pair.b;
  if (ofA) {
    v.turn.row0 = vec3(1.0f, 0.0f, 0.0f);
    v.turn.row1 = vec3(0.0f, 1.0f, 0.0f);
    v.turn.row2 = vec3(0.0f, 0.0f, 1.0f);
    v.offset = vec3(0.0f, 0.0f, 0.0f);
  } else {
    v.turn = pair.turn;
    v.offset = pair.offset;
  }
  v.face = face;
  v.corners = faceCorners(v.core, hulls, face);
  const float4 plane = facePlane(v.core, hulls, face);
  const float4 normal = mulMatrix(v.turn, plane);
  v.plane = withW(normal, plane.w + dot3(normal, v.offset));
  v.winding = dot3(normal, axis) < 0.0f ? -1.0f : 1.0f;
  return v;
}

LIB float4 cornerOf(const FaceView* v, Hulls hulls, int k) {
  return v->offset + mulMatrix(v->turn, faceCorner(v->core, hulls, v->face, k < v->corners ? k : 0));
}

// Clips the segment p, q by the sides of a face, seen along the axis; from, to: what is left of it, as shares.
// 0 if nothing is.
LIB int clipByFace(const FaceView* v, Hulls hulls, float4 axis, float4 p, float4 q, REF(float) from, REF(float) to) {
  *from = 0.0f;
  *to = 1.0f;
  float4 corner = cornerOf(v, hulls, 0);
  for (int k = 0; k < v->corners; ++k) {
    const float4 next = cornerOf(v, hulls, k + 1);
    const float4 outward = cross3(next - corner, axis) * v->winding;
    const float atP = dot3(outward, p - corner), atQ = dot3(outward, q - corner);
    if (atP > 0.0f && atQ > 0.0f) return 0;
    if (atP > 0.0f) *from = fmax(*from, atP / (atP - atQ));
    if (atQ > 0.0f) *to = fmin(*to, atP / (atP - atQ));
    corner = next;
  }
  return *from <= *to;
}

// Shows the picker every corner of the region. The axis goes from A to B; points are shown on B's core.
LIB void offerRegion(REF(PointPicker) picker, Hulls hulls, const FaceView* onA, const FaceView* onB, float4 axis) {
  for (int ofA = 0; ofA < 2; ++ofA) {
    const FaceView* edges = ofA ? onA : onB;
    const FaceView* sides = ofA ? onB : onA;
    const float facing = dot3(sides->plane, axis);
    if (sides->corners < 3 || !sides->core.isPolytope || fabs(facing) < FACE_ACROSS_AXIS) continue;
    float4 p = cornerOf(edges, hulls, 0);
    for (int k = 0; k < edges->corners; ++k) {
      const float4 q = cornerOf(edges, hulls, k + 1);
      float from, to;
      if (clipByFace(sides, hulls, axis, p, q, &from, &to)) {
        for (int end = 0; end < 2; ++end) {
          const float4 point = p + (q - p) * (end ? to : from);
          // From the point along the axis to the plane of the other face.
          const float gap = (sides->plane.w - dot3(sides->plane, point)) / facing;
          if (ofA) {
            offerPoint(picker, point + axis * gap, gap);
          } else {
            offerPoint(picker, point, -gap);
          }
        }
      }
      p = q;
    }
  }
}

// The closest point is the deepest where the region's corners are not: the nearest face of the other shape need not be
// the one that touches.
LIB void offerClosest(REF(PointPicker) picker, ClosestFeatures c) {
  if (picker->count > 0 && picker->points[0].w <= c.normal.w + 2.0f * picker->slack) return;
  picker->count += 1;
  pickPoint(picker, 0, withW(c.onB, c.normal.w), 0.0f);
}

LIB void pickOfRegion(REF(PointPicker) picker, Hulls hulls, const FaceView* onA, const FaceView* onB,
                      ClosestFeatures c) {
  do {
    offerRegion(picker, hulls, onA, onB, xyz(c.normal));
    if (picker->pass == 0) offerClosest(picker, c);
  } while (nextPass(picker));
}

#ifdef BTGPU_WIDE_SUPPORT
static void edgesOf(const FaceView* v, Hulls hulls, int first, float* from, float* to) {
  for (int k = 0; k < v->corners; ++k) {
    const float4 corner = cornerOf(v, hulls, k);
    const int here = first + k, before = k > 0 ? here - 1 : first + v->corners - 1;
    from[here] = to[before] = corner.x;
    from[BTGPU_WIDE + here] = to[BTGPU_WIDE + before] = corner.y;
    from[2 * BTGPU_WIDE + here] = to[2 * BTGPU_WIDE + before] = corner.z;
  }
}

static WideSides sidesOf(const FaceView* v, float4 axis) {
  WideSides s;
  s.plane = v->plane;
  s.facing = dot3(v->plane, axis);
  s.winding = v->winding;
  s.clips = v->corners >= 3 && v->core.isPolytope && !(fabs(s.facing) < FACE_ACROSS_AXIS);
  return s;
}

// As pickOfRegion, for faces that have at most BTGPU_WIDE corners together.
static void pickOfRegionWide(PointPicker* picker, Hulls hulls, const FaceView* onA, const FaceView* onB,
                             ClosestFeatures c) {
  float from[3 * BTGPU_WIDE], to[3 * BTGPU_WIDE];
  edgesOf(onB, hulls, 0, from, to);
  edgesOf(onA, hulls, onB->corners, from, to);
  const float4 axis = xyz(c.normal);
#ifdef BTGPU_TRIANGLE_CORES
  const float least = picker->least;
#else
  const float least = -INFINITY;
#endif
  WideRegion region;
  clipFacesWide(from, to, onB->corners, onA->corners, sidesOf(onA, axis), sidesOf(onB, axis), axis, picker->limit,
                least, &region);
  deepestOfRegion(picker, &region);
  offerClosest(picker, c);
  while (nextPass(picker)) farthestOfRegion(picker, &region);
}
#endif

// Depths nearer than this are the same. Not in proportion to the pair: what lies on a large ground would be as deep as
// the ground's size makes it.
LIB float depthSlack(CorePair pair) {
  const float smaller = fmin(length3(pair.a.extents), length3(pair.b.extents));
  return fmax(SAME_DEPTH * 2.0f * smaller, DEPTH_ROUNDING * pair.size);
}

// Contacts of a pair, the deepest last: what is added to a full manifold replaces another point, which must not be the
// deepest one, and the old points' depths are those of the last step. `threshold`: how far apart surfaces may be; `ra`:
// A's axes to the world's.
LIB void collideConvex(CorePair pair, Hulls hulls, ClosestFeatures c, Matrix3 ra, float threshold,
                       REF(RawContacts) out) {
  const float4 axis = xyz(c.normal);
  pair.a.facing = axis;
  pair.b.facing = -mulTransposed(pair.turn, axis);
  const float margins = pair.a.margin + pair.b.margin;
  PointPicker picker = makePicker(axis, threshold + margins, depthSlack(pair), threshold);
#ifdef BTGPU_TRIANGLE_CORES
  picker.least = c.normal.w - picker.slack;
#endif
  int found = 0;
  const int isPoint =
      (!pair.a.isHull && length3(pair.a.extents) == 0.0f) || (!pair.b.isHull && length3(pair.b.extents) == 0.0f);
  if (!isPoint) {
    const FaceView onA = viewFace(pair, hulls, 1, faceAlong(pair.a, hulls, axis), axis);
    const FaceView onB = viewFace(pair, hulls, 0, faceAlong(pair.b, hulls, -mulTransposed(pair.turn, axis)), axis);
    const float alongA = pair.a.isPolytope && onA.corners >= 3 ? dot3(onA.plane, axis) : 0.0f;
    const float alongB = pair.b.isPolytope && onB.corners >= 3 ? -dot3(onB.plane, axis) : 0.0f;
    if (fmax(alongA, alongB) > FACE_ALONG_AXIS) {
#ifdef BTGPU_WIDE_SUPPORT
      if (onA.corners + onB.corners <= BTGPU_WIDE) {
        pickOfRegionWide(&picker, hulls, &onA, &onB, c);
      } else
#endif
      {
        pickOfRegion(&picker, hulls, &onA, &onB, c);
      }
      found = 1;
    }
  }
  if (!found) pickPoint(&picker, 0, withW(c.onB, c.normal.w), 0.0f);
  out->normal = -mulMatrix(ra, axis);
  for (int k = 3; k >= 0; --k) {
    if (picker.scores[k] < 0.0f || !(picker.points[k].w < picker.limit)) continue;
    const float4 onB = xyz(picker.points[k]) - axis * pair.b.margin;
    addRaw(out, mulMatrix(ra, onB), picker.points[k].w - margins);
  }
}

BTGPU_END
#endif
