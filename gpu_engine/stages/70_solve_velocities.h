// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "../device_world.h"

namespace btgpu {

// Coloured projected Gauss-Seidel: warm start, then in every iteration all joint rows, all contacts (the normal rows of
// a manifold, then its friction rows; in the last iteration all normal rows, then all friction rows), all torsional
// rows, colour by colour. Joints that want more iterations than the world get them afterwards,
// alone. Reads slots, joints, solverMasses; changes rows, jointImpulses[] and solverBodies[]; writes the impulses of
// contacts into manifolds[].
//
// On the CPU shape the members of one launch go through all colours and passes together, those of the joints included
// (docs/decisions/0011-solver-in-a-team.md, 0029-joints-in-the-team.md). On the GPU shape so do groups that are
// resident at once (docs/decisions/0025-solver-in-resident-groups.md), where a device has such; else each large colour
// of each pass is a launch. There a step gets the programs that are built for no more than it needs
// (docs/decisions/0028-solver-programs-for-a-step.md).
class SolveVelocities {
 public:
  explicit SolveVelocities(ComputeDevice& device, const char* name = "70_solve_velocities");
  virtual ~SolveVelocities() = default;
  void enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows);

 private:
  // All passes over all contacts in one launch, or a launch a colour: kernels of one program.
  struct ContactKernels {
    Kernel atOnce, colour, rest;
  };
  void build(ComputeDevice& device, const char* options, ContactKernels& kernels);
  ContactKernels& kernelsFor(Queue& queue, const std::vector<uint>& passes);
  // `repeats` times these passes over all contacts.
  virtual void solve(Queue& queue, DeviceWorld& world, const std::vector<uint>& passes, int repeats);
  static void solveColours(Queue& queue, DeviceWorld& world, uint passes, ContactKernels& kernels);
  void solveJoints(Queue& queue, DeviceWorld& world, uint iteration);
  // Where contacts are solved by a team, which then solves the joints too.
  virtual bool jointsInTeam() const { return m_inTeam; }
  void solveInTurn(Queue& queue, DeviceWorld& world, const StepSettings& settings, const std::vector<uint>& passes,
                   const std::vector<uint>& lastPasses);
  void solveJointsInTeam(Queue& queue, DeviceWorld& world, const StepSettings& settings,
                         const std::vector<uint>& passes, const std::vector<uint>& lastPasses);
  const char* m_name;
  bool m_inTeam;
  bool m_isPlain = false;                           // this step; what that is: SOLVE_PLAIN in kernels/lib/solve_slot.h
  ContactKernels m_general, m_plain, m_iterations;  // those built for less are of the GPU shape
  Kernel m_solveJointColour, m_solveJointsSerial, m_storeImpulses;
  Kernel m_solveJointsInTeam;  // built when a world first has joints
};

}  // namespace btgpu
