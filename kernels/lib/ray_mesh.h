// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A ray against a triangle mesh or a height field, as btTriangleRaycastCallback has it: through the tree of boxes that
// the steps have, nearest child first.
#ifndef BTGPU_LIB_RAY_MESH_H
#define BTGPU_LIB_RAY_MESH_H
#include "query_shapes.h"
#include "ray_bounds.h"

BTGPU_BEGIN

#define TRIANGLE_EDGE (-1e-4f) // of the squared area: how far outside of a triangle it is still hit
// Boxes of a mesh's tree are grown by a step of its grid, more than rounding puts a ray's end off; by the share of their
// size by which a point may lie outside of a triangle and count: twice the share of its area; and where a ray leaves
// them by three times what is lost in a product of numbers that were rounded five times.
#define MESH_GROWN (-2.0f * TRIANGLE_EDGE)
#define MESH_SLACK (1.0f + 16.0f * BTGPU_EPSILON)
#define MESH_STACK 32  // nodes to come back to: the tree is halved, so no more than log2(MESH_MAX_TRIANGLES)

// A ray against a triangle, of which the side about which its corners run anticlockwise is the front.
LIB int castTriangle(float4 a, float4 b, float4 c, float4 from, float4 to, uint flags, REF(float) fraction,
                     REF(float4) normal) {
  const float4 across = cross3(b - a, c - a);
  const float level = dot3(a, across), before = dot3(across, from) - level, behind = dot3(across, to) - level;
  if (!(before * behind < 0.0f)) return 0;
  const int isBack = before <= 0.0f;
  if ((flags & RAY_FILTER_BACKFACES) && isBack) return 0;
  *fraction = before / (before - behind);
  const float4 at = from * (1.0f - *fraction) + to * *fraction;
  const float4 toA = a - at, toB = b - at, toC = c - at;
  const float least = TRIANGLE_EDGE * lengthSqr3(across);
  if (!(dot3(cross3(toA, toB), across) >= least) || !(dot3(cross3(toB, toC), across) >= least) ||
      !(dot3(cross3(toC, toA), across) >= least)) {
    return 0;
  }
  const float4 unit = normalize3(across);
  *normal = isBack && !(flags & RAY_KEEP_UNFLIPPED_NORMAL) ? -unit : unit;
  return 1;
}

// In steps of a mesh's grid.
LIB Way wayInGrid(Mesh mesh, float4 from, float4 to, float4 lower, float4 upper) {
  // A mesh that is flat has boxes without height, for which any measure will do.
  const float most = fmax(mesh.perStep.x, fmax(mesh.perStep.y, mesh.perStep.z));
  const float4 scale =
      vec3(mesh.perStep.x > 0.0f ? mesh.perStep.x : most, mesh.perStep.y > 0.0f ? mesh.perStep.y : most,
           mesh.perStep.z > 0.0f ? mesh.perStep.z : most);
  Way way;
  way.fromLower = scale3(xyz(from) + upper - mesh.lower, scale);
  way.fromUpper = scale3(xyz(from) + lower - mesh.lower, scale);
  way.inverse = inverseDirection(scale3(to - from, scale));
  return way;
}

// As enterOnWay.
LIB float enterMeshNode(MeshNode n, Way way, float limit) {
  const float4 lower = vec3((float)(n.x & 0xffffu), (float)(n.y & 0xffffu), (float)(n.z & 0xffffu));
  const float4 upper = vec3((float)(n.x >> 16), (float)(n.y >> 16), (float)(n.z >> 16));
  const float4 grown = vec3(1.0f, 1.0f, 1.0f) + (upper - lower) * MESH_GROWN;
  const float4 a = scale3(lower - grown - way.fromLower, way.inverse);
  const float4 b = scale3(upper + grown - way.fromUpper, way.inverse);
  const float4 first = fmin(a, b), last = fmax(a, b);
  const float enter = fmax(fmax(first.x, first.y), fmax(first.z, 0.0f));
  const float leave = fmin(fmin(last.x, last.y), fmin(last.z, limit));
  return enter <= leave * MESH_SLACK ? enter : INFINITY;
}

