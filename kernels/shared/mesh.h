// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Triangle meshes: triangles in the order of a tree of boxes above them, and what was found of them in a step.
#ifndef BTGPU_SHARED_MESH_H
#define BTGPU_SHARED_MESH_H
#include "types.h"

BTGPU_BEGIN

#define MESH_GRID 65535.0f          // steps along each axis of a mesh's grid
#define MESH_MAX_TRIANGLES 0xffffff  // a contact tells its triangle as a float
#define TRIANGLE_POINTS 4           // contacts of a triangle
#define HITS_KEPT 24u               // triangles of a search that are kept from counting them to writing them

// Of a shape SHAPE_MESH; its Shape.firstVertex says which. What is empty has no nodes.
STRUCT(Mesh) {
  float4 lower;    // corner of the grid in the mesh's axes; w = 0
  float4 perStep;  // 1 / length of a step of the grid along each axis; w = 0
  int firstTriangle, triangleCount;
  int firstNode, nodeCount;
  int firstPart, partCount;
  int unused[2];
};

// A box of the tree. Nodes lie depth first, so that the one behind a node is its first child, and a traversal needs no
// stack.
STRUCT(MeshNode) {
  uint x, y, z;  // steps of the grid: lower bound, and in the upper 16 bits the upper one
  int link;      // of a leaf: its triangle, counted from the mesh's first; else minus the number of nodes up to its end
};

// A subtree of a mesh: a part of the work with it. The parts of a mesh follow each other and have all of its leaves.
STRUCT(MeshPart) { int firstNode, nodeCount; };

STRUCT(MeshTriangle) {
  float4 a, b, c;   // corners in the mesh's axes, scaled; w = 0
  int part, index;  // what Bullet calls it: m_partId1 and m_index1 of a contact
  int unused[2];
};

// A triangle whose box overlaps that of the other shape of a pair.
STRUCT(TriangleHit) { uint pair, triangle; };  // position in BUCKET_MESH; index in the array of all triangles

// What a hit came to.
STRUCT(TriangleContacts) {
  float4 normal;                   // unit, world axes, on the mesh, towards the other shape; w: number of points
  float4 points[TRIANGLE_POINTS];  // xyz: point on the mesh, world axes, from A's position; w: distance, < 0 inside
};

BTGPU_END
#endif
