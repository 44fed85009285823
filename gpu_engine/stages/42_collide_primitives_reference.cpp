// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "42_collide_primitives_reference.h"

#include <algorithm>
#include <cstring>

#include "44_find_closest_features_reference.h"
#include "curved_reference.h"
#include "pick_points_reference.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kEpsilon = 1.1920929e-7;  // SIMD_EPSILON in a float build of Bullet

void add(RawContacts& raw, Vec pointOnB, double distance) { raw.points[raw.count++] = toFloat4(pointOnB, distance); }

// btSphereSphereCollisionAlgorithm::processCollision
void sphereSphere(const Shape& a, const Shape& b, Vec bFromA, double slack, RawContacts& raw) {
  const double apart = length(bFromA), reach = static_cast<double>(a.extents.x) + b.extents.x;
  if (apart > reach + slack) return;
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

// What is a hull to others, and a box to planes.
uint bucketOnPlane(uint bucket, const Shape& a) {
  return bucket == BUCKET_HULL_PLANE && (a.variant & HULL_BOX) ? BUCKET_BOX_PLANE : bucket;
}

bool isPrimitive(uint bucket) {
  return (bucket >= BUCKET_SPHERE_SPHERE && bucket <= BUCKET_SPHERE_BOX) ||
         (bucket >= BUCKET_CAPSULES && bucket <= BUCKET_HULL_PLANE);
}

// All vertices of hull A over plane B.
std::vector<PickCandidate> verticesOverPlane(const Shape& a, const BodyPose& poseA, const Plane& plane,
                                             const HullArrays& hulls) {
  std::vector<PickCandidate> out;
  const Matrix rotation = rotationOf(poseA.orientation);
  for (const Vec local : polytopeOf(a, hulls).vertices) {
    const Vec vertex = rotation * local;
    const double height = dot(plane.normal, vertex) - plane.constant;
    out.push_back({vertex - plane.normal * height, height - a.margin});
  }
  return out;
}

PickRules rulesFor(const Shape& hull, const Plane& plane, double threshold) {
  constexpr double kSlack = 1e-5;  // HULL_PLANE_SLACK
  const double size = length(toVec(hull.centre)) + length(toVec(hull.extents));
  return {plane.normal, threshold, kSlack * size, threshold};
}

// btConvexPlaneCollisionAlgorithm takes the deepest vertex a step.
void hullPlane(const Shape& a, const BodyPose& poseA, const Plane& plane, const HullArrays& hulls, double threshold,
               RawContacts& raw) {
  for (const PickCandidate& p :
       pickPointsReference(rulesFor(a, plane, threshold), verticesOverPlane(a, poseA, plane, hulls))) {
    add(raw, p.at, p.distance);
  }
}

}  // namespace

RawContacts collidePrimitivesReference(uint bucket, const Shape& a, const BodyPose& poseA, const Shape& b,
                                       const BodyPose& poseB, float threshold, const HullArrays& hulls, double slack) {
  bucket = bucketOnPlane(bucket, a);
  const double limit = threshold + slack;
  const Vec bFromA = toVec(poseB.position) - toVec(poseA.position);
  RawContacts raw{};
  if (bucket == BUCKET_SPHERE_SPHERE) sphereSphere(a, b, bFromA, slack, raw);
  if (bucket == BUCKET_SPHERE_BOX) sphereBox(a, poseA, b, poseB, bFromA, limit, raw);
  if (bucket == BUCKET_CAPSULES) capsules(a, poseA, b, poseB, bFromA, limit, raw);
  if (bucket == BUCKET_CAPSULE_PLANE) {
    const Plane plane = planeFromA(b, poseB, bFromA);
    raw.normal = toFloat4(plane.normal);
    Vec end = rotationOf(poseA.orientation) * toVec(a.extents);
    if (dot(end, plane.normal) < 0) end = -end;
    // One extent of the three is not zero. Ends nearer than the threshold would replace each other in the manifold.
    const bool oneEnd = 2.0 * (a.extents.x + a.extents.y + a.extents.z) <= threshold;
    if (!oneEnd) pointPlane(end - plane.normal * a.margin, plane, limit, raw);
    pointPlane(-end - plane.normal * a.margin, plane, limit, raw);
  }
  if (bucket == BUCKET_HULL_PLANE) {
    const Plane plane = planeFromA(b, poseB, bFromA);
    raw.normal = toFloat4(plane.normal);
    hullPlane(a, poseA, plane, hulls, limit, raw);
  }
  if (bucket == BUCKET_SPHERE_PLANE || bucket == BUCKET_BOX_PLANE) {
    const Plane plane = planeFromA(b, poseB, bFromA);
    raw.normal = toFloat4(plane.normal);
    if (bucket == BUCKET_SPHERE_PLANE) pointPlane(plane.normal * -a.extents.x, plane, limit, raw);
    for (int corner = 0; bucket == BUCKET_BOX_PLANE && corner < 8; ++corner) {
      Vec p = toVec(a.extents);
      for (int k = 0; k < 3; ++k) p[k] *= corner >> k & 1 ? 1 : -1;
      pointPlane(rotationOf(poseA.orientation) * p, plane, limit, raw);
    }
  }
  return raw;
}

