// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_closest_features_reference.h"

#include <algorithm>

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
    return boxOf(toVec(shape.extents) - Vec{m, m, m});
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

ClosestCores closestCoresReference(const Polytope& a, const Polytope& b) {
  ClosestCores best{-INFINITY, {1, 0, 0}, {}, {}};
  const auto tryAxis = [&](Vec axis) {
    const double separation = separationAlong(a, b, axis);
    if (separation > best.separation) best = {separation, axis, {}, {}};
  };
  for (const auto& f : a.faces) tryAxis(f.normal);
  for (const auto& f : b.faces) tryAxis(-f.normal);
  for (const auto& e : a.edges) {
    const Vec u = a.vertices[e.to] - a.vertices[e.from];
    for (const auto& f : b.edges) {
      const Vec v = b.vertices[f.to] - b.vertices[f.from], across = cross(u, v);
      if (length(across) <= kParallel * length(u) * length(v)) continue;
      tryAxis(across / length(across));
      tryAxis(-across / length(across));
    }
  }
  // Of two that enclose nothing, the axes above need not tell whether they meet; what they consist of does.
  if (best.separation < 0 && (a.hasVolume || b.hasVolume || pierces(a, b) || pierces(b, a))) return best;
  Span span;
  for (const auto& e : a.edges) {
    for (const auto& f : b.edges) {
      segments(a.vertices[e.from], a.vertices[e.to], b.vertices[f.from], b.vertices[f.to], span);
    }
  }
  Vec foot;
  for (const Vec v : a.vertices) {
    for (const auto& f : b.faces) {
      if (footInFace(b, f, v, foot)) keepShorter(span, v, foot);
    }
  }
  for (const Vec v : b.vertices) {
    for (const auto& f : a.faces) {
      if (footInFace(a, f, v, foot)) keepShorter(span, foot, v);
    }
  }
  if (!(span.separation > 1e-9)) {
    if (best.separation == -INFINITY) best.separation = 0;  // two points, or segments on one line
    return best;
  }
  return {span.separation, (span.onB - span.onA) / span.separation, span.onA, span.onB};
}

}  // namespace btgpu
