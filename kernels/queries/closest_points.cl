// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#define BTGPU_CURVED
#define BTGPU_SUPPORT_BY_CALL
#include "../lib/closest_points.h"
#include "../lib/kernel.h"

// Closest points of many pairs. A work item does a pair.
KERNEL closestPoints(CHECKS uint count, __global const Shape* shapes, __global const float4* hullVertices,
                     __global const HullFace* hullFaces, __global const uint* hullCorners,
                     __global const HullEdge* hullEdges, __global const ClosestQuery* queries,
                     __global ClosestAnswer* answers) {
  const Hulls hulls = hullsOf(hullVertices, hullFaces, hullCorners, hullEdges);
  FOR_EACH(i, count) AT(answers, i) = closestPointsOf(AT(queries, i), shapes, hulls);
}
