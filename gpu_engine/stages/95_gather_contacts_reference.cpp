// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "95_gather_contacts_reference.h"

#include "../../kernels/shared/shape.h"

namespace btgpu {

GatheredContacts gatherContactsReference(const std::vector<Manifold>& manifolds, bool all) {
  GatheredContacts gathered;
  for (uint i = 0; i < manifolds.size(); ++i) {
    if (manifolds[i].pointCount == 0) continue;
    gathered.touching.push_back(i);
    const bool known = manifolds[i].bucket == BUCKET_CARRY && manifolds[i].unseen == 0;
    if (all || !known) gathered.fresh.push_back(i);
  }
  return gathered;
}

}  // namespace btgpu
