// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Contacts of shapes with the triangles of meshes, a work item a triangle. Built for spheres (BTGPU_SPHERES), for
// curved shapes (BTGPU_CURVED) and for all others, so that a world builds only what it uses; each leaves the others'
// triangles alone.
#define BTGPU_TRIANGLE_CORES
#include "../lib/convex_clip.h"
#ifndef BTGPU_SPHERES
#include "../lib/closest_cores.h"
#endif
#if defined(BTGPU_SHAPE_CPU) && !defined(BTGPU_SPHERES)
#include "../lib/triangle_wide.h"
#define GJK_IN_BLOCKS
#endif
#include "../lib/contact_threshold.h"
#include "../lib/kernel.h"
#include "../lib/triangle.h"
#include "../shared/body.h"

// What the triangles of a pair have in common.
typedef struct MeshPair {
  Shape a, mesh;
  Matrix3 ra, turn;  // A's axes to the world's, B's axes to A's
  float4 offset;     // B's position, in A's axes
  float threshold;
} MeshPair;

static MeshPair meshPairOf(CHECKS Pair pair, __global const BodyInfo* infos, __global const Shape* shapes,
                           __global const BodyPose* poses, __global const Manifold* oldManifolds) {
  MeshPair m;
  m.a = AT(shapes, AT(infos, pair.bodyA).shapeIndex);
  m.mesh = AT(shapes, AT(infos, pair.bodyB).shapeIndex);
  const BodyPose poseA = AT(poses, pair.bodyA), poseB = AT(poses, pair.bodyB);
  const Matrix3 rb = matrixFromQuaternion(poseB.orientation);
  m.ra = matrixFromQuaternion(poseA.orientation);
  m.turn.row0 = mulTransposed(rb, matrixColumn(m.ra, 0));
  m.turn.row1 = mulTransposed(rb, matrixColumn(m.ra, 1));
  m.turn.row2 = mulTransposed(rb, matrixColumn(m.ra, 2));
  m.offset = mulTransposed(m.ra, poseB.position - poseA.position);
  m.threshold = contactThreshold(WITH_CHECKS pair, infos, shapes, oldManifolds);
  return m;
}

#ifndef GJK_IN_BLOCKS
static Triangle triangleInA(const MeshPair* m, MeshTriangle t) {
  return makeTriangle(m->offset + mulMatrix(m->turn, t.a), m->offset + mulMatrix(m->turn, t.b),
                      m->offset + mulMatrix(m->turn, t.c));
}
#endif

#ifdef BTGPU_SPHERES

static int isMine(Shape a) { return a.type == SHAPE_SPHERE; }

static void collide(const MeshPair* m, Triangle t, Hulls hulls, RawContacts* raw) {
  float4 normal, point;
  if (!collideSphereTriangle(m->a.extents.x, t, m->threshold, &normal, &point)) return;
  raw->normal = mulMatrix(m->ra, normal);
  addRaw(raw, mulMatrix(m->ra, point), point.w);
}

#else

#ifdef BTGPU_CURVED
static int isMine(Shape a) { return isCurvedShape(a.type); }
#else
static int isMine(Shape a) { return a.type != SHAPE_SPHERE && !isCurvedShape(a.type); }
#endif

// 0 if A's own box (a capsule's and a hull's too) and the triangle are farther apart than the limit along an axis of the
// box, the triangle's normal, or across one of its sides: most triangles go so, since the box in the mesh's axes that
// found them is wider. `at`: the middle of the box.
static int mayTouch(float4 halfExtents, float4 at, Triangle t, float limit) {
  const float4 a = t.a - at, b = t.b - at, c = t.c - at;
  const float4 reach = halfExtents + vec3(limit, limit, limit), lower = fmin(a, fmin(b, c)), upper = fmax(a, fmax(b, c));
  if (lower.x > reach.x || lower.y > reach.y || lower.z > reach.z || upper.x < -reach.x || upper.y < -reach.y ||
      upper.z < -reach.z)
    return 0;
  const float4 normal = xyz(t.plane);
  if (fabs(dot3(normal, a)) > dot3(abs3(normal), halfExtents) + limit) return 0;
  const float4 ab = cross3(b - a, normal), bc = cross3(c - b, normal), ca = cross3(a - c, normal);  // outward
  const float gapAb = -dot3(ab, a) - dot3(abs3(ab), halfExtents), gapBc = -dot3(bc, b) - dot3(abs3(bc), halfExtents),
              gapCa = -dot3(ca, c) - dot3(abs3(ca), halfExtents);
  const float limitSqr = limit * limit;
  return !((gapAb > 0.0f && gapAb * gapAb > limitSqr * dot3(ab, ab)) ||
           (gapBc > 0.0f && gapBc * gapBc > limitSqr * dot3(bc, bc)) ||
           (gapCa > 0.0f && gapCa * gapCa > limitSqr * dot3(ca, ca)));
}

