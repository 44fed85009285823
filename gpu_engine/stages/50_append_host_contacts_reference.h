// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 50. Equality is exact.
#pragma once

#include <vector>

#include "../../kernels/shared/contact.h"
#include "../../kernels/shared/step.h"

namespace btgpu {

// Puts the host's manifolds behind those of counters.pairCount pairs in `manifolds`, whose length is the capacity at
// most. Returns how many there are in all; if that is more than the capacity, the overflow is noted and nothing is
// written.
uint appendHostContactsReference(size_t capacity, const std::vector<Manifold>& hostManifolds, StepCounters& counters,
                                 std::vector<Manifold>& manifolds);

}  // namespace btgpu
