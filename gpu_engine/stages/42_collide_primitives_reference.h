// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 42. Counts are equal unless a distance lies at its limit; points and distances
// within 1e-6 of the pair's size (distance of the centres plus both shapes' reach), since the reference
// computes in double.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/contact.h"
#include "../../kernels/shared/shape.h"

namespace btgpu {

// Contact candidates of one pair; `bucket` is one of the primitive ones, except for
// BUCKET_HULL_PLANE. `threshold`: how far apart
// surfaces may be for a contact to arise; two spheres must touch. A box's corners come in the order of their
// bits (x: 1, y: 2, z: 4; set: positive), the lower end of a capsule after the upper one.
RawContacts collidePrimitivesReference(uint bucket, const Shape& a, const BodyPose& poseA, const Shape& b,
                                       const BodyPose& poseB, float threshold);

// The same for all pairs: overwrites contacts[i] of each pair i in a primitive bucket, leaves the others. A
// new contact's threshold is that of the pair's manifold of the last step, else the smaller one of the two
// shapes.
void collidePrimitivesReference(const std::vector<Pair>& pairs, const std::vector<BodyInfo>& infos,
                                const std::vector<Shape>& shapes, const std::vector<BodyPose>& poses,
                                const std::vector<Manifold>& oldManifolds, std::vector<RawContacts>& contacts);

}  // namespace btgpu
