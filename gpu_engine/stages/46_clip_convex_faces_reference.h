// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 46's second half: all corners of the region in which two faces lie over each other, by
// clipping the one with the sides of the other, in double. The kernel shows four of them at most, any choice that
// pick_points_reference.h allows. A point is known to 2e-6 of the pair's reach (its size, and the distance of the
// centres), a corner where sides nearly in line cross to that over the sine of their angle; whether a corner that lies
// on two sides of either face is there, rounding decides.
#pragma once

#include "44_find_closest_features_reference.h"

namespace btgpu {

struct RegionCorner {
  reference::Vec onB;  // on the face of B's core
  double gap;          // from A's face along the axis
};

// Both in the same axes; `axis` goes from A to B. None if no face lies along the axis, within an angle of the given
// cosine (the kernel's is 0.995). Of shapes without faces (segments) both ends count as one.
std::vector<RegionCorner> regionCornersReference(const Polytope& a, const Polytope& b, reference::Vec axis,
                                                 double cosine);

// For the convex pairs whose positions `near` lists: overwrites their contacts.
void clipConvexFacesReference(const PairArrays& in, const ClosestPairs& found, std::vector<RawContacts>& contacts);

// `before`: the candidates that the stage found there, which pairs that are not listed keep.
void checkClippedConvexFaces(Contract& contract, const PairArrays& in, const ClosestPairs& found,
                             const std::vector<RawContacts>& before, const std::vector<RawContacts>& device);

}  // namespace btgpu