void collidePrimitivesReference(const PairArrays& in, std::vector<RawContacts>& contacts) {
  for (size_t i = 0; i < in.pairs.size(); ++i) {
    const Pair& p = in.pairs[i];
    if (p.bucket == BUCKET_CURVED_PLANE) contacts[i] = curvedPlaneReference(in, p);
    if (!isPrimitive(p.bucket)) continue;
    contacts[i] = collidePrimitivesReference(p.bucket, in.shapeOf(p.bodyA), in.poses[p.bodyA], in.shapeOf(p.bodyB),
                                             in.poses[p.bodyB], in.thresholdOf(p), in.hulls);
  }
}

// ---- the contract
namespace {

// A coordinate is a sum of rotated vectors that are no longer than the pair's size, with some 16 roundings on the way.
constexpr double kTolerance = 1e-6;

double reachOf(const Shape& s) {
  if (s.type == SHAPE_PLANE) return std::fabs(s.extents.w);
  return length(toVec(s.extents)) + (s.type == SHAPE_HULL ? length(toVec(s.centre)) : 0);
}

struct Sight {
  const Shape &a, &b;
  const BodyPose &poseA, &poseB;
  Vec bFromA;
  float threshold;
  double error;  // of a point or a distance
};

bool isNear(float4 p, float4 q, double pointLimit, double distanceLimit) {
  return length(toVec(p) - toVec(q)) <= pointLimit && std::fabs(double(p.w) - q.w) <= distanceLimit;
}

// Each of the device's points is one of `most`, in their order or in any, and all of `least` are there.
void checkPoints(Contract& contract, const Sight& s, const RawContacts& device, const RawContacts& most,
                 const RawContacts& least, double pointLimit, bool ordered) {
  std::vector<bool> used(RAW_POINTS, false);
  int from = 0;
  for (int k = 0; k < device.count; ++k) {
    int found = from;
    while (found < most.count &&
           (used[static_cast<size_t>(found)] || !isNear(device.points[k], most.points[found], pointLimit, s.error))) {
      ++found;
    }
    if (found == most.count) {
      if (most.count == 0) return contract.near("distance", device.points[k].w, s.threshold, s.error);
      const int nearest = std::min(k, most.count - 1);
      contract.near("point", device.points[k], most.points[nearest], pointLimit);
      contract.near("distance", device.points[k].w, most.points[nearest].w, s.error);
      return contract.require(false, "the point is none of the pair's, or comes again");
    }
    used[static_cast<size_t>(found)] = true;
    if (ordered) from = found + 1;
  }
  for (int k = 0; k < least.count; ++k) {
    const bool found = std::any_of(device.points, device.points + device.count,
                                   [&](float4 p) { return isNear(p, least.points[k], pointLimit, s.error); });
    contract.within("how deep a missing point is", found ? 0 : s.threshold - least.points[k].w, 0);
  }
}

RawContacts withSlack(const PairArrays& in, uint bucket, const Sight& s, double slack) {
  return collidePrimitivesReference(bucket, s.a, s.poseA, s.b, s.poseB, s.threshold, in.hulls, slack);
}

void checkHullPlane(Contract& contract, const PairArrays& in, const Sight& s, const RawContacts& device) {
  const Plane plane = planeFromA(s.b, s.poseB, s.bFromA);
  const auto vertices = verticesOverPlane(s.a, s.poseA, plane, in.hulls);
  std::vector<PickCandidate> picked;
  for (int k = 0; k < device.count; ++k) {
    const float4 p = device.points[k];
    picked.push_back({toVec(p), p.w});
    double off = INFINITY;
    for (const PickCandidate& v : vertices) {
      off = std::min(off, std::max(length(v.at - toVec(p)), std::fabs(v.distance - p.w)));
    }
    contract.within("how far a point is from the vertex next to it", off, s.error);
  }
  checkPickedPoints(contract, rulesFor(s.a, plane, s.threshold), vertices, picked, s.error);
}

void checkOnPlane(Contract& contract, const PairArrays& in, uint bucket, const Sight& s, const RawContacts& device) {
  const RawContacts most = withSlack(in, bucket, s, s.error), least = withSlack(in, bucket, s, -s.error);
  if (device.count > 0) contract.near("normal", device.normal, most.normal, kTolerance);
  if (bucket == BUCKET_HULL_PLANE) return checkHullPlane(contract, in, s, device);
  checkPoints(contract, s, device, most, least, s.error, bucket == BUCKET_BOX_PLANE);
  if (bucket != BUCKET_CAPSULE_PLANE) return;
  for (int k = 0; k < device.count; ++k) {
    const float last = device.points[device.count - 1].w;
    contract.within("how much deeper an end is than the last one", double(last) - device.points[k].w, s.error);
  }
}

void checkTwoSpheres(Contract& contract, const PairArrays& in, const Sight& s, const RawContacts& device) {
  const RawContacts most = withSlack(in, BUCKET_SPHERE_SPHERE, s, s.error);
  const RawContacts least = withSlack(in, BUCKET_SPHERE_SPHERE, s, -s.error);
  // Rounding decides whether spheres this far apart have a direction; it is the same subtraction on both sides.
  const bool ambiguous = std::fabs(length(s.bFromA) - kEpsilon) < 1e-3 * kEpsilon;
  if (device.count > 0 && most.count > 0 && !ambiguous) {
    contract.near("normal", device.normal, most.normal, kTolerance);
  }
  checkPoints(contract, s, device, most, least, s.error + (ambiguous ? 2.0 * s.b.extents.x : 0), true);
}

// A contact of sphere and box that the kernel may have found.
struct Way {
  Nearest found;
  double normalError;
};

// How the sphere may leave the box: the same as far as rounding can tell.
std::vector<Way> waysOutOfBox(Vec centre, double radius, Vec half, double margin, double error) {
  std::vector<Way> ways;
  Vec outside;
  for (int k = 0; k < 3; ++k) {
    const double core = half[k] - margin;
    outside[k] = std::max(0.0, std::fabs(centre[k]) - core);
  }
  const double gap = length(outside);
  // The normal is a difference of points, divided by its length.
  if (gap > kEpsilon) ways.push_back({sphereToBox(centre, radius, half, margin), kTolerance + error / gap});
  if (gap > error + 2 * kEpsilon) return ways;
  double least = INFINITY;
  for (int k = 0; k < 3; ++k) least = std::min(least, half[k] - std::fabs(centre[k]));
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const double depth = half[k] - sign * centre[k];
      if (depth > least + 2 * error) continue;
      Vec normal;
      normal[k] = sign;
      ways.push_back({{normal, centre + normal * depth, -depth - radius}, kTolerance});
    }
  }
  return ways;
}

