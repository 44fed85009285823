// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <btBulletCollisionCommon.h>

#include <vector>

namespace btgpu::tool {

// Corner of a triangle, in the shape's space.
struct Corner {
  btVector3 position, normal;
};

// Triangles of a shape, three corners each, for pictures: convex shapes by their hull. `fineness` 1 to 3 is that of
// spheres. A plane is a square of half edge `reach` around the point nearest to `focus` (the shape's space).
std::vector<Corner> meshOf(const btCollisionShape& shape, int fineness, btScalar reach, const btVector3& focus);

}  // namespace btgpu::tool
