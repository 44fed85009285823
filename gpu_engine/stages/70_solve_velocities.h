// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Coloured projected Gauss-Seidel over the slots: warm start, then in every iteration all normal rows, all friction
// rows, all torsional rows, colour by colour. Reads slots, solverMasses; changes rows and solverBodies[]; writes the
// impulses into manifolds[].
class SolveVelocities {
 public:
  explicit SolveVelocities(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows);

 private:
  void solveAll(Queue& queue, DeviceWorld& world, uint passes);
  Kernel m_solveColour, m_solveSerial, m_storeImpulses;
};

}  // namespace btgpu
