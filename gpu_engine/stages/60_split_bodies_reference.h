// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of 60_split_bodies. Must be equal exactly.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/joint.h"
#include "../../kernels/shared/rows.h"

namespace btgpu {

struct SplitBodiesReference {
  std::vector<SlotHeader> slots;  // one a constraint, in their order, and padding; bodyA and bodyB are copies
  std::vector<Joint> joints;      // likewise
  std::vector<uint> copyFirst;    // bodies + 1
};

// A body's copies are those of its contacts, in the order of `constraints` (indices into `manifolds`), then those of
// its joints that are solved and have rows.
SplitBodiesReference splitBodiesReference(const std::vector<uint>& constraints, const std::vector<Manifold>& manifolds,
                                          const std::vector<BodyStep>& steps, const std::vector<Joint>& joints,
                                          const std::vector<uint>& jointSolved);

}  // namespace btgpu
