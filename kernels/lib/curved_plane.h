// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#ifndef BTGPU_LIB_CURVED_PLANE_H
#define BTGPU_LIB_CURVED_PLANE_H
#include "convex.h"
#include "pick_points.h"

BTGPU_BEGIN

#define CURVED_PLANE_SLACK 1e-5f  // of the shape's size
#define SUM_TILT 1e-3f            // radians: what is flatter than that on a sum's underside is found by its ends

// Shows the picker what of the core may touch a plane below it, the lowest point last. Not more than what faces the
// plane: a point of the rim that is about to roll onto the plane would hold the rolling up.
LIB void offerCurved(REF(PointPicker) picker, Core core, Hulls hulls, float4 normal, float centre) {
  if (core.curved == SHAPE_MULTI_SPHERE) {
    // Of each sphere.
    const float4 stretch = hulls.vertices[core.firstVertex + core.vertexCount];
    const float4 stretched = scale3(stretch, normal);
    const float size = length3(stretched);
    const float4 outward = size > 0.0f ? scale3(stretch, stretched) / size : stretched;
    for (int i = 0; i < core.vertexCount; ++i) {
      const float4 sphere = hulls.vertices[core.firstVertex + i];
      const float4 point = xyz(sphere) - outward * sphere.w;
      offerPoint(picker, point, centre + dot3(normal, point));
    }
    return;
  }
  if (core.curved == SHAPE_SUM) {
    float4 u, v;
    planeSpace(core.facing, &u, &v);
    for (int k = 0; k < 4; ++k) {
      const float4 tilt = (k & 1 ? u : -u) + (k & 2 ? v : -v);
      const float4 point = coreSupportPoint(core, hulls, core.facing + tilt * SUM_TILT);
      offerPoint(picker, point, centre + dot3(normal, point));
    }
  }
  const int patch = patchAlong(core, core.facing), corners = faceCorners(core, hulls, patch);
  for (int k = 0; k < corners; ++k) {
    const float4 point = patchCorner(core, hulls, patch, k);
    offerPoint(picker, point, centre + dot3(normal, point));
  }
  if (patch >= PATCH_LINE) return;
  const float4 lowest = coreSupportPoint(core, hulls, core.facing);
  offerPoint(picker, lowest, centre + dot3(normal, lowest));
}

// Cylinder, cone or spheres A on plane B: of the points within the threshold, with the margin below them, the four that
// pick_points.h says, the deepest last. Stock adds the deepest one a step.
LIB void collideCurvedPlane(Shape shape, __global const float4* hullVertices, Matrix3 rotationA, float4 planeInWorld,
                            float4 bFromA, float threshold, REF(RawContacts) out) {
  const float4 normal = xyz(planeInWorld), normalInA = mulTransposed(rotationA, planeInWorld);
  const float centre = -dot3(planeInWorld, bFromA) - planeInWorld.w - shape.margin;
  const Hulls hulls = hullsOf(hullVertices, 0, 0, 0);
  Core core = coreOf(shape);
  core.facing = -normalInA;
  const float size = length3(shape.centre) + length3(shape.extents);
  PointPicker picker = makePicker(normalInA, threshold, CURVED_PLANE_SLACK * size, threshold);
  do {
    offerCurved(&picker, core, hulls, normalInA, centre);
  } while (nextPass(&picker));
  out->normal = normal;
  for (int k = 3; k >= 0; --k) {
    if (picker.scores[k] < 0.0f) continue;
    const float distance = picker.points[k].w;
    addRaw(out, mulMatrix(rotationA, picker.points[k]) - normal * (distance + shape.margin), distance);
  }
}

BTGPU_END
#endif
