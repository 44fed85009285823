// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Solver::MassSplitting only: the copies of stage 60 at rest, each with its share of the body's mass, and the effective
// masses of all rows between such copies. Reads slots, steps, split.copyFirst; changes the rows (jac, rhs, cfm) and
// jointEffects[]; writes split.copies[], split.copyMasses[] and split.jointRows[].
class SplitMasses {
 public:
  explicit SplitMasses(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_bodies, m_contacts, m_joints;
};

}  // namespace btgpu
