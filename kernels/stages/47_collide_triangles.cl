// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Contacts of shapes with the triangles of meshes, a work item a triangle. Built for spheres (BTGPU_SPHERES), for
// curved shapes (BTGPU_CURVED) and for all others, so that a world builds only what it uses; each leaves the others'
// triangles alone.
#define BTGPU_TRIANGLE_CORES
#include "../lib/convex_clip.h"
#ifdef BTGPU_CURVED
#include "../lib/curved.h"
#else
#include "../lib/convex_sat.h"
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

static Triangle triangleInA(const MeshPair* m, MeshTriangle t) {
  return makeTriangle(m->offset + mulMatrix(m->turn, t.a), m->offset + mulMatrix(m->turn, t.b),
                      m->offset + mulMatrix(m->turn, t.c));
}

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

static void collide(const MeshPair* m, Triangle t, Hulls hulls, RawContacts* raw) {
  // Of a capsule only the extents are without the margin.
  const float radius = m->a.type == SHAPE_CAPSULE ? m->a.margin : 0.0f;
  const float4 halfExtents = xyz(m->a.extents) + vec3(radius, radius, radius);
  if (!mayTouch(halfExtents, m->a.centre, t, m->mesh.margin + m->threshold)) return;
  const float limit = m->a.margin + m->mesh.margin + m->threshold;
  CorePair cores;
  cores.a = coreOf(m->a);
  cores.b = triangleCore(t, m->mesh.margin);
  cores.turn.row0 = vec3(1.0f, 0.0f, 0.0f);
  cores.turn.row1 = vec3(0.0f, 1.0f, 0.0f);
  cores.turn.row2 = vec3(0.0f, 0.0f, 1.0f);
  cores.offset = vec3(0.0f, 0.0f, 0.0f);
  cores.size = length3(m->a.centre) + length3(cores.a.extents) + t.size;
  // From A's middle towards the plane.
  const float4 start = t.plane.w - dot3(t.plane, m->a.centre) < 0.0f ? -xyz(t.plane) : xyz(t.plane);
  ClosestFeatures found;
  found.normal = found.onA = found.onB = vec3(0.0f, 0.0f, 0.0f);
#ifdef BTGPU_CURVED
  const int what = closestCurved(cores, hulls, start, limit, &found);
  if (what == CORES_FAR) return;
  if (what == CORES_NEAR) preferFlat(cores, hulls, FACE_AS_GOOD * cores.size, &found);
  if (what == CORES_OVERLAP) found = shortestCurvedWayOut(cores, hulls);
#else
  const int what = closestFeatures(cores, hulls, start, limit, &found);
  if (what == CORES_FAR) return;
  if (what == CORES_NEAR) preferFace(cores, hulls, &found);
  if (what == CORES_OVERLAP) found = shortestWayOut(cores, hulls);
#endif
  collideConvex(cores, hulls, found, m->ra, m->threshold, raw);
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
  Hulls hulls;
  hulls.vertices = hullVertices;
  hulls.faces = hullFaces;
  hulls.corners = hullCorners;
  hulls.edges = hullEdges;
  uint known = NO_INDEX;
  MeshPair pair;
  FOR_EACH(h, counters->triangleHits) {
    const TriangleHit hit = AT(hits, h);
    if (hit.pair != known) {
      known = hit.pair;
      pair = meshPairOf(WITH_CHECKS AT(pairs, AT(items, bucketFirst[BUCKET_MESH] + known)), infos, shapes, poses,
                        oldManifolds);
    }
    if (!isMine(pair.a)) continue;
    RawContacts raw = noContacts();
    collide(&pair, triangleInA(&pair, AT(meshTriangles, hit.triangle)), hulls, &raw);
    ASSERT(raw.count >= 0 && raw.count <= TRIANGLE_POINTS, raw.count, h);
    ASSERT_FLOATS(raw.count == 0 || isUnit(raw.normal), raw.normal.x, raw.normal.y);
    AT(touches, h).normal = withW(raw.normal, (float)raw.count);
    UNROLL
    for (int k = 0; k < TRIANGLE_POINTS; ++k) {
      if (k < raw.count) AT(touches, h).points[k] = raw.points[k];
    }
  }
}
