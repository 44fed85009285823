// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Contacts of the analytic shape pairs, one kernel a bucket. items[] lists the pairs bucket by bucket,
// bucketFirst[] where each bucket begins. Built with BTGPU_BUCKET, so that a world builds only what it uses.
#include "../lib/collide.h"
#include "../lib/contact_threshold.h"
#include "../lib/kernel.h"
#include "../lib/pick_points.h"
#if BTGPU_BUCKET == BUCKET_HULL_PLANE
#include "../lib/hull_plane.h"
#endif
#if BTGPU_BUCKET == BUCKET_CURVED_PLANE
#define BTGPU_CURVED
#include "../lib/curved_plane.h"
#endif

#if BTGPU_BUCKET == BUCKET_SPHERE_PLANE || BTGPU_BUCKET == BUCKET_BOX_PLANE || \
    BTGPU_BUCKET == BUCKET_CAPSULE_PLANE || BTGPU_BUCKET == BUCKET_HULL_PLANE || BTGPU_BUCKET == BUCKET_CURVED_PLANE
// The plane of B in world axes, constant from B's position.
static float4 planeInWorld(Shape plane, BodyPose pose) {
  return withW(rotate(pose.orientation, plane.extents), plane.extents.w);
}
#endif

#if BTGPU_BUCKET == BUCKET_CAPSULES || BTGPU_BUCKET == BUCKET_CAPSULE_PLANE
// A capsule's axis in the world and half the length of its segment; a sphere has no length.
static float segmentLength(Shape s) { return s.type == SHAPE_CAPSULE ? s.extents.x + s.extents.y + s.extents.z : 0.0f; }
static float4 segmentAxis(Shape s, BodyPose pose) {
  const int axis = s.type != SHAPE_CAPSULE || s.extents.y > 0.0f ? 1 : (s.extents.z > 0.0f ? 2 : 0);
  return matrixColumn(matrixFromQuaternion(pose.orientation), axis);
}
#endif

static void collide(Shape a, Shape b, BodyPose poseA, BodyPose poseB, float threshold,
                    __global const float4* hullVertices, RawContacts* raw) {
  const float4 bFromA = poseB.position - poseA.position;
#if BTGPU_BUCKET == BUCKET_SPHERE_SPHERE
  collideSphereSphere(a.extents.x, b.extents.x, bFromA, raw);
#elif BTGPU_BUCKET == BUCKET_SPHERE_PLANE
  collideSpherePlane(a.extents.x, planeInWorld(b, poseB), bFromA, threshold, raw);
#elif BTGPU_BUCKET == BUCKET_BOX_PLANE
  collideBoxPlane(a.extents, matrixFromQuaternion(poseA.orientation), planeInWorld(b, poseB), bFromA, threshold, raw);
#elif BTGPU_BUCKET == BUCKET_SPHERE_BOX
  const int sphereIsA = a.type == SHAPE_SPHERE;
  const Matrix3 rotation = matrixFromQuaternion(sphereIsA ? poseB.orientation : poseA.orientation);
  collideSphereBox(sphereIsA, sphereIsA ? a : b, sphereIsA ? b : a, rotation, bFromA, threshold, raw);
#elif BTGPU_BUCKET == BUCKET_CAPSULES
  collideCapsules(segmentAxis(a, poseA), segmentLength(a), a.margin, segmentAxis(b, poseB), segmentLength(b), b.margin,
                  bFromA, threshold, raw);
#elif BTGPU_BUCKET == BUCKET_CAPSULE_PLANE
  collideCapsulePlane(segmentAxis(a, poseA), segmentLength(a), a.margin, planeInWorld(b, poseB), bFromA, threshold,
                      raw);
#elif BTGPU_BUCKET == BUCKET_HULL_PLANE
  collideHullPlane(a, hullVertices, matrixFromQuaternion(poseA.orientation), planeInWorld(b, poseB), bFromA, threshold,
                   raw);
#elif BTGPU_BUCKET == BUCKET_CURVED_PLANE
  collideCurvedPlane(a, hullVertices, matrixFromQuaternion(poseA.orientation), planeInWorld(b, poseB), bFromA,
                     threshold, raw);
#endif
}

KERNEL collidePrimitives(CHECKS __global const StepCounters* counters, __global const uint* bucketFirst,
                         __global const uint* items, __global const Pair* pairs, __global const BodyInfo* infos,
                         __global const Shape* shapes, __global const BodyPose* poses,
                         __global const Manifold* oldManifolds, __global const float4* hullVertices,
                         __global RawContacts* contacts) {
  RETURN_ON_OVERFLOW(counters);
  const uint first = bucketFirst[BTGPU_BUCKET];
  ASSERT(first <= bucketFirst[BTGPU_BUCKET + 1], first, bucketFirst[BTGPU_BUCKET + 1]);
  FOR_EACH(k, bucketFirst[BTGPU_BUCKET + 1] - first) {
    const uint i = AT(items, first + k);
    const Pair pair = AT(pairs, i);
    const Shape a = AT(shapes, AT(infos, pair.bodyA).shapeIndex), b = AT(shapes, AT(infos, pair.bodyB).shapeIndex);
    ASSERT(a.type != SHAPE_HULL || (uint)(a.firstVertex + a.vertexCount) <= LENGTH(hullVertices), a.firstVertex,
           a.vertexCount);
    RawContacts raw = noContacts();
    collide(a, b, AT(poses, pair.bodyA), AT(poses, pair.bodyB),
            contactThreshold(WITH_CHECKS pair, infos, shapes, oldManifolds), hullVertices, &raw);
    ASSERT(raw.count >= 0 && raw.count <= RAW_POINTS, raw.count, i);
    AT(contacts, i) = raw;
  }
}
