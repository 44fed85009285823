// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "48_reduce_and_match_contacts_reference.h"

#include <algorithm>
#include <functional>

namespace btgpu {
namespace {

using namespace reference;

constexpr double kMaxFriction = 10;  // MAX_FRICTION in btManifoldResult::calculateCombinedFriction
constexpr double kHalfSqrt2 = 0.70710678118654752;

// A coordinate is a sum of some 30 rounded products, none longer than the pair's size.
constexpr double kTolerance = 2e-6;

// Decides between what is equally good within the kernel's rounding. By default the best, and the first of those; when
// all outcomes are wanted, one after the other.
class Ties {
 public:
  // Index of the best of `count` values, of which `error(i)` is how far the kernel's may be off; -1 for none, which is
  // worth `least`.
  int best(int count, double least, const std::function<double(int)>& value, const std::function<double(int)>& error) {
    int found = -1;
    double most = least;
    for (int i = 0; i < count; ++i) {
      if (!(value(i) > most)) continue;
      most = value(i);
      found = i;
    }
    if (!m_enumerates) return found;
    std::vector<int> asGood{found};
    const double slack = found < 0 ? 0 : error(found);
    for (int i = 0; i < count; ++i) {
      if (i != found && value(i) >= most - slack - error(i)) asGood.push_back(i);
    }
    if (found >= 0 && most <= least + slack) asGood.push_back(-1);
    return asGood[static_cast<size_t>(choose(static_cast<int>(asGood.size())))];
  }
  // Whether value <= limit.
  bool isWithin(double value, double limit, double error) {
    const bool holds = value <= limit;
    if (!m_enumerates || std::fabs(value - limit) > error) return holds;
    return choose(2) == 0 ? holds : !holds;
  }

  void enumerate() { m_enumerates = true; }
  // After an outcome: takes the next one, as long as there are any.
  bool next() {
    while (!m_path.empty() && m_path.back().chosen + 1 == m_path.back().count) m_path.pop_back();
    m_at = 0;
    if (m_path.empty()) return false;
    ++m_path.back().chosen;
    return true;
  }

 private:
  struct Choice {
    int chosen, count;
  };
  int choose(int count) {
    if (count == 1) return 0;
    if (m_at == m_path.size()) m_path.push_back({0, count});
    return m_path[m_at++].chosen;
  }