// What there is to know of a hit that may have contacts.
typedef struct NearHit {
  CorePair cores;
  float4 start;  // from A's middle towards the plane
  float limit;
} NearHit;

// Of A's own box.
static float4 halfExtentsOf(const MeshPair* m) {
  // Of a capsule only the extents are without the margin.
  const float radius = m->a.type == SHAPE_CAPSULE ? m->a.margin : 0.0f;
  return xyz(m->a.extents) + vec3(radius, radius, radius);
}

static int mayBeNear(const MeshPair* m, Triangle t) {
  return mayTouch(halfExtentsOf(m), m->a.centre, t, m->mesh.margin + m->threshold);
}

static NearHit nearHitOf(const MeshPair* m, Triangle t) {
  NearHit hit;
  hit.limit = m->a.margin + m->mesh.margin + m->threshold;
  hit.cores.a = coreOf(m->a);
  hit.cores.b = triangleCore(t, m->mesh.margin);
  hit.cores.turn.row0 = vec3(1.0f, 0.0f, 0.0f);
  hit.cores.turn.row1 = vec3(0.0f, 1.0f, 0.0f);
  hit.cores.turn.row2 = vec3(0.0f, 0.0f, 1.0f);
  hit.cores.offset = vec3(0.0f, 0.0f, 0.0f);
  hit.cores.size = length3(m->a.centre) + length3(hit.cores.a.extents) + t.size;
  hit.start = t.plane.w - dot3(t.plane, m->a.centre) < 0.0f ? -xyz(t.plane) : xyz(t.plane);
  return hit;
}

// How far A reaches along a direction, as Bullet's localGetSupportingVertex has it: boxes have their corners.
static float reachOf(const MeshPair* m, Core core, Hulls hulls, float4 direction) {
  if (m->a.type == SHAPE_BOX || hasVariant(m->a, HULL_BOX))
    return dot3(direction, m->a.centre) + dot3(abs3(direction), m->a.extents);
  return dot3(direction, coreSupportPoint(core, hulls, direction)) + core.margin;
}

// btConvexTriangleCallback leaves alone what is farther from a triangle's plane than the contact threshold, though the
// mesh's margin reaches it. Without a margin that goes without saying.
static int isOffPlane(const MeshPair* m, Core core, Triangle t, Hulls hulls) {
  if (!(m->mesh.margin > 0.0f)) return 0;
  const float4 normal = xyz(t.plane);
  return -reachOf(m, core, hulls, -normal) - t.plane.w > m->threshold ||
         t.plane.w - reachOf(m, core, hulls, normal) > m->threshold;
}

// Contacts, once it is known where the two are closest.
static void collideCores(CorePair cores, Hulls hulls, int what, ClosestFeatures found, Matrix3 ra, float threshold,
                         RawContacts* raw) {
  if (what == CORES_FAR) return;
  if (what == CORES_NEAR) preferFaces(cores, hulls, &found);
  if (what == CORES_OVERLAP) found = wayOutOf(cores, hulls);
  collideConvex(cores, hulls, found, ra, threshold, raw);
}

#ifndef GJK_IN_BLOCKS
static void collide(const MeshPair* m, Triangle t, Hulls hulls, RawContacts* raw) {
  if (!mayBeNear(m, t)) return;
  const NearHit hit = nearHitOf(m, t);
  if (isOffPlane(m, hit.cores.a, t, hulls)) return;
  ClosestFeatures found = nothingFound();
  const int what = closestCores(hit.cores, hulls, hit.start, hit.limit, &found);
  collideCores(hit.cores, hulls, what, found, m->ra, m->threshold, raw);
}
#endif

#endif

static void storeTouches(CHECKS const RawContacts* raw, uint h, __global TriangleContacts* touches) {
  ASSERT(raw->count >= 0 && raw->count <= TRIANGLE_POINTS, raw->count, h);
  ASSERT_FLOATS(raw->count == 0 || isUnit(raw->normal), raw->normal.x, raw->normal.y);
  AT(touches, h).normal = withW(raw->normal, (float)raw->count);
  UNROLL
  for (int k = 0; k < TRIANGLE_POINTS; ++k) {
    if (k < raw->count) AT(touches, h).points[k] = raw->points[k];
  }
}

#ifdef GJK_IN_BLOCKS

// Hits that wait for GJK, and what their contacts take.
typedef struct HitBlock {
  GjkBlock gjk;
  uint hits[BTGPU_WIDE];
  Matrix3 ra[BTGPU_WIDE];
  float thresholds[BTGPU_WIDE];
} HitBlock;

static void collideBlock(CHECKS HitBlock* block, Hulls hulls, __global TriangleContacts* touches) {
  closestWide(&block->gjk, hulls);
  for (int l = 0; l < block->gjk.count; ++l) {
    RawContacts raw = noContacts();
    collideCores(block->gjk.pairs[l], hulls, block->gjk.what[l], block->gjk.found[l], block->ra[l],
                 block->thresholds[l], &raw);
    storeTouches(WITH_CHECKS &raw, block->hits[l], touches);
  }
  block->gjk.count = 0;
}

