// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "50_append_host_contacts_reference.h"

namespace btgpu {

uint appendHostContactsReference(size_t capacity, const std::vector<Manifold>& hostManifolds, StepCounters& counters,
                                 std::vector<Manifold>& manifolds) {
  const size_t count = counters.pairCount + hostManifolds.size();
  if (count > capacity) {
    counters.overflow |= OVERFLOW_PAIRS;
  } else {
    manifolds.resize(counters.pairCount);
    manifolds.insert(manifolds.end(), hostManifolds.begin(), hostManifolds.end());
  }
  return static_cast<uint>(count);
}

}  // namespace btgpu
