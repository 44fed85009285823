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

// All that Bullet's own algorithms find between two bodies, whatever becomes of it in the pair's manifold: of a mesh a
// point a triangle, of boxes up to four corners. In the manifold a point takes the place of one nearer than the
// breaking threshold, found just before; and of a fifth point and four old ones it is told by depths of the step before
// which one goes, so that the deepest of this step may.
std::vector<FoundContact> contactsFound(btCollisionWorld& world, const btCollisionObject& a,
                                        const btCollisionObject& b);

BTGPU_TRANSLATION_END
