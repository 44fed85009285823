// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "../bullet.h"

BTGPU_TRANSLATION_BEGIN

// A convex shape and where it is.
struct PlacedShape {
  const btConvexShape* shape;
  btTransform at;
};

// The shape of a body at `at` if it is convex, or those in its compound that contacts call `child`: shapes of nested
// compounds may share a number.
std::vector<PlacedShape> placedShapes(const btCollisionShape& shape, const btTransform& at, int child);

// How far apart two convex shapes are along an axis from B to A, by Bullet's own support functions. They are at least
// as far apart, or overlap at most as deep, as along any axis.
double gapAlong(const PlacedShape& a, const PlacedShape& b, const btVector3& normal);

BTGPU_TRANSLATION_END
