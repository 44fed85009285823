// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_closest_features_reference.h"

#include <algorithm>
#include <cstring>

#include "curved_reference.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kParallel = 1e-9;  // sine below which two edges give no axis

Polytope boxOf(Vec half) {
  Polytope box;
  box.hasVolume = half.x > 0 && half.y > 0 && half.z > 0;
  for (int corner = 0; corner < 8; ++corner) {
    box.vertices.push_back(
        {corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y, corner & 4 ? half.z : -half.z});
  }
  for (int k = 0; k < 3; ++k) {
    const size_t u = size_t{1} << (k + 1) % 3, v = size_t{1} << (k + 2) % 3;
    for (const size_t side : {size_t{0}, size_t{1} << k}) {
      Vec normal;
      normal[k] = side ? 1 : -1;
      box.faces.push_back({normal, {side, side | u, side | u | v, side | v}});
    }
    for (const size_t across : {size_t{0}, u, v, u | v}) box.edges.push_back({across, across | size_t{1} << k});
  }
  return box;
}

struct Span {
  double separation = INFINITY;
  Vec onA, onB;
};

void keepShorter(Span& best, Vec onA, Vec onB) {
  const double distance = length(onB - onA);
  if (distance < best.separation) best = {distance, onA, onB};
}

double clamp01(double t) { return std::min(1.0, std::max(0.0, t)); }

Vec nearestOnSegment(Vec p, Vec a, Vec b) {
  const Vec d = b - a;
  const double lengthSqr = dot(d, d);
  return lengthSqr > 0 ? a + d * clamp01(dot(p - a, d) / lengthSqr) : a;
}

// Two segments: the ends against the other one, and the point where the lines come nearest if it is on both.
void segments(Vec a, Vec b, Vec c, Vec d, Span& best) {
  for (const Vec p : {a, b}) keepShorter(best, p, nearestOnSegment(p, c, d));
  for (const Vec p : {c, d}) keepShorter(best, nearestOnSegment(p, a, b), p);
  const Vec u = b - a, v = d - c, w = cross(u, v);
  const double ww = dot(w, w);
  if (ww <= kParallel * kParallel * dot(u, u) * dot(v, v)) return;
  const double s = dot(cross(c - a, v), w) / ww, t = dot(cross(c - a, u), w) / ww;
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1) keepShorter(best, a + u * s, c + v * t);
}

// The foot of p in the face, if it lies within its sides.
bool footInFace(const Polytope& poly, const Polytope::Face& face, Vec p, Vec& foot) {
  if (face.corners.size() < 3) return false;
  foot = p - face.normal * dot(face.normal, p - poly.vertices[face.corners[0]]);
  for (size_t k = 0; k < face.corners.size(); ++k) {
    const Vec a = poly.vertices[face.corners[k]], b = poly.vertices[face.corners[(k + 1) % face.corners.size()]];
    const double side = dot(cross(b - a, foot - a), face.normal);
    // Corners run one way or the other; a convex face has the inside always on the same hand as its middle.
    Vec middle;
    for (const size_t c : face.corners) middle = middle + poly.vertices[c] / static_cast<double>(face.corners.size());
    if (side * dot(cross(b - a, middle - a), face.normal) < 0) return false;
  }
  return true;
}

// An edge of `a` goes through a face of `b`.
bool pierces(const Polytope& a, const Polytope& b) {
  Vec foot;
  for (const auto& face : b.faces) {
    const double plane = dot(face.normal, b.vertices[face.corners[0]]);
    for (const auto& e : a.edges) {
      const Vec p = a.vertices[e.from], q = a.vertices[e.to];
      const double atP = dot(face.normal, p) - plane, atQ = dot(face.normal, q) - plane;
      if (atP * atQ < 0 && footInFace(b, face, p + (q - p) * (atP / (atP - atQ)), foot)) return true;
    }
  }
  return false;
}

}  // namespace

