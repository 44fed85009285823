// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 95. Equality is exact.
#pragma once

#include <vector>

#include "../../kernels/shared/contact.h"

namespace btgpu {

// Indices of manifolds, ascending.
struct GatheredContacts {
  std::vector<uint> touching;  // those with points
  std::vector<uint> fresh;     // of these, the ones that the host is sent
};

// Not sent, unless `all` are wanted: manifolds that were carried over, of which the host saw the last change.
GatheredContacts gatherContactsReference(const std::vector<Manifold>& manifolds, bool all);

}  // namespace btgpu
