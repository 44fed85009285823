// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_separating_axis_reference.h"

#include <algorithm>

namespace btgpu {
namespace {

using namespace reference;

constexpr double kParallel = 1e-6;        // sine below which two edges give no axis
constexpr double kFacePreference = 1.05;  // fudge_factor in dBoxBox2

struct Interval {
  double low = INFINITY, high = -INFINITY;
};

Interval project(const Shape& box, const Matrix& rotation, Vec centre, Vec axis) {
  Interval range;
  for (int corner = 0; corner < 8; ++corner) {
    Vec p = toVec(box.extents);
    for (int k = 0; k < 3; ++k) p[k] *= corner >> k & 1 ? 1 : -1;
    const double at = dot(axis, centre + rotation * p);
    range.low = std::min(range.low, at);
    range.high = std::max(range.high, at);
  }
  return range;
}

}  // namespace

std::array<AxisProjection, 15> projectBoxes(const Shape& a, const BodyPose& poseA, const Shape& b,
                                            const BodyPose& poseB) {
  const Matrix ra = rotationOf(poseA.orientation), rb = rotationOf(poseB.orientation);
  const Vec bFromA = toVec(poseB.position) - toVec(poseA.position);
  std::array<AxisProjection, 15> out;
  for (int code = 0; code < 15; ++code) {
    Vec axis = code < 3   ? ra.column(code)
               : code < 6 ? rb.column(code - 3)
                          : cross(ra.column((code - 6) / 3), rb.column((code - 6) % 3));
    const double sine = length(axis);
    out[static_cast<size_t>(code)] = {{}, -INFINITY, 0};
    if (sine < kParallel) continue;
    axis = axis / sine;
    if (dot(axis, bFromA) < 0) axis = -axis;
    const double separation = project(b, rb, bFromA, axis).low - project(a, ra, {}, axis).high;
    out[static_cast<size_t>(code)] = {axis, separation, code < 6 ? 1 : sine};
  }
  return out;
}

SeparatingAxis separatingAxisReference(const Shape& a, const BodyPose& poseA, const Shape& b, const BodyPose& poseB) {
  const auto axes = projectBoxes(a, poseA, b, poseB);
  SeparatingAxis best{};
  best.code = -1;
  double separation = -INFINITY;
  for (int code = 0; code < 15; ++code) {
    const AxisProjection& axis = axes[static_cast<size_t>(code)];
    if (axis.separation > 0) {
      best = {};
      best.code = -1;
      return best;
    }
    if (axis.separation * (code < 6 ? 1 : kFacePreference) <= separation) continue;
    separation = axis.separation;
    best.code = code;
    best.normal = toFloat4(axis.normal, -separation);
  }
  return best;
}

SeparatingAxes findSeparatingAxesReference(const std::vector<uint>& bucketFirst, const std::vector<uint>& items,
                                           const std::vector<Pair>& pairs, const std::vector<BodyInfo>& infos,
                                           const std::vector<Shape>& shapes, const std::vector<BodyPose>& poses,
                                           std::vector<RawContacts>& contacts) {
  SeparatingAxes out;
  for (uint n = bucketFirst[BUCKET_BOX_BOX]; n < bucketFirst[BUCKET_BOX_BOX + 1]; ++n) {
    const Pair& p = pairs[items[n]];
    const auto shapeOf = [&](uint body) { return shapes[static_cast<size_t>(infos[body].shapeIndex)]; };
    out.axes.push_back(separatingAxisReference(shapeOf(p.bodyA), poses[p.bodyA], shapeOf(p.bodyB), poses[p.bodyB]));
    if (out.axes.back().code >= 0) out.overlapping.push_back(n - bucketFirst[BUCKET_BOX_BOX]);
    contacts[items[n]].count = 0;
  }
  return out;
}

}  // namespace btgpu