Polytope polytopeOf(const Shape& shape, const HullArrays& hulls) {
  if (shape.type == SHAPE_CAPSULE) {
    Polytope segment;
    const Vec half = toVec(shape.extents);
    segment.vertices = {-half, half};
    segment.edges = {{0, 1}};
    return segment;
  }
  if (shape.type == SHAPE_BOX) {
    const double m = shape.margin;
    const Vec core = toVec(shape.extents) - Vec{m, m, m};
    return boxOf({std::max(core.x, 0.0), std::max(core.y, 0.0), std::max(core.z, 0.0)});
  }
  Polytope p;
  if (shape.type != SHAPE_HULL) {
    p.vertices = {{0, 0, 0}};
    p.edges = {{0, 0}};
    return p;
  }
  const auto at = [](const auto& array, int first, int i) {
    return array[static_cast<size_t>(first) + static_cast<size_t>(i)];
  };
  for (int i = 0; i < shape.vertexCount; ++i) { p.vertices.push_back(toVec(at(hulls.vertices, shape.firstVertex, i))); }
  for (int i = 0; i < shape.faceCount; ++i) {
    const HullFace from = at(hulls.faces, shape.firstFace, i);
    const Vec normal = toVec(from.plane);
    Polytope::Face face{normal / length(normal), {}};
    for (int k = 0; k < from.cornerCount; ++k) face.corners.push_back(at(hulls.corners, from.firstCorner, k));
    p.faces.push_back(face);
  }
  // A polygon has two faces; those of a segment or a point have fewer corners.
  p.hasVolume = p.faces.size() > 2 && p.faces[0].corners.size() > 2;
  for (int i = 0; i < shape.edgeCount; ++i) {
    const HullEdge from = at(hulls.edges, shape.firstEdge, i);
    p.edges.push_back({static_cast<size_t>(from.from), static_cast<size_t>(from.to)});
  }
  if (p.edges.empty()) p.edges = {{0, 0}};
  return p;
}

Polytope placed(const Polytope& local, const Matrix& rotation, Vec position) {
  Polytope p = local;
  for (Vec& v : p.vertices) v = position + rotation * v;
  for (Polytope::Face& f : p.faces) f.normal = rotation * f.normal;
  return p;
}

double separationAlong(const Polytope& a, const Polytope& b, Vec axis) {
  double highest = -INFINITY, lowest = INFINITY;
  for (const Vec v : a.vertices) highest = std::max(highest, dot(axis, v));
  for (const Vec v : b.vertices) lowest = std::min(lowest, dot(axis, v));
  return lowest - highest;
}

namespace {

// Projections on an axis, by vertex.
std::vector<double> alongAxis(const Polytope& p, Vec axis) {
  std::vector<double> along;
  for (const Vec v : p.vertices) along.push_back(dot(axis, v));
  return along;
}

// Closest points of two cores that do not overlap: every feature against every feature. Left out are those that lie
// farther apart along `axis`, which may be any, than the closest ones so far.
Span closestPoints(const Polytope& a, const Polytope& b, Vec axis) {
  const std::vector<double> ofA = alongAxis(a, axis), ofB = alongAxis(b, axis);
  Span span;
  for (const auto& e : a.edges) {
    for (const auto& f : b.edges) {
      if (std::min(ofB[f.from], ofB[f.to]) - std::max(ofA[e.from], ofA[e.to]) > span.separation) continue;
      segments(a.vertices[e.from], a.vertices[e.to], b.vertices[f.from], b.vertices[f.to], span);
    }
  }
  Vec foot;
  for (const auto& f : b.faces) {
    double lowest = INFINITY;
    for (const size_t c : f.corners) lowest = std::min(lowest, ofB[c]);
    for (size_t v = 0; v < a.vertices.size(); ++v) {
      if (lowest - ofA[v] > span.separation) continue;
      if (footInFace(b, f, a.vertices[v], foot)) keepShorter(span, a.vertices[v], foot);
    }
  }
  for (const auto& f : a.faces) {
    double highest = -INFINITY;
    for (const size_t c : f.corners) highest = std::max(highest, ofA[c]);
    for (size_t v = 0; v < b.vertices.size(); ++v) {
      if (ofB[v] - highest > span.separation) continue;
      if (footInFace(a, f, b.vertices[v], foot)) keepShorter(span, foot, b.vertices[v]);
    }
  }
  return span;
}

}  // namespace

