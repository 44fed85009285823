// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The tree of boxes over the triangles of a mesh. Knows nothing of Bullet.
#pragma once

#include <vector>

#include "../gpu_engine/world_input.h"

namespace btgpu {

struct MeshTree {
  Mesh mesh;                            // places counted from this mesh's first
  std::vector<MeshTriangle> triangles;  // in the order of the leaves
  std::vector<MeshNode> nodes;
  std::vector<MeshPart> parts;
  float4 lower, upper;  // bounds of the triangles; zero if there are none
};

// Of finite triangles, any number of them up to MESH_MAX_TRIANGLES.
MeshTree makeMeshTree(std::vector<MeshTriangle> triangles);

// Other corners for the triangles of a tree, in its order: its boxes anew. Their order stays, and gets the worse the
// more they move.
void refitMeshTree(MeshTree& tree);

// Appends a mesh to the others. Returns its index.
int appendMesh(const MeshTree& tree, MeshArrays& to);

}  // namespace btgpu
