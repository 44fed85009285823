// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Faces and edges of the convex hull of any points. Knows nothing of Bullet.
#pragma once

#include <vector>

#include "../gpu_engine/world_input.h"

namespace btgpu {

struct HullFeatures {
  std::vector<float4> vertices;
  std::vector<HullFace> faces;  // firstCorner counts from this hull's first corner
  std::vector<uint> corners;
  std::vector<HullEdge> edges;
};

// The hull of one point or more, all finite. Points within a few float roundings of the hull of the others are left
// out; triangles in one plane become one face, whatever its number of corners. All points on a plane, on a line or
// in one place give what shape.h says of polygons, segments and points.
HullFeatures makeHullFeatures(const std::vector<float4>& points);

// Appends a hull's features to those of the others. Returns a shape with nothing but the place that they have there.
Shape appendHull(const HullFeatures& features, HullArrays& to);

}  // namespace btgpu