namespace {

// Looks for the axis along which two cores are farthest apart.
class AxisSearch {
 public:
  AxisSearch(const Polytope& a, const Polytope& b) : m_a(a.vertices), m_b(b.vertices) {}

  void tryAxis(Vec axis) {
    double separation = INFINITY, highest = -INFINITY, lowest = INFINITY;
    for (size_t i = 0; i < std::max(m_a.size(), m_b.size()); ++i) {
      if (i < m_a.size()) highest = std::max(highest, dot(axis, m_a[i]));
      if (i < m_b.size()) lowest = std::min(lowest, dot(axis, m_b[i]));
      separation = lowest - highest;
      if (separation > best.separation) continue;
      // What speaks against this axis is likely to do so against the next ones: it is asked earlier.
      if (i < m_a.size()) std::swap(m_a[i], m_a[i / 2]);
      if (i < m_b.size()) std::swap(m_b[i], m_b[i / 2]);
      return;
    }
    best = {separation, axis, {}, {}};
  }

  ClosestCores best{-INFINITY, {1, 0, 0}, {}, {}};

 private:
  std::vector<Vec> m_a, m_b;
};

}  // namespace

ClosestCores closestCoresReference(const Polytope& a, const Polytope& b, double beyond) {
  AxisSearch search(a, b);
  for (const auto& f : a.faces) search.tryAxis(f.normal);
  for (const auto& f : b.faces) search.tryAxis(-f.normal);
  for (const auto& e : a.edges) {
    const Vec u = a.vertices[e.to] - a.vertices[e.from];
    for (const auto& f : b.edges) {
      const Vec v = b.vertices[f.to] - b.vertices[f.from], across = cross(u, v);
      const double size = length(across);
      if (size <= kParallel * length(u) * length(v)) continue;
      search.tryAxis(across / size);
      search.tryAxis(-across / size);
    }
  }
  ClosestCores& best = search.best;
  if (best.separation > beyond) return best;
  // Of two that enclose nothing, the axes above need not tell whether they meet; what they consist of does.
  if (best.separation < 0 && (a.hasVolume || b.hasVolume || pierces(a, b) || pierces(b, a))) return best;
  const Span span = closestPoints(a, b, best.normal);
  if (!(span.separation > 1e-9)) {
    if (best.separation == -INFINITY) best.separation = 0;  // two points, or segments on one line
    return best;
  }
  return {span.separation, (span.onB - span.onA) / span.separation, span.onA, span.onB};
}

const Polytope& CorePlacer::polytopeAt(size_t shape) {
  Polytope& p = m_polytopes[shape];
  if (p.vertices.empty()) p = polytopeOf(m_in.shapes[shape], m_in.hulls);
  return p;
}

PlacedCores CorePlacer::place(const Pair& pair) {
  const Shape &a = m_in.shapeOf(pair.bodyA), &b = m_in.shapeOf(pair.bodyB);
  const Vec bFromA = m_in.bFromA(pair);
  PlacedCores c;
  c.rotationA = rotationOf(m_in.poses[pair.bodyA].orientation);
  // Bullet leaves the margins of two shapes with polyhedral features out, and that of a triangle under a sphere.
  const auto has = [](const Shape& s, int bit) {
    return (s.type == SHAPE_HULL || s.type == SHAPE_BOX) && (s.variant & bit);
  };
  const bool bare = has(a, HULL_POLYHEDRAL) && has(b, HULL_POLYHEDRAL);
  const bool bareA = bare || (has(a, HULL_TRIANGLE) && b.type == SHAPE_SPHERE);
  const bool bareB = bare || (has(b, HULL_TRIANGLE) && a.type == SHAPE_SPHERE);
  const auto polytope = [&](uint body) {
    Shape shape = m_in.shapeOf(body);
    shape.margin = 0;
    return bare ? polytopeOf(shape, m_in.hulls) : polytopeAt(m_in.shapeIndexOf(body));
  };
  c.a = placed(polytope(pair.bodyA), c.rotationA, {});
  c.b = placed(polytope(pair.bodyB), rotationOf(m_in.poses[pair.bodyB].orientation), bFromA);
  c.size = length(toVec(a.extents)) + length(toVec(b.extents));
  for (const Shape* s : {&a, &b}) c.size += s->type == SHAPE_HULL ? length(toVec(s->centre)) : 0;
  c.reach = c.size + length(bFromA);
  constexpr double kSameDepth = 1e-5, kDepthRounding = 1e-6;  // SAME_DEPTH, DEPTH_ROUNDING
  c.depthSlack =
      std::max(2 * kSameDepth * std::min(length(toVec(a.extents)), length(toVec(b.extents))), kDepthRounding * c.size);
  c.marginB = bareB ? 0 : b.margin;
  c.margins = (bareA ? 0 : a.margin) + c.marginB;
  c.threshold = m_in.thresholdOf(pair);
  return c;
}

