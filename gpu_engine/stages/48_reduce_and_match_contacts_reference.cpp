// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "48_reduce_and_match_contacts_reference.h"

#include <algorithm>

#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kMaxFriction = 10;  // MAX_FRICTION in btManifoldResult::calculateCombinedFriction
constexpr double kHalfSqrt2 = 0.70710678118654752;

struct Body {
  const BodyInfo& info;
  const BodyPose& pose;
  const BodyMaterial& material;
  const Shape& shape;
};

double clampFriction(double v) { return std::clamp(v, -kMaxFriction, kMaxFriction); }

// btManifoldResult::calculateCombined...
void combine(const Body& a, const Body& b, ContactPoint& p) {
  const BodyMaterial &m = a.material, &n = b.material;
  const auto product = [](float x, float y) { return static_cast<double>(x) * y; };
  p.combined.x = static_cast<float>(clampFriction(product(m.friction, n.friction)));
  p.combined.y = static_cast<float>(product(m.restitution, n.restitution));
  p.combined.z = static_cast<float>(
      clampFriction(product(m.rollingFriction, n.friction) + product(n.rollingFriction, m.friction)));
  p.combined.w = static_cast<float>(
      clampFriction(product(m.spinningFriction, n.friction) + product(n.spinningFriction, m.friction)));
  if (!((a.info.flags | b.info.flags) & BODY_STIFFNESS)) return;
  p.combinedStiffness = static_cast<float>(1 / (1.0 / m.contactStiffness + 1.0 / n.contactStiffness));
  p.combinedDamping = m.contactDamping + n.contactDamping;
  p.flags |= POINT_STIFFNESS_DAMPING;
}

// btPlaneSpace1
void setFrictionDirections(Vec n, ContactPoint& p) {
  Vec first = std::fabs(n.z) > kHalfSqrt2 ? Vec{0, -n.z, n.y} : Vec{-n.y, n.x, 0};
  first = first / length(first);
  p.lateralFrictionDir1 = toFloat4(first);
  p.lateralFrictionDir2 = toFloat4(cross(n, first));
}

// btManifoldResult::addContactPoint up to where the point is looked up in the manifold.
ContactPoint makePoint(const RawContacts& raw, int k, const Body& a, const Body& b, Vec bFromA) {
  const Vec normal = toVec(raw.normal), onB = toVec(raw.points[k]);
  const double distance = raw.points[k].w;
  ContactPoint p{};
  p.localPointA = toFloat4(transposed(rotationOf(a.pose.orientation)) * (onB + normal * distance), distance);
  p.localPointB = toFloat4(transposed(rotationOf(b.pose.orientation)) * (onB - bFromA));
  p.normalWorldOnB = toFloat4(normal);
  setFrictionDirections(normal, p);
  combine(a, b, p);
  return p;
}

double distanceSqr(const ContactPoint& p, const ContactPoint& q) {
  const Vec d = toVec(p.localPointA) - toVec(q.localPointA);
  return dot(d, d);
}

// btPersistentManifold::getCacheEntry
int findMatch(const Manifold& m, const ContactPoint& p) {
  int nearest = -1;
  double least = static_cast<double>(m.breakingThreshold) * m.breakingThreshold;
  for (int i = 0; i < m.pointCount; ++i) {
    if (distanceSqr(m.points[i], p) >= least) continue;
    least = distanceSqr(m.points[i], p);
    nearest = i;
  }
  return nearest;
}

// btPersistentManifold::sortCachedPoints: which of four points a fifth replaces. Never the deepest of the
// five; else the one without which the other three and the new one span most.
int findLeastUseful(const Manifold& m, const ContactPoint& p) {
  int deepest = -1;
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (m.points[i].localPointA.w < (deepest < 0 ? p : m.points[deepest]).localPointA.w) deepest = i;
  }
  int best = -1;
  double largest = -1;
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (i == deepest) continue;
    Vec others[3];
    for (int k = 0, n = 0; k < MANIFOLD_POINTS; ++k) {
      if (k != i) others[n++] = toVec(m.points[k].localPointA);
    }
    const double area = length(cross(toVec(p.localPointA) - others[0], others[2] - others[1]));
    if (area <= largest) continue;
    largest = area;
    best = i;
  }
  return best;
}

void addPoint(Manifold& m, ContactPoint p) {
  if (p.localPointA.w > m.breakingThreshold) return;
  const int match = findMatch(m, p);
  if (match >= 0) {  // btPersistentManifold::replaceContactPoint keeps age and impulses
    const ContactPoint& old = m.points[match];
    p.lifeTime = old.lifeTime;
    p.localPointB.w = old.localPointB.w;
    p.normalWorldOnB.w = old.normalWorldOnB.w;
    p.lateralFrictionDir1.w = old.lateralFrictionDir1.w;
    p.flags |= old.flags & POINT_ORIGIN;
    m.points[match] = p;
  } else if (m.pointCount < MANIFOLD_POINTS) {
    m.points[m.pointCount++] = p;
  } else {
    m.points[findLeastUseful(m, p)] = p;
  }
}

