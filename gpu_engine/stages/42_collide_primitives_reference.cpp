// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "42_collide_primitives_reference.h"

#include <algorithm>

#include "44_find_closest_features_reference.h"
#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kEpsilon = 1.1920929e-7;  // SIMD_EPSILON in a float build of Bullet

void add(RawContacts& raw, Vec pointOnB, double distance) { raw.points[raw.count++] = toFloat4(pointOnB, distance); }

// btSphereSphereCollisionAlgorithm::processCollision
void sphereSphere(const Shape& a, const Shape& b, Vec bFromA, RawContacts& raw) {
  const double apart = length(bFromA), reach = static_cast<double>(a.extents.x) + b.extents.x;
  if (apart > reach) return;
  const Vec normal = apart > kEpsilon ? -bFromA / apart : Vec{1, 0, 0};
  raw.normal = toFloat4(normal);
  add(raw, bFromA + normal * b.extents.x, apart - reach);
}

struct Plane {
  Vec normal;
  double constant;
};

// B's plane in world axes, seen from A's centre.
Plane planeFromA(const Shape& plane, const BodyPose& pose, Vec bFromA) {
  const Vec normal = rotationOf(pose.orientation) * toVec(plane.extents);
  return {normal, plane.extents.w + dot(normal, bFromA)};
}

// btConvexPlaneCollisionAlgorithm::processCollision for the point of A (from A's centre) that is asked for.
void pointPlane(Vec pointOnA, const Plane& plane, double threshold, RawContacts& raw) {
  const double distance = dot(plane.normal, pointOnA) - plane.constant;
  if (distance < threshold) add(raw, pointOnA - plane.normal * distance, distance);
}

// The sphere's centre and the result are in the box's axes, from the box's centre.
struct Nearest {
  Vec normal, point;  // out of the box; on the box
  double distance;    // of the two surfaces
};

Nearest sphereToBox(Vec centre, double radius, Vec half, double margin) {
  Vec offset;
  for (int k = 0; k < 3; ++k) {
    const double core = half[k] - margin;
    if (centre[k] > core) offset[k] = centre[k] - core;
    if (centre[k] < -core) offset[k] = centre[k] + core;
  }
  const double gap = length(offset);
  if (gap > kEpsilon) {
    const Vec normal = offset / gap;
    return {normal, centre - offset + normal * margin, gap - margin - radius};
  }
  // The centre is in the box: it leaves by the nearest face.
  double nearest = INFINITY;
  Vec normal;
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const double depth = half[k] - sign * centre[k];
      if (depth >= nearest) continue;
      nearest = depth;
      normal = {};
      normal[k] = sign;
    }
  }
  return {normal, centre + normal * nearest, -nearest - radius};
}

void sphereBox(const Shape& a, const BodyPose& poseA, const Shape& b, const BodyPose& poseB, Vec bFromA,
               double threshold, RawContacts& raw) {
  const bool boxIsB = b.type == SHAPE_BOX;
  const Shape &box = boxIsB ? b : a, &sphere = boxIsB ? a : b;
  const Matrix r = rotationOf(boxIsB ? poseB.orientation : poseA.orientation);
  const Vec sphereFromBox = boxIsB ? -bFromA : bFromA;
  const Nearest near = sphereToBox(transposed(r) * sphereFromBox, sphere.extents.x, toVec(box.extents), box.margin);
  if (near.distance >= threshold) return;
  const Vec outOfBox = r * near.normal;
  raw.normal = toFloat4(boxIsB ? outOfBox : -outOfBox);
  const Vec onSphere = sphereFromBox - outOfBox * sphere.extents.x;  // from the box's centre
  add(raw, boxIsB ? bFromA + r * near.point : onSphere, near.distance);
}

// Spheres and capsules: points and segments with radii (btConvexConvexAlgorithm, capsuleCapsuleDistance).
void capsules(const Shape& a, const BodyPose& poseA, const Shape& b, const BodyPose& poseB, Vec bFromA,
              double threshold, RawContacts& raw) {
  const ClosestCores c = closestCoresReference(placed(polytopeOf(a, {}), rotationOf(poseA.orientation), {}),
                                               placed(polytopeOf(b, {}), rotationOf(poseB.orientation), bFromA));
  const double distance = c.separation - a.margin - b.margin;
  if (distance >= threshold) return;
  raw.normal = toFloat4(-c.normal);
  add(raw, c.onB - c.normal * b.margin, distance);
}

}  // namespace

RawContacts collidePrimitivesReference(uint bucket, const Shape& a, const BodyPose& poseA, const Shape& b,
                                       const BodyPose& poseB, float threshold) {
  const Vec bFromA = toVec(poseB.position) - toVec(poseA.position);
  RawContacts raw{};
  if (bucket == BUCKET_SPHERE_SPHERE) sphereSphere(a, b, bFromA, raw);
  if (bucket == BUCKET_SPHERE_BOX) sphereBox(a, poseA, b, poseB, bFromA, threshold, raw);
  if (bucket == BUCKET_CAPSULES) { capsules(a, poseA, b, poseB, bFromA, threshold, raw); }
  if (bucket == BUCKET_CAPSULE_PLANE) {
    const Plane plane = planeFromA(b, poseB, bFromA);
    raw.normal = toFloat4(plane.normal);
    Vec end = rotationOf(poseA.orientation) * toVec(a.extents);
    if (dot(end, plane.normal) < 0) end = -end;
    if (2 * length(end) > threshold) pointPlane(end - plane.normal * a.margin, plane, threshold, raw);
    pointPlane(-end - plane.normal * a.margin, plane, threshold, raw);
  }
  if (bucket == BUCKET_SPHERE_PLANE || bucket == BUCKET_BOX_PLANE) {
    const Plane plane = planeFromA(b, poseB, bFromA);
    raw.normal = toFloat4(plane.normal);
    if (bucket == BUCKET_SPHERE_PLANE) pointPlane(plane.normal * -a.extents.x, plane, threshold, raw);
    for (int corner = 0; bucket == BUCKET_BOX_PLANE && corner < 8; ++corner) {
      Vec p = toVec(a.extents);
      for (int k = 0; k < 3; ++k) p[k] *= corner >> k & 1 ? 1 : -1;
      pointPlane(rotationOf(poseA.orientation) * p, plane, threshold, raw);
    }
  }
  return raw;
}

void collidePrimitivesReference(const std::vector<Pair>& pairs, const std::vector<BodyInfo>& infos,
                                const std::vector<Shape>& shapes, const std::vector<BodyPose>& poses,
                                const std::vector<Manifold>& oldManifolds, std::vector<RawContacts>& contacts) {
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Pair& p = pairs[i];
    const bool isPrimitive = (p.bucket >= BUCKET_SPHERE_SPHERE && p.bucket <= BUCKET_SPHERE_BOX) ||
                             (p.bucket >= BUCKET_CAPSULES && p.bucket <= BUCKET_CAPSULE_PLANE);
    if (!isPrimitive) continue;
    const Shape& a = shapes[static_cast<size_t>(infos[p.bodyA].shapeIndex)];
    const Shape& b = shapes[static_cast<size_t>(infos[p.bodyB].shapeIndex)];
    const float threshold = p.oldManifold != NO_INDEX ? oldManifolds[p.oldManifold].breakingThreshold
                                                      : std::min(a.breakingThreshold, b.breakingThreshold);
    contacts[i] = collidePrimitivesReference(p.bucket, a, poses[p.bodyA], b, poses[p.bodyB], threshold);
  }
}

}  // namespace btgpu