namespace {

// Of cores that overlap: closest points of what is left when B is drawn out of A along the axis, moved back.
void findPointsOfOverlap(const PlacedCores& c, ClosestCores& found) {
  const Vec out = found.normal * (1e-3 * c.size - found.separation);
  Polytope b = c.b;
  for (Vec& v : b.vertices) v = v + out;
  const Span span = closestPoints(c.a, b, found.normal);
  found.onA = span.onA;
  found.onB = span.onB - out;
}

bool isConvex(const Pair& p) { return p.bucket >= BUCKET_FIRST_CONVEX && p.bucket <= BUCKET_LAST_CONVEX; }

}  // namespace

ClosestPairs findClosestFeaturesReference(const PairArrays& in, std::vector<RawContacts>& contacts) {
  ClosestPairs out;
  CorePlacer placer(in);
  const uint first = in.bucketFirst[BUCKET_FIRST_CONVEX];
  for (uint n = first; n < in.bucketFirst[BUCKET_LAST_CONVEX + 1]; ++n) {
    contacts[in.items[n]].count = 0;
    if (in.pairs[in.items[n]].bucket == BUCKET_CURVED) {
      const ClosestFeatures f = curvedFeaturesReference(in, in.pairs[in.items[n]]);
      const bool near = f.normal.w < curvedPairOf(in, in.pairs[in.items[n]]).limit();
      out.closest.push_back(near ? f : ClosestFeatures{});
      if (near) out.near.push_back(n - first);
      continue;
    }
    const PlacedCores c = placer.place(in.pairs[in.items[n]]);
    ClosestCores found = closestCoresReference(c.a, c.b, c.limit());
    out.closest.push_back({});
    if (!(found.separation < c.limit())) continue;
    out.near.push_back(n - first);
    if (!(found.separation > 1e-9)) findPointsOfOverlap(c, found);
    const Matrix toA = transposed(c.rotationA);
    out.closest.back() = {toFloat4(toA * found.normal, found.separation), toFloat4(toA * found.onA),
                          toFloat4(toA * found.onB)};
  }
  return out;
}

