// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// The solver's bodies and the rows of every slot. Reads slots, manifolds, steps; writes solverBodies[],
// solverMasses[], rows (and tangent2, torsion where used), and the friction directions in manifolds[].
class PrepareContacts {
 public:
  explicit PrepareContacts(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_both;  // on the CPU shape
  Kernel m_prepareBodies, m_prepareContacts;
};

}  // namespace btgpu
