// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 46: a general convex polygon clipper in double. The same points in any order, where
// a point is equal within 2e-6 of the pair's size, divided by the sine between the edge that was cut and the
// plane that cut it; points that lie on a cutting plane within that may come once or twice. Two edges:
// divided by the square of the sine between them.
#pragma once

#include <vector>

#include "contract.h"
#include "pair_arrays.h"

namespace btgpu {

struct CandidatePoint {
  reference::Vec onB;  // world axes, from A's centre
  double distance;     // negative: inside
  double sine;         // between edge and plane where a cut made this point, or between the two edges; 1: a corner
};

// All corners of the incident face's part that lies over the reference face, those above it included; for an
// edge axis the one point on B's edge that is nearest to A's.
std::vector<CandidatePoint> clipBoxesReference(const Shape& a, const BodyPose& poseA, const Shape& b,
                                               const BodyPose& poseB, const SeparatingAxis& axis);

// True if two faces of the incident box look equally much against the reference face, or two edges of a box
// reach equally far along the normal: either may be taken.
bool hasTwoFeatures(const BodyPose& poseA, const BodyPose& poseB, const SeparatingAxis& axis);

// For the box-box pairs without a separating axis, all by position in the bucket: overwrites their contacts.
void clipFacesReference(const PairArrays& in, const std::vector<SeparatingAxis>& axes,
                        std::vector<RawContacts>& contacts);

// `before`: the candidates that the stage found there, which pairs that are not listed keep.
void checkClippedFaces(Contract& contract, const PairArrays& in, const std::vector<SeparatingAxis>& axes,
                       const std::vector<RawContacts>& before, const std::vector<RawContacts>& device);

}  // namespace btgpu
