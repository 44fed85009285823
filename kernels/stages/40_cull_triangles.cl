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

#ifdef BTGPU_SHAPE_CPU
#define SEARCHES 4u         // that are made at once
#define LEAVES_WAITING 32u  // of a search
#endif

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
#ifdef BTGPU_SHAPE_CPU
  ushort8 limits;  // of a node's 16-bit words that overlaps: its upper bounds are turned round, so that more is too much
#else
  uint lowerX, lowerY, lowerZ, upperX, upperY, upperZ;
#endif
} GridBox;

static uint gridStep(float value) { return (uint)clamp(value, 0.0f, MESH_GRID); }

static GridBox gridBoxOf(Aabb box, Mesh mesh) {
  const float4 lower = (box.lower - mesh.lower) * mesh.perStep, upper = (box.upper - mesh.lower) * mesh.perStep;
  const uint lowerX = gridStep(lower.x - 1.0f), lowerY = gridStep(lower.y - 1.0f), lowerZ = gridStep(lower.z - 1.0f);
  const uint upperX = gridStep(upper.x + 1.0f), upperY = gridStep(upper.y + 1.0f), upperZ = gridStep(upper.z + 1.0f);
  GridBox g;
#ifdef BTGPU_SHAPE_CPU
  g.limits = (ushort8)((ushort)upperX, (ushort)~lowerX, (ushort)upperY, (ushort)~lowerY, (ushort)upperZ,
                       (ushort)~lowerZ, (ushort)0xffff, (ushort)0xffff);
#else
  g.lowerX = lowerX;
  g.lowerY = lowerY;
  g.lowerZ = lowerZ;
  g.upperX = upperX;
  g.upperY = upperY;
  g.upperZ = upperZ;
#endif
  return g;
}

static int overlapsNode(GridBox g, MeshNode n) {
#ifdef BTGPU_SHAPE_CPU
  const uint4 words = (uint4)(n.x, n.y, n.z, 0u) ^ (uint4)(0xffff0000u, 0xffff0000u, 0xffff0000u, 0u);
  const ulong2 over = as_ulong2(as_ushort8(words) > g.limits);
  return (over.x | over.y) == 0;
#else
  return (g.lowerX <= n.x >> 16) & ((n.x & 0xffffu) <= g.upperX) & (g.lowerY <= n.y >> 16) &
         ((n.y & 0xffffu) <= g.upperY) & (g.lowerZ <= n.z >> 16) & ((n.z & 0xffffu) <= g.upperZ);
#endif
}

// TestTriangleAgainstAabb2
static int overlapsTriangle(Aabb box, float4 a, float4 b, float4 c) {
  Aabb of;
  of.lower = fmin(a, fmin(b, c));
  of.upper = fmax(a, fmax(b, c));
  return overlapAabb(box, of);
}

// A way through the nodes [node, end) of a tree.
typedef struct TreeSearch {
  Aabb box;
  GridBox grid;
  uint pair, node, end, firstTriangle, found;
#ifdef BTGPU_SHAPE_CPU
  uint waiting;  // leaves whose triangles are yet to be looked at
  uint leaves[LEAVES_WAITING];
#endif
} TreeSearch;

static TreeSearch beginSearch(CHECKS uint n, uint groups, __global const uint* bucketFirst, __global const uint* items,
                              __global const Pair* pairs, __global const BodyInfo* infos, __global const Shape* shapes,
                              __global const float4* hullVertices, __global const BodyPose* poses,
                              __global const Mesh* meshes, __global const MeshPart* meshParts) {
  const uint k = n / groups, group = n % groups;
  const Pair pair = AT(pairs, AT(items, bucketFirst[BUCKET_MESH] + k));
  const Shape a = AT(shapes, AT(infos, pair.bodyA).shapeIndex), b = AT(shapes, AT(infos, pair.bodyB).shapeIndex);
  ASSERT(b.type == SHAPE_MESH, b.type, pair.bodyB);
  const Mesh mesh = AT(meshes, b.firstVertex);
  const uint first = (uint)((ulong)mesh.partCount * group / groups);
  const uint last = (uint)((ulong)mesh.partCount * (group + 1) / groups);
  TreeSearch s;
  s.pair = k;
  s.firstTriangle = (uint)mesh.firstTriangle;
  s.found = s.node = s.end = 0;
#ifdef BTGPU_SHAPE_CPU
  s.waiting = 0;
#endif
  if (first == last) return s;
  s.box = boxInMesh(a, AT(poses, pair.bodyA), AT(poses, pair.bodyB), b.margin, hullVertices);
  s.grid = gridBoxOf(s.box, mesh);
  const MeshPart end = AT(meshParts, mesh.firstPart + last - 1);
  // One group has the whole tree, and its upper nodes too.
  const uint begin = groups == 1 ? 0 : (uint)AT(meshParts, mesh.firstPart + first).firstNode;
  s.node = (uint)mesh.firstNode + begin;
  s.end = (uint)(mesh.firstNode + end.firstNode + end.nodeCount);
  return s;
}

