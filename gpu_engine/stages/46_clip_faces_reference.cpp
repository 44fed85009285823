// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "46_clip_faces_reference.h"

#include <algorithm>

namespace btgpu {
namespace {

using namespace reference;

struct Box {
  Vec half, centre;  // the centre from A's
  Matrix rotation;
};

// The half space dot(normal, p) <= limit.
struct HalfSpace {
  Vec normal;
  double limit;
};

// Side k (0, 1, 2) of the box on the given side of its centre.
HalfSpace sideOf(const Box& box, int k, double sign) {
  const Vec normal = box.rotation.column(k) * sign;
  return {normal, dot(normal, box.centre) + box.half[k]};
}

struct Corner {
  Vec at;
  double sine = 1;  // CandidatePoint::sine
};

std::vector<Corner> clip(const std::vector<Corner>& polygon, const HalfSpace& space) {
  std::vector<Corner> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec p = polygon[i].at, edge = polygon[(i + 1) % polygon.size()].at - p;
    const double above = dot(space.normal, p) - space.limit, rise = dot(space.normal, edge);
    if (above <= 0) kept.push_back(polygon[i]);
    if (above * (above + rise) < 0) kept.push_back({p - edge * (above / rise), std::fabs(rise) / length(edge)});
  }
  return kept;
}

// The face whose outward normal looks most against `direction`; its corners in turn.
std::vector<Corner> faceAgainst(const Box& box, Vec direction) {
  int face = 0;
  double sign = 1, least = INFINITY;
  for (int k = 0; k < 3; ++k) {
    for (const double s : {1.0, -1.0}) {
      const double facing = dot(box.rotation.column(k) * s, direction);
      if (facing >= least) continue;
      least = facing;
      face = k;
      sign = s;
    }
  }
  const int u = (face + 1) % 3, v = (face + 2) % 3;
  std::vector<Corner> corners;
  for (const auto& at : {std::pair<int, int>{1, 1}, {1, -1}, {-1, -1}, {-1, 1}}) {
    Vec p;
    p[face] = sign * box.half[face];
    p[u] = at.first * box.half[u];
    p[v] = at.second * box.half[v];
    corners.push_back({box.centre + box.rotation * p});
  }
  return corners;
}

std::vector<CandidatePoint> clipFace(const Box& a, const Box& b, int code, Vec aToB) {
  const bool onA = code < 3;
  const Box &facing = onA ? a : b, &incident = onA ? b : a;
  const int face = onA ? code : code - 3;
  const Vec outward = onA ? aToB : -aToB;
  std::vector<Corner> polygon = faceAgainst(incident, outward);
  for (int k = 0; k < 3; ++k) {
    if (k == face) continue;
    polygon = clip(polygon, sideOf(facing, k, 1));
    polygon = clip(polygon, sideOf(facing, k, -1));
  }
  const double level = dot(outward, facing.centre) + facing.half[face];
  std::vector<CandidatePoint> points;
  for (const Corner& corner : polygon) {
    const double distance = dot(outward, corner.at) - level;
    points.push_back({onA ? corner.at : corner.at - outward * distance, distance, corner.sine});
  }
  return points;
}

// Of the four edges of the box along its axis k, the midpoint of the one farthest along `direction`.
Vec supportingEdge(const Box& box, int k, Vec direction) {
  const int u = (k + 1) % 3, v = (k + 2) % 3;
  Vec best;
  double farthest = -INFINITY;
  for (const double su : {1.0, -1.0}) {
    for (const double sv : {1.0, -1.0}) {
      Vec p;
      p[u] = su * box.half[u];
      p[v] = sv * box.half[v];
      const Vec middle = box.centre + box.rotation * p;
      if (dot(direction, middle) <= farthest) continue;
      farthest = dot(direction, middle);
      best = middle;
    }
  }
  return best;
}

// Where the line through b along v comes nearest to the line through a along u.
Vec nearestOnSecond(Vec a, Vec u, Vec b, Vec v) {
  const Vec across = cross(u, v);
  // The plane that contains the first line and `across` cuts the second line there.
  const Vec plane = cross(u, across);
  return b + v * (dot(plane, a - b) / dot(plane, v));
}

}  // namespace

std::vector<CandidatePoint> clipBoxesReference(const Shape& a, const BodyPose& poseA, const Shape& b,
                                               const BodyPose& poseB, const SeparatingAxis& axis) {
  const Box boxA{toVec(a.extents), {}, rotationOf(poseA.orientation)};
  const Box boxB{toVec(b.extents), toVec(poseB.position) - toVec(poseA.position), rotationOf(poseB.orientation)};
  const Vec aToB = toVec(axis.normal);
  if (axis.code < 6) return clipFace(boxA, boxB, axis.code, aToB);
  const int i = (axis.code - 6) / 3, j = (axis.code - 6) % 3;
  const Vec u = boxA.rotation.column(i), v = boxB.rotation.column(j);
  const Vec onB = nearestOnSecond(supportingEdge(boxA, i, aToB), u, supportingEdge(boxB, j, -aToB), v);
  return {{onB, -static_cast<double>(axis.normal.w), length(cross(u, v))}};
}

void clipFacesReference(const std::vector<uint>& overlapping, const std::vector<uint>& bucketFirst,
                        const std::vector<uint>& items, const std::vector<Pair>& pairs,
                        const std::vector<BodyInfo>& infos, const std::vector<Shape>& shapes,
                        const std::vector<BodyPose>& poses, const std::vector<SeparatingAxis>& axes,
                        std::vector<RawContacts>& contacts) {
  for (const uint position : overlapping) {
    const uint i = items[bucketFirst[BUCKET_BOX_BOX] + position];
    const Pair& p = pairs[i];
    const auto shapeOf = [&](uint body) { return shapes[static_cast<size_t>(infos[body].shapeIndex)]; };
    RawContacts raw{};
    raw.normal = toFloat4(-toVec(axes[position].normal));
    for (const CandidatePoint& point :
         clipBoxesReference(shapeOf(p.bodyA), poses[p.bodyA], shapeOf(p.bodyB), poses[p.bodyB], axes[position])) {
      if (point.distance <= 0 && raw.count < RAW_POINTS) raw.points[raw.count++] = toFloat4(point.onB, point.distance);
    }
    contacts[i] = raw;
  }
}

}  // namespace btgpu