  bool m_enumerates = false;
  std::vector<Choice> m_path;  // choices of the present outcome
  size_t m_at = 0;
};

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
  if ((a.info.flags | b.info.flags) & BODY_FRICTION_ANCHOR) p.flags |= POINT_FRICTION_ANCHOR;
  if (!((a.info.flags | b.info.flags) & BODY_STIFFNESS)) return;
  p.combinedStiffness = static_cast<float>(1 / (1.0 / m.contactStiffness + 1.0 / n.contactStiffness));
  p.combinedDamping = m.contactDamping + n.contactDamping;
  p.flags |= POINT_STIFFNESS_DAMPING;
}

// btPlaneSpace1
void setFrictionDirections(Vec n, bool steep, ContactPoint& p) {
  Vec first = steep ? Vec{0, -n.z, n.y} : Vec{-n.y, n.x, 0};
  first = first / length(first);
  p.lateralFrictionDir1 = toFloat4(first);
  p.lateralFrictionDir2 = toFloat4(cross(n, first));
}

// btManifoldResult::addContactPoint up to where the point is looked up in the manifold.
// `shift`: from A's position to that of the shape that collided.
ContactPoint makePoint(float4 normalOnB, float4 point, const Body& a, const Body& b, Vec bFromA, Vec shift,
                       bool steep) {
  const Vec normal = toVec(normalOnB), onB = toVec(point) + shift;
  const double distance = point.w;
  ContactPoint p{};
  p.localPointA = toFloat4(transposed(rotationOf(a.pose.orientation)) * (onB + normal * distance), distance);
  p.localPointB = toFloat4(transposed(rotationOf(b.pose.orientation)) * (onB - bFromA));
  p.normalWorldOnB = toFloat4(normal);
  setFrictionDirections(normal, steep, p);
  combine(a, b, p);
  return p;
}

double sizeOf(float4 v) { return length(toVec(v)); }

double pointError(const ContactPoint& p, Vec bFromA) {
  return kTolerance * (length(bFromA) + sizeOf(p.localPointA) + sizeOf(p.localPointB));
}

// btPersistentManifold::getCacheEntry
int findMatch(const Manifold& m, const ContactPoint& p, Vec bFromA, Ties& ties) {
  const auto nearness = [&](int i) { return -length(toVec(m.points[i].localPointA) - toVec(p.localPointA)); };
  return ties.best(m.pointCount, -double(m.breakingThreshold), nearness, [&](int) { return pointError(p, bFromA); });
}

// btPersistentManifold::sortCachedPoints: which of four points a fifth replaces. Never the deepest of the
// five; else the one without which the other three and the new one span most.
int findLeastUseful(const Manifold& m, const ContactPoint& p, Vec bFromA, Ties& ties) {
  int deepest = -1;
  for (int i = 0; i < MANIFOLD_POINTS; ++i) {
    if (m.points[i].localPointA.w < (deepest < 0 ? p : m.points[deepest]).localPointA.w) deepest = i;
  }
  struct Diagonals {
    Vec first, second;
  };
  const auto without = [&](int i) {
    Vec others[3];
    for (int k = 0, n = 0; k < MANIFOLD_POINTS; ++k) {
      if (k != i) others[n++] = toVec(m.points[k].localPointA);
    }
    return Diagonals{toVec(p.localPointA) - others[0], others[2] - others[1]};
  };
  const auto area = [&](int i) {
    const Diagonals d = without(i);
    return i == deepest ? -INFINITY : length(cross(d.first, d.second));
  };
  const auto error = [&](int i) {
    const Diagonals d = without(i);
    return pointError(p, bFromA) * (length(d.first) + length(d.second));
  };
  return std::max(0, ties.best(MANIFOLD_POINTS, -1e300, area, error));  // -1: they are no numbers
}

// btPersistentManifold::replaceContactPoint leaves a point be whose friction holds.
bool isHeldByAnchor(const ContactPoint& old, const ContactPoint& p, Ties& ties) {
  if (!(p.flags & POINT_FRICTION_ANCHOR)) return false;
  const double limit = std::fabs(double(old.combined.x) * double(old.localPointB.w));
  // Each of the squares is off by two roundings, and their root by half of that.
  return ties.isWithin(std::hypot(old.normalWorldOnB.w, old.lateralFrictionDir1.w), limit, 2e-7 * limit);
}

void addPoint(Manifold& m, ContactPoint p, Vec bFromA, Ties& ties) {
  if (p.localPointA.w > m.breakingThreshold) return;
  const int match = findMatch(m, p, bFromA, ties);
  if (match >= 0 && isHeldByAnchor(m.points[match], p, ties)) return;
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
    m.points[findLeastUseful(m, p, bFromA, ties)] = p;
  }
}

// btPersistentManifold::refreshContactPoints
void refresh(Manifold& m, const Body& a, const Body& b, Vec bFromA, Ties& ties) {
  const Matrix ra = rotationOf(a.pose.orientation), rb = rotationOf(b.pose.orientation);
  const double limit = m.breakingThreshold;
  std::vector<bool> keep;
  for (int i = 0; i < m.pointCount; ++i) {
    ContactPoint& p = m.points[i];
    const Vec normal = toVec(p.normalWorldOnB), gap = ra * toVec(p.localPointA) - (bFromA + rb * toVec(p.localPointB));
    const double distance = dot(gap, normal), error = pointError(p, bFromA);
    p.localPointA.w = static_cast<float>(distance);
    p.lifeTime += 1;
    keep.push_back(ties.isWithin(distance, limit, error) &&
                   ties.isWithin(length(gap - normal * distance), limit, error));
  }
  for (int i = m.pointCount - 1; i >= 0; --i) {
    if (keep[static_cast<size_t>(i)]) continue;
    m.points[i] = m.points[m.pointCount - 1];  // removeContactPoint
    m.pointCount -= 1;
  }
}