// Counts a triangle if it overlaps the box; the first `room` are noted.
static void meetTriangle(CHECKS TreeSearch* s, uint leaf, __global const MeshTriangle* meshTriangles, uint room,
                         __global TriangleHit* hits) {
  const uint triangle = s->firstTriangle + leaf;
  if (!overlapsTriangle(s->box, AT(meshTriangles, triangle).a, AT(meshTriangles, triangle).b,
                        AT(meshTriangles, triangle).c))
    return;
  if (s->found < room) {
    hits[s->found].pair = s->pair;
    hits[s->found].triangle = triangle;
  }
  s->found += 1;
}

#ifdef BTGPU_SHAPE_CPU

// One node. Without branches: what comes next can't be guessed.
static inline void stepSearch(CHECKS TreeSearch* s, __global const MeshNode* meshNodes) {
  const MeshNode n = AT(meshNodes, s->node);
  const uint overlaps = (uint)overlapsNode(s->grid, n), isLeaf = n.link >= 0;
  s->leaves[s->waiting] = (uint)n.link;
  s->waiting += overlaps & isLeaf;
  s->node += overlaps | isLeaf ? 1 : (uint)-n.link;
}

static void meetLeaves(CHECKS TreeSearch* s, __global const MeshTriangle* meshTriangles, uint room,
                       __global TriangleHit* hits) {
  for (uint l = 0; l < s->waiting; ++l) meetTriangle(WITH_CHECKS s, s->leaves[l], meshTriangles, room, hits);
  s->waiting = 0;
}

// Of `count` searches side by side, a node of each in turn, so that none waits for the node of another. The triangles of
// search j go to hits[j * room].
static void searchTrees(CHECKS TreeSearch* searches, uint count, __global const MeshNode* meshNodes,
                        __global const MeshTriangle* meshTriangles, uint room, __global TriangleHit* hits) {
  uint open = 1;
  while (open) {
    open = 0;
    for (uint j = 0; j < count; ++j) {
      TreeSearch* s = &searches[j];
      if (s->node >= s->end) continue;
      stepSearch(WITH_CHECKS s, meshNodes);
      open = 1;
      if (s->waiting == LEAVES_WAITING) meetLeaves(WITH_CHECKS s, meshTriangles, room, hits + j * room);
    }
  }
  for (uint j = 0; j < count; ++j) meetLeaves(WITH_CHECKS &searches[j], meshTriangles, room, hits + j * room);
}

#else

#define SEARCHES 1u
static void searchTrees(CHECKS TreeSearch* s, uint count, __global const MeshNode* meshNodes,
                        __global const MeshTriangle* meshTriangles, uint room, __global TriangleHit* hits) {
  while (s->node < s->end) {
    const MeshNode n = AT(meshNodes, s->node);
    const int overlaps = overlapsNode(s->grid, n);
    if (n.link < 0) {
      s->node += overlaps ? 1 : (uint)-n.link;
      continue;
    }
    s->node += 1;
    if (overlaps) meetTriangle(WITH_CHECKS s, (uint)n.link, meshTriangles, room, hits);
  }
}

#endif

// found[n]: triangles that search n finds; kept: the first HITS_KEPT of them.
KERNEL countTriangles(CHECKS __global const uint* searchCount, uint searchCapacity, uint groups,
                      __global const uint* bucketFirst, __global const uint* items, __global const Pair* pairs,
                      __global const BodyInfo* infos, __global const Shape* shapes,
                      __global const float4* hullVertices, __global const BodyPose* poses,
                      __global const Mesh* meshes, __global const MeshPart* meshParts,
                      __global const MeshNode* meshNodes, __global const MeshTriangle* meshTriangles,
                      __global uint* found, __global TriangleHit* kept) {
  TreeSearch searches[SEARCHES];
  FOR_EACH(n, itemCount(searchCapacity, searchCount)) {
#ifdef BTGPU_SHAPE_CPU
    const uint count = min(SEARCHES, n_end - n);
#else
    const uint count = 1;
#endif
    for (uint j = 0; j < count; ++j) {
      searches[j] = beginSearch(WITH_CHECKS n + j, groups, bucketFirst, items, pairs, infos, shapes, hullVertices,
                                poses, meshes, meshParts);
    }
    searchTrees(WITH_CHECKS searches, count, meshNodes, meshTriangles, HITS_KEPT, kept + (ulong)n * HITS_KEPT);
    for (uint j = 0; j < count; ++j) AT(found, n + j) = searches[j].found;
    n += count - 1;
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
      TreeSearch again = beginSearch(WITH_CHECKS n, groups, bucketFirst, items, pairs, infos, shapes, hullVertices, poses,
                                     meshes, meshParts);
      searchTrees(WITH_CHECKS &again, 1, meshNodes, meshTriangles, count, hits + to);
      continue;
    }
    for (uint j = 0; j < count; ++j) AT(hits, to + j) = kept[(ulong)n * HITS_KEPT + j];
  }
}
