// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Coloured projected Gauss-Seidel: warm start, then in every iteration all joint rows, all normal rows, all friction
// rows, all torsional rows, colour by colour. Joints that want more iterations than the world get them afterwards,
// alone. Reads slots, joints, solverMasses; changes rows, jointImpulses[] and solverBodies[]; writes the impulses of
// contacts into manifolds[].
class SolveVelocities {
 public:
  explicit SolveVelocities(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows);

 private:
  void solveAll(Queue& queue, DeviceWorld& world, uint passes);
  void solveJoints(Queue& queue, DeviceWorld& world, uint iteration);
  Kernel m_solveColour, m_solveRest, m_solveJointColour, m_solveJointsSerial, m_storeImpulses;
};

}  // namespace btgpu
