// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The region in which two faces lie over each other, all edges of both at once: a lane is an edge, clipped by all sides
// of the other face. Its corners stay where they are for the passes of the picker. Same results as by offerRegion and
// offerPoint, one by one. OpenCL C only.
#ifndef BTGPU_LIB_CLIP_WIDE_H
#define BTGPU_LIB_CLIP_WIDE_H
#include "pick_points.h"
#include "wide.h"

// Corners of the region, two to an edge: where it enters (lanes 0 to 15) and where it leaves (16 to 31). They are shown
// to the picker edge by edge. w: distance, INFINITY for those that are none.
typedef struct WideRegion {
  Lanes4 ends[2];
  float x[2 * BTGPU_WIDE], y[2 * BTGPU_WIDE], z[2 * BTGPU_WIDE], w[2 * BTGPU_WIDE];
  int edges;
} WideRegion;

// One of the two faces, as those of the other are clipped by it.
typedef struct WideSides {
  float4 plane;
  float facing;   // cosine between the plane's normal and the axis
  float winding;  // +1 if its corners run anticlockwise about the axis, else -1
  int clips;      // 0: no region over it
} WideSides;

WIDE Lanes3 broadcastFrom(const float* from, int lane) { return broadcastWide(laneOf(from, lane)); }

// from, to: where the edges begin and end (x of all, y, z), those of B first and then those of A; countB, countA of
// them. Points are on B's core. limit, least: of the picker.
WIDE void clipFacesWide(const float* from, const float* to, int countB, int countA, WideSides a, WideSides b,
                        float4 axis, float limit, float least, WideRegion* region) {
  const int16 lane = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const LaneMask ofB = lane < countB;
  const Lanes3 p = loadLanes3(from), q = loadLanes3(to), alongAxis = broadcastWide(axis);
  const Lanes3 along = subtractWide(q, p);
  float outward[3 * BTGPU_WIDE];
  storeLanes3(timesWide(crossWide(along, alongAxis), pick(ofB, (Lanes)b.winding, (Lanes)a.winding)), outward);
  Lanes enter = (Lanes)0.0f, leave = (Lanes)1.0f;
  LaneMask isLeft = (ofB & (a.clips ? -1 : 0)) | (~ofB & (lane < countA + countB) & (b.clips ? -1 : 0));
  for (int k = 0; k < max(countA, countB); ++k) {
    // Edges of B by the sides of A, and the other way round; a side that is none takes nothing.
    const int sideA = countB + min(k, countA - 1), sideB = min(k, countB - 1);
    const LaneMask isSide = (ofB & (k < countA ? -1 : 0)) | (~ofB & (k < countB ? -1 : 0));
    const Lanes3 side = pick3(ofB, broadcastFrom(outward, sideA), broadcastFrom(outward, sideB));
    const Lanes3 corner = pick3(ofB, broadcastFrom(from, sideA), broadcastFrom(from, sideB));
    const Lanes atP = dotWide(side, subtractWide(p, corner)), atQ = dotWide(side, subtractWide(q, corner));
    const LaneMask outP = (atP > 0.0f) & isSide, outQ = (atQ > 0.0f) & isSide;
    const Lanes share = atP / (atP - atQ);
    isLeft &= ~(outP & outQ);
    enter = pick(outP & (share > enter), share, enter);
    leave = pick(outQ & (share < leave), share, leave);
  }
  isLeft &= enter <= leave;
  const Lanes3 normal = pick3(ofB, broadcastWide(a.plane), broadcastWide(b.plane));
  const Lanes height = pick(ofB, (Lanes)a.plane.w, (Lanes)b.plane.w);
  const Lanes facing = pick(ofB, (Lanes)a.facing, (Lanes)b.facing);
  for (int end = 0; end < 2; ++end) {
    Lanes3 point = addWide(p, timesWide(along, end ? leave : enter));
    // From the point along the axis to the plane of the other face.
    const Lanes gap = (height - dotWide(normal, point)) / facing;
    point = pick3(ofB, point, addWide(point, timesWide(alongAxis, gap)));
    const Lanes distance = pick(ofB, -gap, gap);
    const LaneMask counts = isLeft & (distance < limit) & ~(distance < least);
    Lanes4 corner;
    corner.x = point.x;
    corner.y = point.y;
    corner.z = point.z;
    corner.w = pick(counts, distance, (Lanes)INFINITY);
    region->ends[end] = corner;
    vstore16(corner.x, end, region->x);
    vstore16(corner.y, end, region->y);
    vstore16(corner.z, end, region->z);
    vstore16(corner.w, end, region->w);
  }
  region->edges = countA + countB;
}

WIDE float4 regionCorner(const WideRegion* r, int i) { return (float4)(r->x[i], r->y[i], r->z[i], r->w[i]); }

// Pass 0.
WIDE void deepestOfRegion(PointPicker* picker, const WideRegion* region) {
  float deepest = INFINITY;
  int best = 0;
  for (int k = 0; k < region->edges; ++k) {
    for (int end = 0; end < 2; ++end) {
      const float distance = region->w[end * BTGPU_WIDE + k];
      picker->count += distance < INFINITY;
      if (!(distance < deepest - picker->slack)) continue;
      deepest = distance;
      best = end * BTGPU_WIDE + k;
    }
  }
  if (picker->count > 0) pickPoint(picker, 0, regionCorner(region, best), 0.0f);
}

// The corner with the highest score above `least`, the first of several, is pick `which`.
WIDE void mostOfRegion(PointPicker* picker, const WideRegion* region, Lanes enter, Lanes leave, float least,
                       int which) {
  enter = pick((region->ends[0].w < INFINITY) & (enter > least), enter, (Lanes)-INFINITY);
  leave = pick((region->ends[1].w < INFINITY) & (leave > least), leave, (Lanes)-INFINITY);
  const int16 edge = (int16)(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  const LaneMask leaves = leave > enter;
  float score;
  const int shown = firstOfMost(pick(leaves, leave, enter), leaves ? edge + 1 : edge, &score);
  if (score > least) pickPoint(picker, which, regionCorner(region, (shown & 1) * BTGPU_WIDE + (shown >> 1)), score);
}

// Passes 1 and 2.
WIDE void farthestOfRegion(PointPicker* picker, const WideRegion* region) {
  const Lanes3 deepest = broadcastWide(picker->points[0]), normal = broadcastWide(picker->normal);
  Lanes3 offset[2];
  for (int end = 0; end < 2; ++end) {
    offset[end] = subtractWide(xyzWide(region->ends[end]), deepest);
    offset[end] = subtractWide(offset[end], timesWide(normal, dotWide(normal, offset[end])));
  }
  if (picker->pass == 1) {
    mostOfRegion(picker, region, dotWide(offset[0], offset[0]), dotWide(offset[1], offset[1]),
                 picker->spacing * picker->spacing, 1);
    return;
  }
  const Lanes3 side = broadcastWide(picker->side);
  const Lanes enter = dotWide(side, offset[0]), leave = dotWide(side, offset[1]);
  mostOfRegion(picker, region, enter, leave, picker->spacing, 2);
  mostOfRegion(picker, region, -enter, -leave, picker->spacing, 3);
}

#endif
