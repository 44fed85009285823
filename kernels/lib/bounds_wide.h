// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// AABBs of BTGPU_WIDE shapes at once. Every lane is rounded as in bounds.h, operation by operation. OpenCL C only.
#ifndef BTGPU_LIB_BOUNDS_WIDE_H
#define BTGPU_LIB_BOUNDS_WIDE_H
#include "../shared/shape.h"
#include "bounds.h"
#include "motion_wide.h"

STRUCT(WideAabb) { Lanes3 lower, upper; };

// What shapeAabb() has to know of shapes that it bounds by a sphere or a box of their own.
STRUCT(WideShape) {
  LaneMask sphere, box;
  Lanes3 reach, centre;
};

// Spheres, boxes, and what Bullet bounds by the box around it in its own axes.
LIB int isBoundedByBox(Shape shape) {
  if (shape.type == SHAPE_SPHERE || shape.type == SHAPE_BOX) return 1;
  return shape.type != SHAPE_NONE && shape.type != SHAPE_HOST && shape.type != SHAPE_PLANE && shape.boundsMargins <= 0;
}

WIDE Lanes reachAlong(Lanes3 row, Lanes3 reach) { return dotWide(abs3Wide(row), reach); }

WIDE WideAabb shapeAabbWide(const WideShape* shape, WidePose pose, float threshold) {
  const WideMatrix r = matrixFromQuaternionWide(pose.orientation);
  Lanes3 extent;
  extent.x = pick(shape->sphere, shape->reach.x, reachAlong(r.row0, shape->reach));
  extent.y = pick(shape->sphere, shape->reach.x, reachAlong(r.row1, shape->reach));
  extent.z = pick(shape->sphere, shape->reach.x, reachAlong(r.row2, shape->reach));
  const Lanes3 moved = addWide(pose.position, mulMatrixWide(r, shape->centre));
  const Lanes3 centre = pick3(shape->sphere | shape->box, pose.position, moved);
  const Lanes3 by = broadcastWide(vec3(threshold, threshold, threshold));
  WideAabb box;
  box.lower = subtractWide(subtractWide(centre, extent), by);
  box.upper = addWide(addWide(centre, extent), by);
  return box;
}

// mergeAabb() in the lanes of the mask.
WIDE WideAabb mergeWhere(LaneMask mask, WideAabb a, WideAabb b) {
  a.lower.x = pick(mask, fmin(a.lower.x, b.lower.x), a.lower.x);
  a.lower.y = pick(mask, fmin(a.lower.y, b.lower.y), a.lower.y);
  a.lower.z = pick(mask, fmin(a.lower.z, b.lower.z), a.lower.z);
  a.upper.x = pick(mask, fmax(a.upper.x, b.upper.x), a.upper.x);
  a.upper.y = pick(mask, fmax(a.upper.y, b.upper.y), a.upper.y);
  a.upper.z = pick(mask, fmax(a.upper.z, b.upper.z), a.upper.z);
  return a;
}

#endif
