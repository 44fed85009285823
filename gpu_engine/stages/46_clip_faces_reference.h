// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 46: a general convex polygon clipper in double. The same points in any order, where
// a point is equal within 2e-6 of the pair's size, divided by the sine between the edge that was cut and the
// plane that cut it; points that lie on a cutting plane within that may come once or twice. Two edges:
// divided by the square of the sine between them.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/contact.h"
#include "../../kernels/shared/shape.h"
#include "reference_maths.h"

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

// For the box-box pairs whose positions in the bucket `overlapping` lists: overwrites their contacts.
void clipFacesReference(const std::vector<uint>& overlapping, const std::vector<uint>& bucketFirst,
                        const std::vector<uint>& items, const std::vector<Pair>& pairs,
                        const std::vector<BodyInfo>& infos, const std::vector<Shape>& shapes,
                        const std::vector<BodyPose>& poses, const std::vector<SeparatingAxis>& axes,
                        std::vector<RawContacts>& contacts);

}  // namespace btgpu