Manifold newManifold(uint bodyA, uint bodyB, const Body& a, const Body& b) {
  Manifold m{};
  m.bodyA = bodyA;
  m.bodyB = bodyB;
  m.breakingThreshold = std::min(a.shape.breakingThreshold, b.shape.breakingThreshold);
  m.processingThreshold = std::min(a.material.contactProcessingThreshold, b.material.contactProcessingThreshold);
  return m;
}

RawContacts reduce(const RawContacts& raw, Ties& ties) {
  if (raw.count <= MANIFOLD_POINTS) return raw;
  constexpr double kRounding = 1e-6;  // of a product of two vectors
  std::vector<float4> left(raw.points, raw.points + raw.count), kept;
  // Moves the point with the largest measure over, if that is above `least`.
  const auto take = [&](double least, auto measure, auto error) {
    const int best = ties.best(
        static_cast<int>(left.size()), least, [&](int i) { return measure(left[static_cast<size_t>(i)]); },
        [&](int i) { return error(left[static_cast<size_t>(i)]); });
    if (best < 0) return;
    kept.push_back(left[static_cast<size_t>(best)]);
    left.erase(left.begin() + best);
  };
  const auto apart = [&](float4 p) { return length(toVec(p) - toVec(kept[0])); };
  take(
      -1e300, [](float4 p) { return -double(p.w); }, [](float4) { return 0.0; });
  if (!kept.empty()) take(-1e300, apart, [&](float4 p) { return kRounding * apart(p); });
  if (kept.size() < 2) return raw;  // they are no numbers
  const Vec line = toVec(kept[1]) - toVec(kept[0]);
  const auto side = [&](float4 p) { return dot(cross(toVec(raw.normal), line), toVec(p) - toVec(kept[0])); };
  const auto sideError = [&](float4 p) { return kRounding * length(line) * apart(p); };
  take(0, side, sideError);
  take(
      0, [&](float4 p) { return -side(p); }, sideError);
  RawContacts out = raw;
  out.count = static_cast<int>(kept.size());
  std::copy(kept.begin(), kept.end(), out.points);
  return out;
}

// The last of those that are equally deep.
void moveDeepestToEnd(RawContacts& raw) {
  if (raw.count == 0) return;
  int deepest = 0;
  for (int i = 1; i < raw.count; ++i) {
    if (raw.points[i].w <= raw.points[deepest].w) deepest = i;
  }
  std::swap(raw.points[deepest], raw.points[raw.count - 1]);
}

bool isCarried(const Pair& p) { return p.bucket == BUCKET_CARRY || p.bucket == BUCKET_NONE || p.bucket == BUCKET_HOST; }

Body bodyOf(const MatchInput& in, uint i) {
  return {in.arrays.infos[i], in.arrays.poses[i], in.materials[i], in.arrays.shapeOf(i)};
}

Vec bodyBFromBodyA(const MatchInput& in, const Pair& pair) {
  return toVec(in.arrays.poses[in.arrays.ownerOf(pair.bodyB)].position) -
         toVec(in.arrays.poses[in.arrays.ownerOf(pair.bodyA)].position);
}

