// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The triangles of a mesh that the other shape of a pair may touch, as btConvexConcaveCollisionAlgorithm asks for them:
// those whose box overlaps that of the shape, in the mesh's axes. A search is one group of a mesh's parts (subtrees) for
// one pair; there are `groups` of them a pair, and search n is group n % groups of the pair at position n / groups in
// BUCKET_MESH. In which groups the parts are makes no difference to the result.
#include "../lib/bounds.h"
#include "../lib/kernel.h"
#include "../shared/contact.h"
#include "../shared/mesh.h"

// Single work item: how many searches there are; none after an overflow.
SINGLE_KERNEL countSearches(__global const StepCounters* counters, __global const uint* bucketFirst, uint groups,
                            __global uint* searchCount) {
  *searchCount = counters->overflow ? 0 : (bucketFirst[BUCKET_MESH + 1] - bucketFirst[BUCKET_MESH]) * groups;
}

// The box of shape A in the axes of the mesh B, as in btConvexTriangleCallback::setTimeStepAndCounters.
static Aabb boxInMesh(Shape a, BodyPose poseA, BodyPose poseB, float margin, __global const float4* hullVertices) {
  const float4 q = poseB.orientation;
  BodyPose pose;
  pose.position = rotateInverse(q, poseA.position - poseB.position);
  pose.orientation = quaternionProduct((float4)(-q.x, -q.y, -q.z, q.w), poseA.orientation);
  Aabb box = shapeAabb(a, pose, hullVertices);
  box.lower -= vec3(margin, margin, margin);
  box.upper += vec3(margin, margin, margin);
  return box;
}

// A box in steps of a mesh's grid, a step larger than it is: what rounding leaves of that covers it.
typedef struct GridBox {
  uint lowerX, lowerY, lowerZ, upperX, upperY, upperZ;
} GridBox;

static uint gridStep(float value) { return (uint)clamp(value, 0.0f, MESH_GRID); }

static GridBox gridBoxOf(Aabb box, Mesh mesh) {
  const float4 lower = (box.lower - mesh.lower) * mesh.perStep, upper = (box.upper - mesh.lower) * mesh.perStep;
  GridBox g;
  g.lowerX = gridStep(lower.x - 1.0f);
  g.lowerY = gridStep(lower.y - 1.0f);
  g.lowerZ = gridStep(lower.z - 1.0f);
  g.upperX = gridStep(upper.x + 1.0f);
  g.upperY = gridStep(upper.y + 1.0f);
  g.upperZ = gridStep(upper.z + 1.0f);
  return g;
}

static int overlapsNode(GridBox g, MeshNode n) {
  return (g.lowerX <= n.x >> 16) & ((n.x & 0xffffu) <= g.upperX) & (g.lowerY <= n.y >> 16) &
         ((n.y & 0xffffu) <= g.upperY) & (g.lowerZ <= n.z >> 16) & ((n.z & 0xffffu) <= g.upperZ);
}

// TestTriangleAgainstAabb2
static int overlapsTriangle(Aabb box, float4 a, float4 b, float4 c) {
  Aabb of;
  of.lower = fmin(a, fmin(b, c));
  of.upper = fmax(a, fmax(b, c));
  return overlapAabb(box, of);
}

// Goes through the nodes [node, end) of the tree. Returns how many triangles it has found; notes the first `room`.
static uint searchNodes(CHECKS Aabb box, GridBox grid, uint node, uint end, uint firstTriangle,
                        __global const MeshNode* meshNodes, __global const MeshTriangle* meshTriangles, uint pair,
                        uint room, __global TriangleHit* hits) {
  uint found = 0;
  while (node < end) {
    const MeshNode n = AT(meshNodes, node);
    const int overlaps = overlapsNode(grid, n);
    if (n.link < 0) {
      node += overlaps ? 1 : (uint)-n.link;
      continue;
    }
    ++node;
    if (!overlaps) continue;
    const uint triangle = firstTriangle + (uint)n.link;
    if (!overlapsTriangle(box, AT(meshTriangles, triangle).a, AT(meshTriangles, triangle).b,
                          AT(meshTriangles, triangle).c))
      continue;
    if (found < room) {
      hits[found].pair = pair;
      hits[found].triangle = triangle;
    }
    ++found;
  }
  return found;
}