// As far as rounding can tell, the sphere's distance decides.
void checkSphereBox(Contract& contract, const Sight& s, const RawContacts& device) {
  const bool boxIsB = s.b.type == SHAPE_BOX;
  const Shape &box = boxIsB ? s.b : s.a, &sphere = boxIsB ? s.a : s.b;
  const Matrix r = rotationOf(boxIsB ? s.poseB.orientation : s.poseA.orientation);
  const Vec sphereFromBox = boxIsB ? -s.bFromA : s.bFromA;
  const auto ways =
      waysOutOfBox(transposed(r) * sphereFromBox, sphere.extents.x, toVec(box.extents), box.margin, s.error);
  const double distance = ways[0].found.distance;
  contract.require(device.count <= 1, "there is at most one point");
  if (device.count == 0) return contract.within("how deep the missing point is", s.threshold - distance, s.error);
  contract.within("how far apart they are", distance - s.threshold, s.error);
  // The one that is least off speaks for the others.
  double least = INFINITY;
  const Way* best = nullptr;
  for (const Way& w : ways) {
    const Vec normal = r * w.found.normal * (boxIsB ? 1 : -1);
    const double off = length(toVec(device.normal) - normal) / w.normalError;
    if (best && off >= least) continue;
    least = off;
    best = &w;
  }
  const Vec outOfBox = r * best->found.normal;
  const Vec onB = boxIsB ? s.bFromA + r * best->found.point : sphereFromBox - outOfBox * sphere.extents.x;
  const double arm = boxIsB ? box.margin : double(sphere.extents.x) + box.margin + s.threshold;
  contract.near("normal", device.normal, toFloat4(boxIsB ? outOfBox : -outOfBox), best->normalError);
  contract.near("point", device.points[0], toFloat4(onB), s.error + best->normalError * arm);
  contract.near("distance", device.points[0].w, best->found.distance, s.error);
}