Manifold match(const MatchInput& in, size_t i, Ties& ties) {
  const Pair& pair = in.arrays.pairs[i];
  const uint bodyA = in.arrays.ownerOf(pair.bodyA), bodyB = in.arrays.ownerOf(pair.bodyB);
  const Body a = bodyOf(in, bodyA), b = bodyOf(in, bodyB);
  Manifold m =
      pair.oldManifold == NO_INDEX ? newManifold(bodyA, bodyB, a, b) : in.arrays.oldManifolds[pair.oldManifold];
  // Bullet makes the manifold when an algorithm first runs on the pair.
  const bool made = pair.oldManifold != NO_INDEX && m.bucket != BUCKET_NONE;
  m.bucket = pair.bucket == BUCKET_CARRY && !made ? BUCKET_NONE : pair.bucket;
  if (!in.unseen) {
    m.unseen = 0;
    for (int k = 0; k < m.pointCount; ++k) {
      int& flags = m.points[k].flags;
      flags = flags % (1 << POINT_ORIGIN_SHIFT) + (k + 1) * (1 << POINT_ORIGIN_SHIFT);
    }
  }
  // btCollisionDispatcher::needsCollision: nothing is done for two inactive bodies.
  if (isCarried(pair)) return m;

  const Vec bFromA = bodyBFromBodyA(in, pair);
  const Vec shift = toVec(in.arrays.poses[pair.bodyA].position) - toVec(a.pose.position);
  // btSphereSphereCollisionAlgorithm clears its manifold and does not refresh it: its points are always
  // new.
  const bool persistent = pair.bucket != BUCKET_SPHERE_SPHERE;
  if (!persistent) m.pointCount = 0;
  m.unseen = 1;
  // btCompoundCollisionAlgorithm::processCollision refreshes all its manifolds first, and so does each nested one.
  const int depth = std::max(in.arrays.infos[pair.bodyA].depth, in.arrays.infos[pair.bodyB].depth);
  for (int k = 0; persistent && k < depth; ++k) refresh(m, a, b, bFromA, ties);
  RawContacts raw = reduce(in.contacts[i], ties);
  // btConvexPlaneCollisionAlgorithm adds the deepest corner; what else is shown to the manifold must not push it out.
  if ((pair.bucket == BUCKET_BOX_PLANE || pair.bucket == BUCKET_HULL_PLANE) && raw.count <= MANIFOLD_POINTS) {
    moveDeepestToEnd(raw);
  }
  bool steep = raw.count > 0 && !ties.isWithin(std::fabs(raw.normal.z), kHalfSqrt2, 1e-7);
  for (int k = 0; k < raw.count; ++k) {
    // Contacts with a mesh have normals of their own.
    const bool own = pair.bucket == BUCKET_MESH;
    const float4 normal = own ? raw.points[MANIFOLD_POINTS + k] : raw.normal;
    if (own) steep = !ties.isWithin(std::fabs(normal.z), kHalfSqrt2, 1e-7);
    ContactPoint p = makePoint(normal, raw.points[k], a, b, bFromA, shift, steep);
    if (own) p.lateralFrictionDir2.w = normal.w;
    addPoint(m, p, bFromA, ties);
  }
  if (persistent) refresh(m, a, b, bFromA, ties);
  return m;
}

}  // namespace

RawContacts reduceContactsReference(const RawContacts& raw) {
  Ties ties;
  return reduce(raw, ties);
}

std::vector<Manifold> matchContactsReference(const MatchInput& in) {
  std::vector<Manifold> manifolds;
  Ties ties;
  for (size_t i = 0; i < in.arrays.pairs.size(); ++i) manifolds.push_back(match(in, i, ties));
  return manifolds;
}

