// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "../bullet.h"
#include "convex_gap.h"

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

// Bullet's GJK and EPA once more, with both shapes 64 times as large, in the measure of the shapes. Bullet's limits are
// lengths, areas and volumes: its simplex calls a tetrahedron of 1e-4 / 6 m^3 flat and ends there
// (btVoronoiSimplexSolver::pointOutsideOfPlane), and two vertices within a centimetre the same one; on curved shapes of
// a metre it ends up to some millimetres and degrees off.
bool contactFoundFinely(const PlacedShape& a, const PlacedShape& b, FoundContact& found);
// ... of a convex shape with a mesh's or height field's triangles, as btConvexConcaveCollisionAlgorithm goes through
// them.
std::vector<FoundContact> contactsFoundFinely(const PlacedShape& a, const btConcaveShape& mesh, const btTransform& at);

BTGPU_TRANSLATION_END