// Nodes of a mesh that are still to be visited.
STRUCT(MeshWalk) {
  int nodes[MESH_STACK];
  float enters[MESH_STACK];
  int count;
};

LIB void pushMeshNode(REF(MeshWalk) walk, int node, float enter) {
  if (!(enter < INFINITY)) return;
  walk->nodes[walk->count] = node;
  walk->enters[walk->count] = enter;
  walk->count += 1;
}

LIB void startAtMesh(REF(MeshWalk) walk, Mesh mesh, __global const MeshNode* nodes, Way way, float limit) {
  walk->count = 0;
  if (mesh.nodeCount > 0) pushMeshNode(walk, mesh.firstNode, enterMeshNode(nodes[mesh.firstNode], way, limit));
}

// The next triangle whose box is entered before `limit`, nearest child first, counted from the mesh's first; -1 if
// there is none left.
LIB int nextTriangle(REF(MeshWalk) walk, __global const MeshNode* nodes, Way way, float limit) {
  while (walk->count > 0) {
    const int at = --walk->count, node = walk->nodes[at];
    if (!(walk->enters[at] <= limit * MESH_SLACK)) continue;
    const int link = nodes[node].link;
    if (link >= 0) return link;
    const int first = node + 1, firstLink = nodes[first].link;
    const int second = first + (firstLink < 0 ? -firstLink : 1);
    const float enterFirst = enterMeshNode(nodes[first], way, limit);
    const float enterSecond = enterMeshNode(nodes[second], way, limit);
    const int isFirst = enterFirst <= enterSecond;
    pushMeshNode(walk, isFirst ? second : first, isFirst ? enterSecond : enterFirst);
    pushMeshNode(walk, isFirst ? first : second, isFirst ? enterFirst : enterSecond);
  }
  return -1;
}

// Of triangles that are hit at the same place, as those that share an edge are, the first by part and index counts.
LIB int isBeforeTriangle(MeshTriangle t, MeshTriangle other) {
  return t.part < other.part || (t.part == other.part && t.index < other.index);
}

// A ray in a mesh's own axes. `fraction`: up to where; of the hit, if there is one.
LIB int castMesh(Mesh mesh, ItemForm form, QueryShapes q, float4 from, float4 to, uint flags, REF(float) fraction,
                 REF(float4) normal, REF(RayHit) hit) {
  from = vec3(from.x / form.scaling.x, from.y / form.scaling.y, from.z / form.scaling.z);
  to = vec3(to.x / form.scaling.x, to.y / form.scaling.y, to.z / form.scaling.z);
  const int cells = (form.flags & FORM_HEIGHT_FIELD) && !(flags & RAY_ALL_TRIANGLES);
  const int turned = cells && (form.flags & FORM_OTHER_WINDING);
  const float4 point = vec3(0.0f, 0.0f, 0.0f);
  const Way way = wayInGrid(mesh, from, to, point, point);
  int best = -1;
  MeshWalk walk;
  startAtMesh(&walk, mesh, q.meshNodes, way, *fraction);
  while (true) {
    const int link = nextTriangle(&walk, q.meshNodes, way, *fraction);
    if (link < 0) break;
    const MeshTriangle t = q.meshTriangles[mesh.firstTriangle + link];
    float share;
    float4 across;
    if (!castTriangle(t.a, turned ? t.c : t.b, turned ? t.b : t.c, from, to, flags, &share, &across)) continue;
    if (!(share < *fraction ||
          (share == *fraction && (best < 0 ? share < 1.0f : isBeforeTriangle(t, q.meshTriangles[best]))))) {
      continue;
    }
    best = mesh.firstTriangle + link;
    *fraction = share;
    *normal = across;
  }
  if (best < 0) return 0;
  hit->part = cells ? q.meshTriangles[best].part >> 1 : q.meshTriangles[best].part;
  hit->triangle = q.meshTriangles[best].index;
  return 1;
}

BTGPU_END
#endif
