// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Slots on the host: bodies, and the shapes of compounds (BODY_CHILD).
#pragma once

#include <vector>

#include "../kernels/shared/body.h"
#include "../kernels/shared/contact.h"

namespace btgpu {

// The body that a slot belongs to.
inline uint ownerOf(const std::vector<BodyInfo>& infos, uint slot) {
  return slot < infos.size() && (infos[slot].flags & BODY_CHILD) ? infos[slot].parent : slot;
}

// Which shape of its body's compound a slot holds; -1 if it is a body's own.
inline int childOf(const std::vector<BodyInfo>& infos, uint slot) {
  return slot < infos.size() && (infos[slot].flags & BODY_CHILD) ? infos[slot].child : -1;
}

// Puts slots in place of the bodies of manifolds: keys[i] is that of manifolds[i]'s pair.
inline void nameSlots(const std::vector<BodyInfo>& infos, const std::vector<ulong>& keys,
                      std::vector<Manifold>& manifolds) {
  for (size_t i = 0; i < manifolds.size() && i < keys.size(); ++i) {
    const uint low = static_cast<uint>(keys[i] >> 32), high = static_cast<uint>(keys[i]);
    const bool lowIsA = ownerOf(infos, low) == manifolds[i].bodyA;
    manifolds[i].bodyA = lowIsA ? low : high;
    manifolds[i].bodyB = lowIsA ? high : low;
  }
}

}  // namespace btgpu