// btPersistentManifold::refreshContactPoints
void refresh(Manifold& m, const Body& a, const Body& b, Vec bFromA) {
  const Matrix ra = rotationOf(a.pose.orientation), rb = rotationOf(b.pose.orientation);
  const double limit = m.breakingThreshold;
  const auto gap = [&](const ContactPoint& p) {
    return ra * toVec(p.localPointA) - (bFromA + rb * toVec(p.localPointB));
  };
  std::vector<bool> keep;
  for (int i = 0; i < m.pointCount; ++i) {
    ContactPoint& p = m.points[i];
    const Vec normal = toVec(p.normalWorldOnB);
    const double distance = dot(gap(p), normal);
    p.localPointA.w = static_cast<float>(distance);
    p.lifeTime += 1;
    keep.push_back(distance <= limit && length(gap(p) - normal * distance) <= limit);
  }
  for (int i = m.pointCount - 1; i >= 0; --i) {
    if (keep[static_cast<size_t>(i)]) continue;
    m.points[i] = m.points[m.pointCount - 1];  // removeContactPoint
    m.pointCount -= 1;
  }
}

Manifold newManifold(const Pair& pair, const Body& a, const Body& b) {
  Manifold m{};
  m.bodyA = pair.bodyA;
  m.bodyB = pair.bodyB;
  m.breakingThreshold = std::min(a.shape.breakingThreshold, b.shape.breakingThreshold);
  m.processingThreshold = std::min(a.material.contactProcessingThreshold, b.material.contactProcessingThreshold);
  return m;
}

}  // namespace

RawContacts reduceContactsReference(const RawContacts& raw) {
  if (raw.count <= MANIFOLD_POINTS) return raw;
  std::vector<float4> left(raw.points, raw.points + raw.count), kept;
  // Moves the point with the largest measure over, if that is above `least`.
  const auto take = [&](double least, auto measure) {
    int best = -1;
    double largest = least;
    for (size_t i = 0; i < left.size(); ++i) {
      if (measure(left[i]) <= largest) continue;
      largest = measure(left[i]);
      best = static_cast<int>(i);
    }
    if (best < 0) return;
    kept.push_back(left[static_cast<size_t>(best)]);
    left.erase(left.begin() + best);
  };
  take(-INFINITY, [](float4 p) { return -p.w; });
  take(-INFINITY, [&](float4 p) { return length(toVec(p) - toVec(kept[0])); });
  const Vec line = toVec(kept[1]) - toVec(kept[0]);
  const auto side = [&](float4 p) { return dot(cross(toVec(raw.normal), line), toVec(p) - toVec(kept[0])); };
  take(0, side);
  take(0, [&](float4 p) { return -side(p); });
  RawContacts out = raw;
  out.count = static_cast<int>(kept.size());
  std::copy(kept.begin(), kept.end(), out.points);
  return out;
}

std::vector<Manifold> matchContactsReference(const std::vector<Pair>& pairs, const std::vector<RawContacts>& contacts,
                                             const std::vector<Manifold>& oldManifolds,
                                             const std::vector<BodyInfo>& infos, const std::vector<Shape>& shapes,
                                             const std::vector<BodyPose>& poses,
                                             const std::vector<BodyMaterial>& materials, bool unseen) {
  const auto bodyOf = [&](uint i) {
    return Body{infos[i], poses[i], materials[i], shapes[static_cast<size_t>(infos[i].shapeIndex)]};
  };
  std::vector<Manifold> manifolds;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Pair& pair = pairs[i];
    const Body a = bodyOf(pair.bodyA), b = bodyOf(pair.bodyB);
    Manifold m = pair.oldManifold == NO_INDEX ? newManifold(pair, a, b) : oldManifolds[pair.oldManifold];
    m.bucket = pair.bucket;
    if (!unseen) {
      m.unseen = 0;
      for (int k = 0; k < m.pointCount; ++k) {
        int& flags = m.points[k].flags;
        flags = flags % (1 << POINT_ORIGIN_SHIFT) + (k + 1) * (1 << POINT_ORIGIN_SHIFT);
      }
    }
    manifolds.push_back(m);
    // btCollisionDispatcher::needsCollision: nothing is done for two inactive bodies.
    if (pair.bucket == BUCKET_CARRY || pair.bucket == BUCKET_NONE || pair.bucket == BUCKET_HOST) continue;

    Manifold& result = manifolds.back();
    const Vec bFromA = toVec(b.pose.position) - toVec(a.pose.position);
    // btSphereSphereCollisionAlgorithm clears its manifold and does not refresh it: its points are always
    // new.
    const bool persistent = pair.bucket != BUCKET_SPHERE_SPHERE;
    if (!persistent) result.pointCount = 0;
    result.unseen = 1;
    const RawContacts raw = reduceContactsReference(contacts[i]);
    for (int k = 0; k < raw.count; ++k) addPoint(result, makePoint(raw, k, a, b, bFromA));
    if (persistent) refresh(result, a, b, bFromA);
  }
  return manifolds;
}

}  // namespace btgpu
