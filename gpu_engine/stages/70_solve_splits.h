// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Solver::MassSplitting's stage 70: Jacobi over blocks. In each iteration every joint and every manifold solves its
// rows on copies of its own bodies, in the order of SolveVelocities; then the copies of a body are averaged. Joints
// that want more iterations than the world get them afterwards, alone. Reads slots, split.joints, split.copyMasses;
// changes rows, jointImpulses[], split.copies[] and solverBodies[]; writes the impulses of contacts into manifolds[].
class SolveSplits {
 public:
  explicit SolveSplits(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows);

 private:
  void solveContacts(Queue& queue, DeviceWorld& world, uint passes);
  void solveJoints(Queue& queue, DeviceWorld& world, uint iteration);
  void average(Queue& queue, DeviceWorld& world);

  bool m_inTeam;
  Kernel m_solveInTeam, m_solveColour, m_solveJoints, m_average, m_storeImpulses;
};

}  // namespace btgpu
