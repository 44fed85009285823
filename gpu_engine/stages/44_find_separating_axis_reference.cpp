// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_separating_axis_reference.h"

#include <algorithm>
#include <cstring>

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

std::vector<SeparatingAxis> findSeparatingAxesReference(const PairArrays& in, std::vector<RawContacts>& contacts) {
  std::vector<SeparatingAxis> out;
  for (uint n = in.bucketFirst[BUCKET_BOX_BOX]; n < in.bucketFirst[BUCKET_BOX_BOX + 1]; ++n) {
    const Pair& p = in.pairs[in.items[n]];
    out.push_back(
        separatingAxisReference(in.shapeOf(p.bodyA), in.poses[p.bodyA], in.shapeOf(p.bodyB), in.poses[p.bodyB]));
    contacts[in.items[n]].count = 0;
  }
  return out;
}

// ---- the contract

double boxPairSize(const Shape& a, const BodyPose& poseA, const Shape& b, const BodyPose& poseB) {
  return length(toVec(poseB.position) - toVec(poseA.position)) + length(toVec(a.extents)) + length(toVec(b.extents));
}

double axisError(const AxisProjection& axis, size_t code, double size) {
  if (code < 6) return kBoxTolerance * size;
  return axis.sine > 0 ? (kBoxTolerance + kEdgeSlack) * size / axis.sine : 1e9;
}

bool isAmbiguousAxis(const AxisProjections& axes, double size) {
  double best = -1e18, bestError = 0;
  for (size_t code = 0; code < 15; ++code) {
    if (axes[code].sine == 0) continue;
    const double error = axisError(axes[code], code, size), weight = code < 6 ? 1 : kFacePreference;
    if (std::fabs(axes[code].separation) <= error) return true;
    if (axes[code].separation > 0) return false;
    if (std::fabs(axes[code].separation * weight - best) <= error + bestError) return true;
    if (axes[code].separation * weight <= best) continue;
    best = axes[code].separation;
    bestError = error;
  }
  return false;
}

namespace {

// No axis is clearly better than the one of this code.
void checkDepth(Contract& contract, const SeparatingAxis& s, const AxisProjections& axes, double size) {
  const auto chosen = static_cast<size_t>(s.code);
  const double error = axisError(axes[chosen], chosen, size), depth = s.normal.w;
  contract.near("depth along its axis", depth, -axes[chosen].separation, error);
  for (size_t code = 0; code < 15; ++code) {
    if (axes[code].sine == 0) continue;
    const double other = -axes[code].separation, limit = error + axisError(axes[code], code, size);
    contract.within("how far they are apart along another axis", -other, limit);
    // Faces are compared as they are, an edge must beat what it replaces by 5 %.
    const double wanted = chosen < 6 && code < 6    ? other
                          : chosen >= 6 && code < 6 ? other / kFacePreference
                                                    : other * kFacePreference;
    contract.within("how much deeper than along another axis", depth - wanted, limit);
  }
}

// What must hold for any choice: no axis separates the boxes, none is clearly better, and the overlap and the direction
// are those of the axis.
void checkAxis(Contract& contract, const SeparatingAxis& s, const AxisProjections& axes, double size, Vec bFromA) {
  contract.require(s.code >= -1 && s.code < 15, "code");
  if (!contract.ok()) return;
  if (s.code < 0) {
    double least = INFINITY;
    for (size_t code = 0; code < 15; ++code) {
      if (axes[code].sine > 0) least = std::min(least, -axes[code].separation - axisError(axes[code], code, size));
    }
    return contract.within("overlap along every axis, which is none", least, 0);
  }
  const auto chosen = static_cast<size_t>(s.code);
  const AxisProjection& axis = axes[chosen];
  contract.require(axis.sine > 0, "an axis of parallel edges");
  if (!contract.ok()) return;
  checkDepth(contract, s, axes, size);
  const Vec normal = toVec(s.normal);
  const double along = dot(normal, axis.normal);
  contract.near("length of the normal", length(normal), 1, kBoxTolerance);
  contract.near("normal", s.normal, toFloat4(axis.normal * (along < 0 ? -1.0 : 1.0)), kBoxTolerance / axis.sine);
  contract.within("how far the normal points from B to A", -dot(normal, bFromA), axisError(axis, chosen, size));
}

}  // namespace

void checkSeparatingAxes(Contract& contract, const PairArrays& in, const std::vector<SeparatingAxis>& device,
                         const std::vector<RawContacts>& before, const std::vector<RawContacts>& contacts) {
  const uint first = in.bucketFirst[BUCKET_BOX_BOX];
  const size_t count = in.bucketFirst[BUCKET_BOX_BOX + 1] - first;
  contract.same("axes", static_cast<double>(device.size()), static_cast<double>(count));
  if (!contract.ok()) return;
  for (uint position = 0; position < count; ++position) {
    const uint i = in.items[first + position];
    const Pair& p = in.pairs[i];
    contract.at("pair {} (bodies {} and {}), position {}", i, p.bodyA, p.bodyB, position);
    const Shape &a = in.shapeOf(p.bodyA), &b = in.shapeOf(p.bodyB);
    const BodyPose &poseA = in.poses[p.bodyA], &poseB = in.poses[p.bodyB];
    const AxisProjections axes = projectBoxes(a, poseA, b, poseB);
    const double size = boxPairSize(a, poseA, b, poseB);
    checkAxis(contract, device[position], axes, size, in.bFromA(p));
    if (!isAmbiguousAxis(axes, size)) {
      contract.same("code", device[position].code, separatingAxisReference(a, poseA, b, poseB).code);
    }
  }
  for (size_t i = 0; i < in.pairs.size(); ++i) {
    contract.at("candidates of pair {}", i);
    if (in.pairs[i].bucket == BUCKET_BOX_BOX) {
      contract.same("count", contacts[i].count, 0);
    } else {
      contract.require(std::memcmp(&contacts[i], &before[i], sizeof(RawContacts)) == 0, "another stage's candidates");
    }
  }
}

}  // namespace btgpu
