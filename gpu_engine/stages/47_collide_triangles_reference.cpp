// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "47_collide_triangles_reference.h"

#include <map>

#include "44_find_closest_features_reference.h"

namespace btgpu {
namespace {

using namespace reference;

// A triangle in world axes, from A's position. One without area has no faces.
Polytope polytopeOf(const MeshTriangle& t, const Matrix& rotation, Vec position) {
  Polytope p;
  for (const float4& corner : {t.a, t.b, t.c}) p.vertices.push_back(position + rotation * toVec(corner));
  p.edges = {{0, 1}, {1, 2}, {2, 0}};
  const Vec across = cross(p.vertices[1] - p.vertices[0], p.vertices[2] - p.vertices[0]);
  const double area = length(across);
  if (area > 0) p.faces = {{across / area, {0, 1, 2}}, {-(across / area), {2, 1, 0}}};
  return p;
}

// A hit and its two cores.
struct PlacedHit {
  double meshMargin;  // SphereTriangleDetector knows of none
  Polytope core, triangle;
  double size;   // of both
  double reach;  // with the distance of their centres
  double margins, threshold;
  double offPlane;  // how far A is from the triangle's plane beyond the threshold, where that counts
  double limit() const { return margins + threshold; }
};

// btConvexTriangleCallback::processTriangle looks at A's reach along the triangle's normal, a box's with its corners.
double offPlaneOf(const Shape& a, const Matrix& turn, const Polytope& core, const Polytope& triangle) {
  if (triangle.faces.empty()) return -INFINITY;
  const Vec normal = triangle.faces[0].normal;
  const double at = dot(normal, triangle.vertices[0]);
  double low = INFINITY, high = -INFINITY;
  for (const Vec& v : core.vertices) {
    low = std::min(low, dot(normal, v) - a.margin);
    high = std::max(high, dot(normal, v) + a.margin);
  }
  if (a.type == SHAPE_BOX || (a.type == SHAPE_HULL && (a.variant & HULL_BOX))) {
    const Vec in = transposed(turn) * normal, half = toVec(a.extents);
    const double reach = std::fabs(in.x) * half.x + std::fabs(in.y) * half.y + std::fabs(in.z) * half.z;
    low = dot(in, toVec(a.centre)) - reach;
    high = dot(in, toVec(a.centre)) + reach;
  }
  return std::max(low - at, at - high);
}

bool isCurved(const Shape& s) { return s.type >= SHAPE_CYLINDER && s.type <= SHAPE_SUM; }

class HitPlacer {
 public:
  explicit HitPlacer(const TriangleInput& in) : m_in(in) {}
  PlacedHit place(const TriangleHit& hit) {
    const Pair& p = m_in.pair(hit.pair);
    const PairArrays& in = m_in.arrays;
    const Shape &a = in.shapeOf(p.bodyA), &b = in.shapeOf(p.bodyB);
    const auto [known, isNew] = m_polytopes.try_emplace(in.shapeIndexOf(p.bodyA));
    if (isNew) known->second = btgpu::polytopeOf(a, in.hulls);
    const double meshMargin = a.type == SHAPE_SPHERE ? 0 : b.margin;
    PlacedHit h{
        meshMargin,
        placed(known->second, rotationOf(in.poses[p.bodyA].orientation), {}),
        polytopeOf(m_in.meshes.triangles[hit.triangle], rotationOf(in.poses[p.bodyB].orientation), in.bFromA(p)),
        0,
        0,
        a.margin + meshMargin,
        in.thresholdOf(p),
        -INFINITY};
    if (meshMargin > 0) {
      h.offPlane = offPlaneOf(a, rotationOf(in.poses[p.bodyA].orientation), h.core, h.triangle) - h.threshold;
    }
    const MeshTriangle& t = m_in.meshes.triangles[hit.triangle];
    h.size = length(toVec(a.extents)) + length(toVec(a.centre)) + a.margin;
    const auto side = [](float4 from, float4 to) { return length(toVec(to) - toVec(from)); };
    h.size += std::max({side(t.a, t.b), side(t.b, t.c), side(t.c, t.a)});
    h.reach = h.size + length(in.bFromA(p)) + length(toVec(t.a));
    return h;
  }

