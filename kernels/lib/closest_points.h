// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Closest points of a pair that the application names, by the functions of stage 44: GJK for cores that are apart, the
// separating axis test where they overlap.
#ifndef BTGPU_LIB_CLOSEST_POINTS_H
#define BTGPU_LIB_CLOSEST_POINTS_H
#include "../shared/query.h"
#include "convex_sat.h"

BTGPU_BEGIN

LIB float4 placeOf(ItemPose pose) { return vec3(pose.row0.w, pose.row1.w, pose.row2.w); }
LIB Matrix3 rotationOf(ItemPose pose) {
  Matrix3 r;
  r.row0 = xyz(pose.row0);
  r.row1 = xyz(pose.row1);
  r.row2 = xyz(pose.row2);
  return r;
}

LIB ClosestAnswer farApart(void) {
  ClosestAnswer answer;
  answer.onA = answer.onB = answer.normal = vec3(0.0f, 0.0f, 0.0f);
  answer.found = answer.unused[0] = answer.unused[1] = answer.unused[2] = 0;
  return answer;
}

// A convex shape over a plane: its lowest point. `toShape`: from the plane's position to the shape's. onShape and
// onPlane count from there too.
LIB float overPlane(Shape shape, Matrix3 r, Hulls hulls, float4 toShape, float4 normal, float height,
                       REF(float4) onShape, REF(float4) onPlane) {
  const Core core = coreOf(shape);
  const float4 lowest = coreVertex(core, hulls, coreSupport(core, hulls, -mulTransposed(r, normal)));
  *onShape = toShape + mulMatrix(r, lowest) - normal * shape.margin;
  const float distance = dot3(*onShape, normal) - height;
  *onPlane = *onShape - normal * distance;
  return distance;
}

LIB ClosestAnswer closestToPlane(Shape a, Shape b, Matrix3 ra, Matrix3 rb, float4 bFromA, float4 atA, Hulls hulls) {
  ClosestAnswer answer = farApart();
  float distance;
  if (b.type == SHAPE_PLANE) {
    const float4 normal = mulMatrix(rb, b.extents);
    distance = overPlane(a, ra, hulls, -bFromA, normal, b.extents.w, &answer.onA, &answer.onB);
    answer.onA += atA + bFromA;
    answer.onB += atA + bFromA;
    answer.normal = normal;
  } else {
    const float4 normal = mulMatrix(ra, a.extents);
    distance = overPlane(b, rb, hulls, bFromA, normal, a.extents.w, &answer.onB, &answer.onA);
    answer.onA += atA;
    answer.onB += atA;
    answer.normal = -normal;
  }
  answer.normal.w = distance;
  return answer;
}

LIB ClosestAnswer closestOfCores(Shape a, Shape b, Matrix3 ra, Matrix3 rb, float4 bFromA, float4 atA, float limit,
                                    Hulls hulls) {
  ClosestAnswer answer = farApart();
  const CorePair cores = corePairOf(a, b, ra, rb, bFromA);
  const float margins = a.margin + b.margin;
  const float4 start = lengthSqr3(cores.offset) > 0.0f ? cores.offset : vec3(1.0f, 0.0f, 0.0f);
  ClosestFeatures found;
  found.normal = found.onA = found.onB = vec3(0.0f, 0.0f, 0.0f);
  const int what = closestFeatures(cores, hulls, start, limit + margins, &found);
  if (what == CORES_FAR) {
    answer.normal.w = INFINITY;
    return answer;
  }
  if (what == CORES_OVERLAP) found = shortestWayOut(cores, hulls);
  answer.onA = atA + mulMatrix(ra, found.onA + found.normal * a.margin);
  answer.onB = atA + mulMatrix(ra, found.onB - found.normal * b.margin);
  answer.normal = withW(-mulMatrix(ra, found.normal), found.normal.w - margins);
  return answer;
}

LIB ClosestAnswer closestPointsOf(ClosestQuery query, __global const Shape* shapes, Hulls hulls) {
  const Shape a = shapes[query.shapeA];
  Shape b = a;
  if (query.shapeB >= 0) {
    b = shapes[query.shapeB];
  } else {
    b.type = SHAPE_SPHERE;
    b.margin = query.radiusB;
    b.extents = vec3(query.radiusB, 0.0f, 0.0f);
    b.centre = vec3(0.0f, 0.0f, 0.0f);
  }
  const Matrix3 ra = rotationOf(query.poseA), rb = rotationOf(query.poseB);
  const float4 atA = placeOf(query.poseA), bFromA = placeOf(query.poseB) - atA;
  const int isPlane = a.type == SHAPE_PLANE || b.type == SHAPE_PLANE;
  ClosestAnswer answer = isPlane ? closestToPlane(a, b, ra, rb, bFromA, atA, hulls)
                                 : closestOfCores(a, b, ra, rb, bFromA, atA, query.limit, hulls);
  answer.found = answer.normal.w <= query.limit;
  answer.onA.w = answer.onB.w = 0.0f;
  return answer;
}

BTGPU_END
#endif
