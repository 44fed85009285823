// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 44: all 8 corners of both boxes projected on all 15 axes, in double. The kernel may
// choose another axis where two are as good within its rounding: 2e-6 of the pair's size (distance of the
// centres plus both diagonals), and for the edge axes, divided by the sine between the edges, that plus 1e-5
// of the size, by which the kernel (as Bullet) widens the boxes there, so that rounding does not separate
// boxes with nearly parallel edges.
#pragma once

#include <array>
#include <vector>

#include "contract.h"
#include "pair_arrays.h"

namespace btgpu {

// The boxes seen along one axis.
struct AxisProjection {
  reference::Vec normal;  // unit, world axes, from A to B (A's or B's own axis if the centres coincide along it)
  double separation;      // gap between the boxes along it; negative: overlap
  double sine;            // of the angle between the two edges; 1 for a face, 0: no axis, the edges are parallel
};

// In the order of SeparatingAxis::code.
std::array<AxisProjection, 15> projectBoxes(const Shape& a, const BodyPose& poseA, const Shape& b,
                                            const BodyPose& poseB);

// The axis of least overlap; an edge axis must beat the best one before it by 5 %, as in Bullet's dBoxBox2.
SeparatingAxis separatingAxisReference(const Shape& a, const BodyPose& poseA, const Shape& b, const BodyPose& poseB);

// For all box-box pairs, as `items` and `bucketFirst` list them, in that order; clears their contacts.
std::vector<SeparatingAxis> findSeparatingAxesReference(const PairArrays& in, std::vector<RawContacts>& contacts);

// ---- how exact the kernels are

// A projection or a point is a sum of some 30 rounded products, none longer than the pair's size: distance of
// the centres plus both half diagonals.
constexpr double kBoxTolerance = 2e-6;
double boxPairSize(const Shape& a, const BodyPose& poseA, const Shape& b, const BodyPose& poseB);

// EDGE_SLACK in kernels/lib/box_box.h; Bullet's dBoxBox2 has the same.
constexpr double kEdgeSlack = 1e-5;

using AxisProjections = std::array<AxisProjection, 15>;

// How far the kernel's separation along this axis may be off.
double axisError(const AxisProjection& axis, size_t code, double size);

// True if rounding may change the choice of the axis: some comparison on the way is closer than the errors of
// its two sides.
bool isAmbiguousAxis(const AxisProjections& axes, double size);

// The axes by position in the box-box bucket; no candidates left of box-box pairs, and those of others as `before`.
void checkSeparatingAxes(Contract& contract, const PairArrays& in, const std::vector<SeparatingAxis>& device,
                         const std::vector<RawContacts>& before, const std::vector<RawContacts>& contacts);

}  // namespace btgpu
