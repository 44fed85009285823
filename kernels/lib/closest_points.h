// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Closest points of a pair that the application names, by the functions of stage 44: GJK for cores that are apart;
// where they overlap the separating axis test, or, with something curved, EPA.
#ifndef BTGPU_LIB_CLOSEST_POINTS_H
#define BTGPU_LIB_CLOSEST_POINTS_H
#include "../shared/query.h"
#include "convex_sat.h"
#include "curved.h"

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

// The point of a convex shape that lies farthest along a unit direction, in its own axes, as planes see it
// (btConvexPlaneCollisionAlgorithm): boxes have their corners there, whatever their margin.
LIB float4 lowestPoint(Shape shape, Hulls hulls, float4 down) {
  if (shape.type == SHAPE_BOX || (shape.type == SHAPE_HULL && (shape.variant & HULL_BOX))) {
    return boxVertex(shape.extents, (down.x >= 0.0f ? 1 : 0) | (down.y >= 0.0f ? 2 : 0) | (down.z >= 0.0f ? 4 : 0));
  }
  return coreSupportPoint(coreOf(shape), hulls, down) + down * shape.margin;
}

// A convex shape over a plane: its lowest point. `toShape`: from the plane's position to the shape's. onShape and
// onPlane count from there too.
LIB float overPlane(Shape shape, Matrix3 r, Hulls hulls, float4 toShape, float4 normal, float height,
                       REF(float4) onShape, REF(float4) onPlane) {
  *onShape = toShape + mulMatrix(r, lowestPoint(shape, hulls, -mulTransposed(r, normal)));
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

// What is closest of two cores, or by which way they leave each other. 0 if they are farther apart than `limit`.
LIB int closestOfPair(CorePair cores, Hulls hulls, float4 start, float limit, REF(ClosestFeatures) found) {
  const int curved = IS_CURVED(cores.a) || IS_CURVED(cores.b);
  found->normal = found->onA = found->onB = vec3(0.0f, 0.0f, 0.0f);
  const int what = curved ? closestCurved(cores, hulls, start, limit, found)
                          : closestFeatures(cores, hulls, start, limit, found);
  if (what == CORES_OVERLAP) *found = curved ? shortestCurvedWayOut(cores, hulls) : shortestWayOut(cores, hulls);
  return what != CORES_FAR;
}

LIB ClosestAnswer closestOfCores(Shape a, Shape b, Matrix3 ra, Matrix3 rb, float4 bFromA, float4 atA, float limit,
                                    Hulls hulls) {
  ClosestAnswer answer = farApart();
  const CorePair cores = corePairOf(a, b, ra, rb, bFromA);
  const float margins = a.margin + b.margin;
  const float4 start = lengthSqr3(cores.offset) > 0.0f ? cores.offset : vec3(1.0f, 0.0f, 0.0f);
  ClosestFeatures found;
  if (!closestOfPair(cores, hulls, start, limit + margins, &found)) {
    answer.normal.w = INFINITY;
    return answer;
  }
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