// ---- the contract
namespace {

// Of what lies within its faces, or on one line.
double offCore(const Polytope& core, Vec at) {
  double most = 0;
  for (const auto& f : core.faces) most = std::max(most, dot(f.normal, at - core.vertices[f.corners[0]]));
  if (core.faces.empty()) most = length(at - nearestOnSegment(at, core.vertices.front(), core.vertices.back()));
  return most;
}

void checkFeatures(Contract& contract, const PlacedCores& c, const ClosestCores& expected, const ClosestFeatures& f) {
  constexpr double kSlack = 1.2e-5;   // the header's 1e-5, and what float makes of it
  constexpr double kArcSlack = 1e-4;  // ARC_SLACK: edges that the kernel takes may be that far from supporting ones
  constexpr double kRounding = 4e-7;  // of a sum of a few vertices
  // Nearer than this the kernel may take them for touching, and looks for a way out.
  const bool mayTouch = expected.separation < kSlack * c.reach;
  const double slack = kSlack * (mayTouch ? c.reach : c.size);
  contract.near("separation", f.normal.w, expected.separation, slack);
  const Vec axis = c.rotationA * toVec(f.normal), onA = c.rotationA * toVec(f.onA), onB = c.rotationA * toVec(f.onB);
  contract.near("length of the normal", length(axis), 1, 1e-5);
  // The normal is the difference of the closest points, over its length; and the search ends where the square of that
  // length, a float, cannot tell a better direction.
  const double turn = mayTouch ? 0 : std::sqrt(kRounding) + kRounding * c.size / expected.separation;
  contract.near("separation along the normal", separationAlong(c.a, c.b, axis), f.normal.w, slack + turn * c.size);
  double highest = -INFINITY, lowest = INFINITY;
  for (const Vec v : c.a.vertices) highest = std::max(highest, dot(axis, v));
  for (const Vec v : c.b.vertices) lowest = std::min(lowest, dot(axis, v));
  const double behind = slack + (turn + (mayTouch ? 2 * kArcSlack : 0)) * c.size;
  contract.near("point on A, along the normal", dot(axis, onA), highest, behind);
  contract.near("point on B, along the normal", dot(axis, onB), lowest, behind);
  if (mayTouch) return;
  contract.within("how far the point on A is from its core", offCore(c.a, onA), slack);
  contract.within("how far the point on B is from its core", offCore(c.b, onB), slack);
}

}  // namespace

void checkClosestFeatures(Contract& contract, const PairArrays& in, const ClosestPairs& device,
                          const std::vector<RawContacts>& before, const std::vector<RawContacts>& contacts) {
  constexpr double kRounding = 2e-6;  // of a distance, and of the pair's size
  const uint first = in.bucketFirst[BUCKET_FIRST_CONVEX];
  const size_t count = in.bucketFirst[BUCKET_LAST_CONVEX + 1] - first;
  contract.same("closest features", static_cast<double>(device.closest.size()), static_cast<double>(count));
  if (!contract.ok()) return;
  CorePlacer placer(in);
  size_t near = 0;
  for (uint position = 0; position < count && contract.ok(); ++position) {
    const uint i = in.items[first + position];
    const Pair& p = in.pairs[i];
    contract.at("pair {} (bodies {} and {}), position {}", i, p.bodyA, p.bodyB, position);
    if (p.bucket == BUCKET_CURVED) {
      const CurvedPair c = curvedPairOf(in, p);
      const double error = 3e-5 * (c.size + length(in.bFromA(p)));
      if (near < device.near.size() && device.near[near] == position) {
        ++near;
        checkCurvedFeatures(contract, in, p, device.closest[position]);
        contract.within("how far apart they are, and listed", device.closest[position].normal.w - c.limit(), error);
      } else if (!areFartherApart(c, c.limit())) {
        contract.within("how near they are, and not listed", c.limit() - widestGapReference(c).gap, error);
      }
      continue;
    }
    const PlacedCores c = placer.place(p);
    const double error = kRounding * c.size;
    const ClosestCores expected = closestCoresReference(c.a, c.b, c.limit() + 1e-4 * c.reach);
    if (near == device.near.size() || device.near[near] != position) {
      contract.within("how near they are, and not listed", c.limit() - expected.separation, error);
      continue;
    }
    ++near;
    // What touches is listed even where there is neither margin nor threshold.
    contract.within("how far apart they are, and listed", expected.separation - c.limit(),
                    std::max(error, 1.2e-5 * c.reach - c.limit()));
    checkFeatures(contract, c, expected, device.closest[position]);
  }
  contract.at("near pairs");
  contract.same("count", static_cast<double>(device.near.size()), static_cast<double>(near));
  for (size_t i = 0; i < in.pairs.size(); ++i) {
    contract.at("candidates of pair {}", i);
    if (isConvex(in.pairs[i])) {
      contract.same("count", contacts[i].count, 0);
    } else {
      contract.require(std::memcmp(&contacts[i], &before[i], sizeof(RawContacts)) == 0, "another stage's candidates");
    }
  }
}

}  // namespace btgpu
