// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 42. Counts are equal unless a distance lies at its limit; points and distances within 1e-6 of
// the pair's size (distance of the centres plus both shapes' reach), since the reference computes in double.
// checkPrimitiveContacts knows where the kernel may choose: parallel capsules, a sphere's centre between two faces of a
// box, vertices of a hull.
#pragma once

#include "contract.h"
#include "pair_arrays.h"

namespace btgpu {

// Contact candidates of one pair; `bucket` is one of the primitive ones. `threshold`: how far apart surfaces may be for
// a contact to arise; two spheres must touch. `slack` is added to either limit. A box's corners come in the order of
// their bits (x: 1, y: 2, z: 4; set: positive), the lower end of a capsule after the upper one, a hull's vertices as
// pick_points_reference.h has it.
RawContacts collidePrimitivesReference(uint bucket, const Shape& a, const BodyPose& poseA, const Shape& b,
                                       const BodyPose& poseB, float threshold, const HullArrays& hulls = {},
                                       double slack = 0);

// The same for all pairs: overwrites contacts[i] of each pair i in a primitive bucket, leaves the others. A
// new contact's threshold is that of the pair's manifold of the last step, else the smaller one of the two
// shapes.
void collidePrimitivesReference(const PairArrays& in, std::vector<RawContacts>& contacts);

// `before`: the candidates that the stage found there, which pairs of other buckets keep.
void checkPrimitiveContacts(Contract& contract, const PairArrays& in, const std::vector<RawContacts>& before,
                            const std::vector<RawContacts>& device);

}  // namespace btgpu
