// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What Bullet's convex algorithms see of a shape without its margin (localGetSupportingVertexWithoutMargin): the hull
// of some points, a cylinder, a cone, the hull of some spheres, or a sum of these. Scaled and flat shapes are what they
// are made of.
#pragma once

#include <vector>

#include "../kernels/shared/shape.h"
#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

// The shape that a uniformly scaled or a flat one is made of; the factor is multiplied into `scale`.
const btConvexShape& innermostShape(const btConvexShape& shape, btScalar& scale);

// Shape::boundsMargins of a convex shape.
int boundsMargins(const btCollisionShape& shape);

// Cylinders and cones, also scaled ones: type and measures of the core, and the bounds; the margin is the caller's.
// False for all other shapes.
bool readRoundShape(const btCollisionShape& shape, Shape& out);

// A shape that is points, or spheres, or a sum with something round in it, with a margin around them.
struct CorePoints {
  std::vector<btVector3> points;  // w = 0
  // Of spheres: what their radii are larger than the margin, by point; empty where all are of one size.
  std::vector<float> radii;
  btVector3 stretch{1, 1, 1};  // of these spheres along the shape's axes
  std::vector<float4> terms;   // of a sum, as shape.h has it; then there are no points
  btScalar margin = 0;
  bool isBox = false;  // Bullet's localGetSupportingVertex() has its corners, not rounded by the margin
};

// Fills `out`; false for all shapes that are nothing of the kind.
bool readCorePoints(const btCollisionShape& shape, CorePoints& out);

BTGPU_TRANSLATION_END