 private:
  const TriangleInput& m_in;
  std::map<size_t, Polytope> m_polytopes;
};

// With closest points also of cores that overlap: those of what is left when B is drawn out of A.
ClosestCores closestOf(const PlacedHit& h) {
  ClosestCores found = closestCoresReference(h.core, h.triangle, h.limit());
  if (found.separation > 1e-9 || !(found.separation < h.limit())) return found;
  const Vec out = found.normal * (1e-3 * h.size - found.separation);
  Polytope moved = h.triangle;
  for (Vec& v : moved.vertices) v = v + out;
  const ClosestCores apart = closestCoresReference(h.core, moved);
  found.onA = apart.onA;
  found.onB = apart.onB - out;
  return found;
}

constexpr double kSlack = 1.2e-5;   // CORES_TOUCH and FACE_AS_GOOD of the kernel, and what float makes of it
constexpr double kRounding = 4e-7;  // of a sum of a few vertices
constexpr double kArcSlack = 1e-4;  // ARC_SLACK of the kernel

}  // namespace

std::vector<TriangleContacts> collideTrianglesReference(const TriangleInput& in, const TriangleHits& hits) {
  std::vector<TriangleContacts> out;
  HitPlacer placer(in);
  for (const TriangleHit& hit : hits.hits) {
    const PlacedHit h = placer.place(hit);
    const ClosestCores found = closestOf(h);
    TriangleContacts c{};
    if (found.separation < h.limit() && h.offPlane <= 0) {
      c.normal = toFloat4(-found.normal, 1);
      c.points[0] = toFloat4(found.onB - found.normal * h.meshMargin, found.separation - h.margins);
    }
    out.push_back(c);
  }
  return out;
}

void checkTriangleContacts(Contract& contract, const TriangleInput& in, const TriangleHits& hits,
                           const std::vector<TriangleContacts>& device) {
  HitPlacer placer(in);
  for (size_t i = 0; i < hits.hits.size() && contract.ok(); ++i) {
    const TriangleHit& hit = hits.hits[i];
    const TriangleContacts& d = device[i];
    // The reference knows polytopes; what curved shapes do on meshes is held against Bullet (physics/meshes).
    if (isCurved(in.arrays.shapeOf(in.pair(hit.pair).bodyA))) continue;
    contract.at("hit {} (pair at {}, triangle {})", i, hit.pair, hit.triangle);
    const PlacedHit h = placer.place(hit);
    const double slack = kSlack * h.size + kRounding * h.reach;
    const ClosestCores expected = closestCoresReference(h.core, h.triangle, h.limit() + 1e-4 * h.reach);
    const int count = static_cast<int>(d.normal.w);
    contract.require(count >= 0 && count <= TRIANGLE_POINTS && static_cast<float>(count) == d.normal.w, "a count");
    if (count == 0) {
      if (h.offPlane > -slack) continue;
      contract.within("how near they are, and have no contact", h.limit() - expected.separation, slack);
      continue;
    }
    contract.within("how far apart they are, and have a contact", expected.separation - h.limit(), slack);
    contract.within("how far off the triangle's plane, and have a contact", h.offPlane, slack);
    if (!contract.ok()) return;
    double least = INFINITY;
    for (int k = 0; k < count; ++k) least = std::min(least, double(d.points[k].w));
    contract.near("least distance", least, expected.separation - h.margins, slack);
    const Vec normal = toVec(d.normal);
    contract.near("length of the normal", length(normal), 1, 1e-5);
    // As in stage 44: a direction between points that near is known to that.
    const bool mayTouch = expected.separation < kSlack * h.reach;
    const double turn = mayTouch ? 2 * kArcSlack : std::sqrt(kRounding) + kRounding * h.reach / expected.separation;
    contract.near("separation along the normal", separationAlong(h.core, h.triangle, -normal), expected.separation,
                  slack + turn * h.size);
    for (int k = 0; k < count; ++k) {
      contract.require(d.points[k].w < h.threshold + slack, "a point within the threshold");
      // Of cores that overlap along the triangle's normal the deepest vertex may be beside the triangle.
      if (mayTouch) continue;
      const Vec at = toVec(d.points[k]) - normal * h.meshMargin;
      Polytope point;
      point.vertices = {at};
      point.edges = {{0, 0}};
      const double off = std::max(0.0, closestCoresReference(point, h.triangle).separation);
      contract.within("how far a point is from the triangle", off, 2 * slack + turn * h.size);
    }
  }
}

namespace {

struct Touch {
  Vec at;
  float4 point, normal;  // as candidates have them
};

std::vector<Touch> touchesOf(const TriangleInput& in, const TriangleHits& hits,
                             const std::vector<TriangleContacts>& touches, uint k) {
  std::vector<Touch> out;
  const size_t first = hits.first[size_t{k} * hits.groups];
  for (size_t i = first; i < hits.hits.size() && hits.hits[i].pair == k; ++i) {
    for (int n = 0; n < static_cast<int>(touches[i].normal.w); ++n) {
      float4 normal = touches[i].normal;
      normal.w = static_cast<float>(static_cast<int>(hits.hits[i].triangle) - in.meshOf(k).firstTriangle + 1);
      out.push_back({toVec(touches[i].points[n]), touches[i].points[n], normal});
    }
  }
  return out;
}

bool same(float4 a, float4 b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w; }

}  // namespace

void pickTouchesReference(const TriangleInput& in, const TriangleHits& hits,
                          const std::vector<TriangleContacts>& touches, std::vector<RawContacts>& contacts) {
  for (uint k = 0; k < in.pairCount(); ++k) {
    RawContacts& raw = contacts[in.arrays.items[in.arrays.bucketFirst[BUCKET_MESH] + k]];
    raw = RawContacts{};
    raw.normal = {0, 1, 0, 0};
    const double spacing = in.arrays.thresholdOf(in.pair(k));
    std::vector<Touch> left = touchesOf(in, hits, touches, k), kept;
    // The deepest first, then always what lies farthest from those kept.
    const auto nearestKept = [&kept](const Touch& t) {
      double nearest = INFINITY;
      for (const Touch& other : kept) nearest = std::min(nearest, length(other.at - t.at));
      return nearest;
    };
    while (kept.size() < MANIFOLD_POINTS) {
      const Touch* best = nullptr;
      for (const Touch& t : left) {
        if (!kept.empty() && nearestKept(t) <= spacing) continue;
        const bool better = !best || (kept.empty() ? t.point.w < best->point.w : nearestKept(t) > nearestKept(*best));
        if (better) best = &t;
      }
      if (!best) break;
      kept.push_back(*best);
    }
    raw.count = static_cast<int>(kept.size());
    for (int n = 0; n < raw.count; ++n) {
      const Touch& t = kept[static_cast<size_t>(raw.count - 1 - n)];
      raw.points[n] = t.point;
      raw.points[MANIFOLD_POINTS + n] = t.normal;
    }
    if (raw.count > 0) raw.normal = {kept[0].normal.x, kept[0].normal.y, kept[0].normal.z, 0};
  }
}

void checkPickedTouches(Contract& contract, const TriangleInput& in, const TriangleHits& hits,
                        const std::vector<TriangleContacts>& touches, const std::vector<RawContacts>& before,
                        const std::vector<RawContacts>& device) {
  constexpr double kLess = 1 - 1e-5, kMore = 1 + 1e-5;  // of the spacing: a length in float
  for (uint k = 0; k < in.pairCount() && contract.ok(); ++k) {
    const Pair& p = in.pair(k);
    contract.at("candidates of bodies {} and {}", p.bodyA, p.bodyB);
    const RawContacts& raw = device[in.arrays.items[in.arrays.bucketFirst[BUCKET_MESH] + k]];
    const std::vector<Touch> all = touchesOf(in, hits, touches, k);
    const double threshold = in.arrays.thresholdOf(p);
    contract.require(raw.count >= 0 && raw.count <= MANIFOLD_POINTS, "a count");
    contract.require((raw.count > 0) == !all.empty(), "candidates where there are contacts, and only there");
    if (!contract.ok() || raw.count == 0) continue;
    double deepest = INFINITY, farthest = 0;
    const float4 last = raw.points[raw.count - 1];
    for (const Touch& t : all) {
      deepest = std::min(deepest, double(t.point.w));
      farthest = std::max(farthest, length(t.at - toVec(last)));
    }
    contract.within("how far above the deepest the last one is", last.w - deepest, 1.01e-3 * threshold);
    contract.require(raw.count > 1 || farthest <= threshold * kMore, "a second one where there is one");
    for (int n = 0; n < raw.count; ++n) {
      const auto isThis = [&](const Touch& t) {
        return same(t.point, raw.points[n]) && same(t.normal, raw.points[MANIFOLD_POINTS + n]);
      };
      contract.require(std::any_of(all.begin(), all.end(), isThis), "a contact with its normal and triangle");
      if (n == raw.count - 1) continue;
      contract.require(length(toVec(raw.points[n]) - toVec(last)) > threshold * kLess, "one apart from the deepest");
    }
  }
  for (size_t i = 0; i < in.arrays.pairs.size(); ++i) {
    if (in.arrays.pairs[i].bucket == BUCKET_MESH) continue;
    contract.at("candidates of pair {}", i);
    contract.require(std::memcmp(&device[i], &before[i], sizeof(RawContacts)) == 0, "another stage's candidates");
  }
}

}  // namespace btgpu
