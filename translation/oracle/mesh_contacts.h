// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "../bullet.h"

BTGPU_TRANSLATION_BEGIN

struct FoundContact {
  btVector3 normal;  // on B
  double distance;
};

// What Bullet's own algorithms find between a shape and the single triangles of a mesh, a point a triangle, whatever
// becomes of it in the pair's manifold. There a point takes the place of one nearer than the breaking threshold, found
// with another triangle just before; and of a fifth point and four old ones it is told by depths of the step before
// which one goes, so that the deepest of this step may.
std::vector<FoundContact> contactsWithTriangles(btCollisionWorld& world, const btCollisionObject& a,
                                                const btCollisionObject& b);

BTGPU_TRANSLATION_END
