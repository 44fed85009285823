// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// In place of stage 65's other variant in the fast mode (docs/fast_mode.md): the bodies as the first substep begins and
// the soft rows of every slot. Reads slots, manifolds, steps; writes solverBodies[], solverMasses[], substepStarts[],
// softRows (and rolls where used), the friction directions in manifolds[], and counts contacts that bounce.
class PrepareSoftContacts {
 public:
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_prepareBodies, m_prepareContacts;  // built when they are first needed
};

}  // namespace btgpu
