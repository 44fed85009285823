// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#ifndef BTGPU_LIB_HULL_PLANE_H
#define BTGPU_LIB_HULL_PLANE_H
#include "pick_points.h"

BTGPU_BEGIN

#define HULL_PLANE_SLACK 1e-5f  // of the hull's size

// Hull A on plane B: of the vertices within the threshold, with the hull's margin below them, the four that
// pick_points.h says, the deepest last. Stock (btConvexPlaneCollisionAlgorithm) adds the deepest one a step.
LIB void collideHullPlane(Shape hull, __global const float4* hullVertices, Matrix3 rotationA, float4 planeInWorld,
                          float4 bFromA, float threshold, REF(RawContacts) out) {
  if (hull.variant & HULL_BOX) {
    collideBoxPlane(hull.extents, rotationA, planeInWorld, bFromA, threshold, out);
    return;
  }
  const float4 normal = xyz(planeInWorld), normalInA = mulTransposed(rotationA, planeInWorld);
  const float centre = -dot3(planeInWorld, bFromA) - planeInWorld.w - hull.margin;
  const float size = length3(hull.centre) + length3(hull.extents);
  PointPicker picker = makePicker(normalInA, threshold, HULL_PLANE_SLACK * size, threshold);
  do {
    for (int i = 0; i < hull.vertexCount; ++i) {
      const float4 vertex = hullVertices[hull.firstVertex + i];
      const float distance = centre + dot3(normalInA, vertex);
      offerPoint(&picker, vertex, distance);
    }
  } while (nextPass(&picker));
  out->normal = normal;
  for (int k = 3; k >= 0; --k) {
    if (picker.scores[k] < 0.0f) continue;
    const float distance = picker.points[k].w;
    addRaw(out, mulMatrix(rotationA, picker.points[k]) - normal * (distance + hull.margin), distance);
  }
}

BTGPU_END
#endif