static uint search(CHECKS uint n, uint groups, __global const uint* bucketFirst, __global const uint* items,
                   __global const Pair* pairs, __global const BodyInfo* infos, __global const Shape* shapes,
                   __global const float4* hullVertices, __global const BodyPose* poses, __global const Mesh* meshes,
                   __global const MeshPart* meshParts, __global const MeshNode* meshNodes,
                   __global const MeshTriangle* meshTriangles, uint room,
                   __global TriangleHit* hits) {
  const uint k = n / groups, group = n % groups;
  const Pair pair = AT(pairs, AT(items, bucketFirst[BUCKET_MESH] + k));
  const Shape a = AT(shapes, AT(infos, pair.bodyA).shapeIndex), b = AT(shapes, AT(infos, pair.bodyB).shapeIndex);
  ASSERT(b.type == SHAPE_MESH, b.type, pair.bodyB);
  const Mesh mesh = AT(meshes, b.firstVertex);
  const uint first = (uint)((ulong)mesh.partCount * group / groups);
  const uint last = (uint)((ulong)mesh.partCount * (group + 1) / groups);
  if (first == last) return 0;
  const Aabb box = boxInMesh(a, AT(poses, pair.bodyA), AT(poses, pair.bodyB), b.margin, hullVertices);
  const MeshPart end = AT(meshParts, mesh.firstPart + last - 1);
  // One group has the whole tree, and its upper nodes too.
  const uint begin = groups == 1 ? 0 : (uint)AT(meshParts, mesh.firstPart + first).firstNode;
  return searchNodes(WITH_CHECKS box, gridBoxOf(box, mesh), (uint)mesh.firstNode + begin,
                     (uint)(mesh.firstNode + end.firstNode + end.nodeCount), (uint)mesh.firstTriangle, meshNodes,
                     meshTriangles, k, room, hits);
}

// found[n]: triangles that search n finds; kept: the first HITS_KEPT of them.
KERNEL countTriangles(CHECKS __global const uint* searchCount, uint searchCapacity, uint groups,
                      __global const uint* bucketFirst, __global const uint* items, __global const Pair* pairs,
                      __global const BodyInfo* infos, __global const Shape* shapes,
                      __global const float4* hullVertices, __global const BodyPose* poses,
                      __global const Mesh* meshes, __global const MeshPart* meshParts,
                      __global const MeshNode* meshNodes, __global const MeshTriangle* meshTriangles,
                      __global uint* found, __global TriangleHit* kept) {
  FOR_EACH(n, itemCount(searchCapacity, searchCount)) {
    AT(found, n) = search(WITH_CHECKS n, groups, bucketFirst, items, pairs, infos, shapes, hullVertices, poses, meshes,
                          meshParts, meshNodes, meshTriangles, HITS_KEPT, kept + (ulong)n * HITS_KEPT);
  }
}

// Writes them, search by search: those of search n from hitFirst[n] on. Only searches that found more than was kept are
// made once more. Also notes how many there are and whether they fit.
KERNEL emitTriangles(CHECKS __global const uint* searchCount, uint searchCapacity, uint groups, uint hitCapacity,
                     __global const uint* total, __global const uint* bucketFirst, __global const uint* items,
                     __global const Pair* pairs, __global const BodyInfo* infos, __global const Shape* shapes,
                     __global const float4* hullVertices, __global const BodyPose* poses, __global const Mesh* meshes,
                     __global const MeshPart* meshParts, __global const MeshNode* meshNodes,
                     __global const MeshTriangle* meshTriangles, __global const uint* found,
                     __global const uint* hitFirst, __global const TriangleHit* kept, __global StepCounters* counters,
                     __global TriangleHit* hits) {
  if (get_global_id(0) == 0) counters->triangleHits = *total;
  if (*total > hitCapacity) {
    if (get_global_id(0) == 0) counters->overflow |= OVERFLOW_TRIANGLES;
    return;
  }
  FOR_EACH(n, itemCount(searchCapacity, searchCount)) {
    const uint count = AT(found, n), to = AT(hitFirst, n);
    if (count > HITS_KEPT) {
      search(WITH_CHECKS n, groups, bucketFirst, items, pairs, infos, shapes, hullVertices, poses, meshes, meshParts,
             meshNodes, meshTriangles, count, hits + to);
      continue;
    }
    for (uint j = 0; j < count; ++j) AT(hits, to + j) = kept[(ulong)n * HITS_KEPT + j];
  }
}
