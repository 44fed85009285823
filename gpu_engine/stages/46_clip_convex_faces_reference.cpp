// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "46_clip_convex_faces_reference.h"

#include <algorithm>

namespace btgpu {
namespace {

using namespace reference;

// A polygon or segment, and its plane.
struct Patch {
  std::vector<Vec> corners;
  Vec normal;
  bool isFace = false;
};

// The face that looks most along the direction; of a segment itself.
Patch patchAlong(const Polytope& p, Vec direction) {
  Patch patch;
  if (p.faces.empty()) {
    patch.corners = p.vertices;
    patch.normal = direction;
    return patch;
  }
  const Polytope::Face* best = &p.faces[0];
  for (const auto& f : p.faces) {
    if (dot(f.normal, direction) > dot(best->normal, direction)) best = &f;
  }
  for (const size_t c : best->corners) patch.corners.push_back(p.vertices[c]);
  patch.normal = best->normal;
  patch.isFace = best->corners.size() > 2;
  return patch;
}

// What of the polygon lies within the sides of the face, seen along the axis (Sutherland and Hodgman).
std::vector<Vec> clip(std::vector<Vec> polygon, const Patch& face, Vec axis) {
  Vec middle;
  for (const Vec c : face.corners) middle = middle + c / static_cast<double>(face.corners.size());
  for (size_t k = 0; k < face.corners.size(); ++k) {
    const Vec at = face.corners[k];
    Vec outward = cross(face.corners[(k + 1) % face.corners.size()] - at, axis);
    if (dot(outward, middle - at) > 0) outward = -outward;
    std::vector<Vec> kept;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Vec p = polygon[i], q = polygon[(i + 1) % polygon.size()];
      const double above = dot(outward, p - at), next = dot(outward, q - at);
      if (above <= 0) kept.push_back(p);
      if (above * next < 0) kept.push_back(p + (q - p) * (above / (above - next)));
    }
    polygon = kept;
  }
  return polygon;
}

}  // namespace

std::vector<RegionCorner> regionCornersReference(const Polytope& a, const Polytope& b, Vec axis, double cosine) {
  const Patch onA = patchAlong(a, axis), onB = patchAlong(b, -axis);
  const double facingA = onA.isFace ? dot(onA.normal, axis) : 0, facingB = onB.isFace ? -dot(onB.normal, axis) : 0;
  if (std::max(facingA, facingB) < cosine) return {};
  const bool byA = facingA >= facingB;
  const Patch &sides = byA ? onA : onB, &other = byA ? onB : onA;
  std::vector<RegionCorner> corners;
  for (const Vec p : clip(other.corners, sides, axis)) {
    const double along = dot(sides.normal, sides.corners[0] - p) / dot(sides.normal, axis);
    if (byA) {
      corners.push_back({p, -along});
    } else {
      corners.push_back({p + axis * along, along});
    }
  }
  return corners;
}

}  // namespace btgpu