// The contacts of a hit that may have some, or its place in the block.
static void collideOrWait(CHECKS const MeshPair* m, Triangle t, uint h, Hulls hulls, HitBlock* block,
                          __global TriangleContacts* touches) {
  RawContacts raw = noContacts();
  const NearHit hit = nearHitOf(m, t);
  ClosestFeatures found = nothingFound();
  ClosestBegun begun;
  const int what = isOffPlane(m, hit.cores.a, t, hulls)
                       ? CORES_FAR
                       : beginCores(hit.cores, hulls, hit.start, hit.limit, &begun, &found);
  if (what == CORES_OPEN) {
    const int l = block->gjk.count;
    block->hits[l] = h;
    block->ra[l] = m->ra;
    block->thresholds[l] = m->threshold;
    addToBlock(&block->gjk, &hit.cores, hit.limit, begun);
    if (block->gjk.count == BTGPU_WIDE) collideBlock(WITH_CHECKS block, hulls, touches);
    return;
  }
  collideCores(hit.cores, hulls, what, found, m->ra, m->threshold, &raw);
  storeTouches(WITH_CHECKS &raw, h, touches);
}

// Hits h, h + 1, ... of one pair, at most BTGPU_WIDE and none beyond `end`; returns how many.
static uint collideRun(CHECKS const MeshPair* m, uint h, uint end, __global const TriangleHit* hits, Hulls hulls,
                       __global const MeshTriangle* meshTriangles, HitBlock* block,
                       __global TriangleContacts* touches) {
  uint index[BTGPU_WIDE];
  const uint pair = AT(hits, h).pair;
  uint count = 0;
  while (count < BTGPU_WIDE && h + count < end && AT(hits, h + count).pair == pair) {
    index[count] = AT(hits, h + count).triangle;
    ASSERT(index[count] < LENGTH(meshTriangles), index[count], h + count);
    ++count;
  }
  for (uint l = count; l < BTGPU_WIDE; ++l) index[l] = index[0];
  WideTriangles triangles;
  trianglesWide(meshTriangles, index, m->turn, m->offset, halfExtentsOf(m), m->a.centre, m->mesh.margin + m->threshold,
                &triangles);
  const RawContacts none = noContacts();
  for (uint l = 0; l < count; ++l) {
    if (triangles.mayTouch[l]) {
      const Triangle t = triangleOf(&triangles, (int)l);
      if (!triangles.slivers[l] || mayBeNear(m, t)) {
        collideOrWait(WITH_CHECKS m, t, h + l, hulls, block, touches);
        continue;
      }
    }
    storeTouches(WITH_CHECKS &none, h + l, touches);
  }
  return count;
}

#endif

KERNEL collideTriangles(CHECKS __global const StepCounters* counters, __global const uint* bucketFirst,
                        __global const uint* items, __global const Pair* pairs, __global const BodyInfo* infos,
                        __global const Shape* shapes, __global const BodyPose* poses,
                        __global const Manifold* oldManifolds, __global const float4* hullVertices,
                        __global const HullFace* hullFaces, __global const uint* hullCorners,
                        __global const HullEdge* hullEdges, __global const MeshTriangle* meshTriangles,
                        __global const TriangleHit* hits, __global TriangleContacts* touches) {
  RETURN_ON_OVERFLOW(counters);
  const Hulls hulls = hullsOf(hullVertices, hullFaces, hullCorners, hullEdges);
  uint known = NO_INDEX;
  int mine = 0;
  MeshPair pair;
#ifdef GJK_IN_BLOCKS
  HitBlock block;
  block.gjk.count = 0;
#endif
  FOR_EACH(h, counters->triangleHits) {
    const TriangleHit hit = AT(hits, h);
    if (hit.pair != known) {
      known = hit.pair;
      const Pair bodies = AT(pairs, AT(items, bucketFirst[BUCKET_MESH] + known));
      mine = isMine(AT(shapes, AT(infos, bodies.bodyA).shapeIndex));
      if (mine) pair = meshPairOf(WITH_CHECKS bodies, infos, shapes, poses, oldManifolds);
    }
    if (!mine) continue;
#ifdef GJK_IN_BLOCKS
    h += collideRun(WITH_CHECKS &pair, h, h_end, hits, hulls, meshTriangles, &block, touches) - 1;
#else
    RawContacts raw = noContacts();
    collide(&pair, triangleInA(&pair, AT(meshTriangles, hit.triangle)), hulls, &raw);
    storeTouches(WITH_CHECKS &raw, h, touches);
#endif
  }
#ifdef GJK_IN_BLOCKS
  if (block.gjk.count > 0) collideBlock(WITH_CHECKS &block, hulls, touches);
#endif
}