// ---- the contract
namespace {

// How far the kernel's sum of two products of material values may be off: three roundings.
float4 combinedError(const BodyMaterial& m, const BodyMaterial& n) {
  const auto size = [](float x, float y) { return std::fabs(4e-7f * x * y); };
  return {size(m.friction, n.friction), size(m.restitution, n.restitution),
          size(m.rollingFriction, n.friction) + size(n.rollingFriction, m.friction),
          size(m.spinningFriction, n.friction) + size(n.spinningFriction, m.friction)};
}

struct PointLimits {
  double place, direction, relative;
  float4 combined;
};

void checkPoint(Contract& contract, const ContactPoint& d, const ContactPoint& e, const PointLimits& limits) {
  contract.near("point on A", d.localPointA, e.localPointA, limits.place);
  contract.near("point on B", d.localPointB, e.localPointB, limits.place);
  contract.near("distance", d.localPointA.w, e.localPointA.w, limits.place);
  contract.near("normal", d.normalWorldOnB, e.normalWorldOnB, 0);
  contract.near("first friction direction", d.lateralFrictionDir1, e.lateralFrictionDir1, limits.direction);
  contract.near("second friction direction", d.lateralFrictionDir2, e.lateralFrictionDir2, limits.direction);
  contract.same("impulse", d.localPointB.w, e.localPointB.w);
  contract.same("first friction impulse", d.normalWorldOnB.w, e.normalWorldOnB.w);
  contract.same("second friction impulse", d.lateralFrictionDir1.w, e.lateralFrictionDir1.w);
  contract.same("w of the second friction direction", d.lateralFrictionDir2.w, e.lateralFrictionDir2.w);
  contract.near("friction", d.combined.x, e.combined.x, limits.combined.x);
  contract.near("restitution", d.combined.y, e.combined.y, limits.combined.y);
  contract.near("rolling friction", d.combined.z, e.combined.z, limits.combined.z);
  contract.near("spinning friction", d.combined.w, e.combined.w, limits.combined.w);
  contract.near("stiffness", d.combinedStiffness, e.combinedStiffness,
                limits.relative * std::fabs(e.combinedStiffness));
  contract.near("damping", d.combinedDamping, e.combinedDamping, limits.relative * std::fabs(e.combinedDamping));
  contract.same("life time", d.lifeTime, e.lifeTime);
  contract.same("flags", d.flags, e.flags);
}

void checkManifold(Contract& contract, const MatchInput& in, size_t i, const Manifold& d, const Manifold& e) {
  const Pair& pair = in.arrays.pairs[i];
  contract.at("pair {} (bodies {} and {})", i, pair.bodyA, pair.bodyB);
  contract.same("body A", d.bodyA, e.bodyA);
  contract.same("body B", d.bodyB, e.bodyB);
  contract.same("bucket", d.bucket, e.bucket);
  contract.same("unseen", d.unseen, e.unseen);
  contract.same("breaking threshold", d.breakingThreshold, e.breakingThreshold);
  contract.same("processing threshold", d.processingThreshold, e.processingThreshold);
  contract.same("count of points", d.pointCount, e.pointCount);
  if (!contract.ok()) return;
  PointLimits limits{};
  if (!isCarried(pair)) { limits = {0, 1e-6, 4e-7, combinedError(in.materials[e.bodyA], in.materials[e.bodyB])}; }
  for (int k = 0; k < e.pointCount; ++k) {
    contract.at("pair {} (bodies {} and {}), point {}", i, pair.bodyA, pair.bodyB, k);
    if (!isCarried(pair)) limits.place = pointError(e.points[k], bodyBFromBodyA(in, pair));
    checkPoint(contract, d.points[k], e.points[k], limits);
  }
}

// True if the device's manifold is what comes of some way to decide what rounding may decide. Gives up, and believes
// it, where there are too many.
bool comesOfTies(const MatchInput& in, size_t i, const Manifold& device) {
  constexpr int kMostOutcomes = 20000;
  Ties ties;
  ties.enumerate();
  for (int n = 0; n < kMostOutcomes; ++n) {
    Contract contract("");
    checkManifold(contract, in, i, device, match(in, i, ties));
    if (contract.ok()) return true;
    if (!ties.next()) return false;
  }
  return true;
}

}  // namespace

void checkMatchedContacts(Contract& contract, const MatchInput& in, const std::vector<Manifold>& device) {
  Ties ties;
  for (size_t i = 0; i < in.arrays.pairs.size() && contract.ok(); ++i) {
    Contract direct = contract;
    checkManifold(direct, in, i, device[i], match(in, i, ties));
    if (!direct.ok() && !comesOfTies(in, i, device[i])) contract = direct;
  }
}

}  // namespace btgpu
