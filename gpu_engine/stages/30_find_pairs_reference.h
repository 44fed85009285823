// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 30. Equality is exact: only comparisons of floats and integers are made.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"

namespace btgpu {

// Keys (lower << 32 | higher body index) of all pairs whose AABBs overlap, touching included, and whose
// filters let each other through; ascending. Every body is tried against every other.
std::vector<ulong> findPairsReference(const std::vector<BodyInfo>& infos, const std::vector<Aabb>& aabbs);

}  // namespace btgpu
