// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Where two cores are closest, for stages 44 and 47, which are built for flat cores and, with BTGPU_CURVED, for pairs
// with something curved: each step by the name that it has for both. OpenCL C only.
#ifndef BTGPU_LIB_CLOSEST_CORES_H
#define BTGPU_LIB_CLOSEST_CORES_H
#include "convex.h"
#ifdef BTGPU_CURVED
#include "curved.h"
#else
#include "convex_sat.h"
#endif
#ifdef BTGPU_SHAPE_CPU
#include "gjk_wide.h"
#endif

LIB ClosestFeatures nothingFound(void) {
  ClosestFeatures found;
  found.normal = found.onA = found.onB = vec3(0.0f, 0.0f, 0.0f);
  return found;
}

#ifdef BTGPU_SHAPE_CPU
// CORES_OPEN: the pair has to wait for closestWide().
LIB int beginCores(CorePair cores, Hulls hulls, float4 start, float limit, ClosestBegun* begun,
                   ClosestFeatures* found) {
#ifdef BTGPU_CURVED
  return beginCurved(cores, hulls, start, limit, begun, found);
#else
  return beginClosest(cores, hulls, start, limit, begun, found);
#endif
}
#else
LIB int closestCores(CorePair cores, Hulls hulls, float4 start, float limit, ClosestFeatures* found) {
#ifdef BTGPU_CURVED
  return closestCurved(cores, hulls, start, limit, found);
#else
  return closestFeatures(cores, hulls, start, limit, found);
#endif
}
#endif

// A face's normal for the axis of features that are near each other, where it is as good.
LIB void preferFaces(CorePair cores, Hulls hulls, ClosestFeatures* found) {
#ifdef BTGPU_CURVED
  preferFlat(cores, hulls, FACE_AS_GOOD * cores.size, found);
#else
  preferFace(cores, hulls, found);
#endif
}

// Of cores that overlap.
LIB ClosestFeatures wayOutOf(CorePair cores, Hulls hulls) {
#ifdef BTGPU_CURVED
  return shortestCurvedWayOut(cores, hulls);
#else
  return shortestWayOut(cores, hulls);
#endif
}

#endif
