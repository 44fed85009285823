// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "70_solve_velocities.h"

namespace btgpu {

// Solver::TwoLevel's stage 70: as SolveVelocities, with the phases, groups and batches of BatchConstraints in place of
// colours. A launch is a phase, whose groups go through their batches, or one batch of a phase's groups. Joints keep
// their colours.
class SolveBatches : public SolveVelocities {
 public:
  explicit SolveBatches(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows);

 private:
  void solve(Queue& queue, DeviceWorld& world, const std::vector<uint>& passes, int repeats) override;
  bool jointsInTeam() const override { return false; }
  void solvePhase(Queue& queue, DeviceWorld& world, uint phase, uint passes);

  Kernel m_solveBatches, m_solveSerial;
  uint m_phases = 0, m_groups = 0;  // groups of a phase
  bool m_batchLaunches = false;
};

}  // namespace btgpu
