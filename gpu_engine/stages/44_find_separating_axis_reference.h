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

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/contact.h"
#include "../../kernels/shared/shape.h"
#include "reference_maths.h"

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

struct SeparatingAxes {
  std::vector<SeparatingAxis> axes;  // by position in the box-box bucket
  std::vector<uint> overlapping;     // positions of pairs without a separating axis, ascending
};

// For all box-box pairs, as `items` and `bucketFirst` list them; clears their contacts.
SeparatingAxes findSeparatingAxesReference(const std::vector<uint>& bucketFirst, const std::vector<uint>& items,
                                           const std::vector<Pair>& pairs, const std::vector<BodyInfo>& infos,
                                           const std::vector<Shape>& shapes, const std::vector<BodyPose>& poses,
                                           std::vector<RawContacts>& contacts);

}  // namespace btgpu
