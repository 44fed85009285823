// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 35. Equality is exact: there is nothing but integers.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/contact.h"
#include "../../kernels/shared/shape.h"

namespace btgpu {

struct GroupedPairs {
  std::vector<Pair> pairs;        // in the order of the keys
  std::vector<uint> items;        // indices of pairs, bucket by bucket, ascending within
  std::vector<uint> bucketFirst;  // BUCKET_COUNT + 1: where each bucket begins in items; the end
};

// `keys` and `oldKeys` are ascending; old key k belongs to manifold k of the last step. infos, activations
// and born are indexed by body; born is nonzero where the slot got another body since then. `listed`: keys of pairs
// that must not collide, or (`onlyListed`) that alone may.
GroupedPairs groupPairsReference(const std::vector<ulong>& keys, const std::vector<ulong>& oldKeys,
                                 const std::vector<BodyInfo>& infos, const std::vector<Shape>& shapes,
                                 const std::vector<BodyActivation>& activations, const std::vector<uint>& born,
                                 const std::vector<ulong>& listed = {}, bool onlyListed = false);

}  // namespace btgpu