double distanceToSegment(Vec p, const std::vector<Vec>& ends) {
  const Vec d = ends.back() - ends.front();
  const double lengthSqr = dot(d, d);
  const double t = lengthSqr > 0 ? std::clamp(dot(p - ends.front(), d) / lengthSqr, 0.0, 1.0) : 0;
  return length(p - ends.front() - d * t);
}

// How much farther apart than the nearest points of two segments those may be that the kernel finds: their parameters
// are divided by 1 - cos^2 of the angle between them.
double parameterError(const std::vector<Vec>& a, const std::vector<Vec>& b, double apart, double size) {
  const Vec u = a.back() - a.front(), v = b.back() - b.front();
  if (length(u) == 0 || length(v) == 0) return 0;
  constexpr double kRounding = 5e-7;  // of the divisor, and of what is divided to the pair's size
  const double sine = length(cross(u, v)) / (length(u) * length(v));
  // Taken for parallel, where any point of A will do: the distance changes by the sine along it.
  if (sine * sine <= kRounding) return length(u) * sine;
  // Else around the nearest points, where it changes with the square.
  return std::hypot(apart, 2 * std::min(length(u), kRounding * size / (sine * sine)) * sine) - apart;
}

// Any point of contact will do that is as deep as the deepest: lying side by side, capsules have many.
void checkCapsules(Contract& contract, const Sight& s, const RawContacts& device) {
  const Polytope a = placed(polytopeOf(s.a, {}), rotationOf(s.poseA.orientation), {});
  const Polytope b = placed(polytopeOf(s.b, {}), rotationOf(s.poseB.orientation), s.bFromA);
  const double radii = double(s.a.margin) + s.b.margin, apart = closestCoresReference(a, b).separation;
  const double slack = s.error + parameterError(a.vertices, b.vertices, std::max(0.0, apart), s.error / kTolerance);
  contract.require(device.count <= 1, "there is at most one point");
  if (device.count == 0) return contract.within("how deep the missing point is", s.threshold - (apart - radii), slack);
  const float4 point = device.points[0];
  contract.within("how far apart they are", point.w - s.threshold, s.error);
  contract.within("how much less deep than the deepest", point.w - (apart - radii), slack);
  contract.within("how much deeper than the deepest", apart - radii - point.w, s.error);
  const Vec towardsA = toVec(device.normal);
  contract.near("length of the normal", length(towardsA), 1, kTolerance);
  const Vec inB = toVec(point) - towardsA * s.b.margin, inA = inB + towardsA * (point.w + radii);
  contract.within("how far the point is from B's surface", distanceToSegment(inB, b.vertices), s.error);
  contract.within("how far the point is from A's surface", distanceToSegment(inA, a.vertices), s.error);
}

}  // namespace

void checkPrimitiveContacts(Contract& contract, const PairArrays& in, const std::vector<RawContacts>& before,
                            const std::vector<RawContacts>& device) {
  for (size_t i = 0; i < in.pairs.size(); ++i) {
    const Pair& p = in.pairs[i];
    contract.at("pair {} (bodies {} and {})", i, p.bodyA, p.bodyB);
    if (p.bucket == BUCKET_CURVED_PLANE) {
      checkCurvedPlane(contract, in, p, device[i]);
      continue;
    }
    if (!isPrimitive(p.bucket)) {
      contract.require(std::memcmp(&device[i], &before[i], sizeof(RawContacts)) == 0, "another stage's candidates");
      continue;
    }
    const Shape &a = in.shapeOf(p.bodyA), &b = in.shapeOf(p.bodyB);
    const Vec bFromA = in.bFromA(p);
    const double error = kTolerance * (length(bFromA) + reachOf(a) + reachOf(b));
    const Sight s{a, b, in.poses[p.bodyA], in.poses[p.bodyB], bFromA, in.thresholdOf(p), error};
    contract.require(device[i].count >= 0 && device[i].count <= RAW_POINTS, "count of points");
    if (!contract.ok()) return;
    if (device[i].count > 0) contract.same("w of the normal", device[i].normal.w, 0);
    if (p.bucket == BUCKET_SPHERE_SPHERE) {
      checkTwoSpheres(contract, in, s, device[i]);
    } else if (p.bucket == BUCKET_SPHERE_BOX) {
      checkSphereBox(contract, s, device[i]);
    } else if (p.bucket == BUCKET_CAPSULES) {
      checkCapsules(contract, s, device[i]);
    } else {
      checkOnPlane(contract, in, bucketOnPlane(p.bucket, a), s, device[i]);
    }
  }
}

}  // namespace btgpu
