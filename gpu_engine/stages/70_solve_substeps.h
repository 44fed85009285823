// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "../device_world.h"

namespace btgpu {

// In place of stage 70's other variant in the fast mode (docs/fast_mode.md): the step in substeps. In each, joints and
// then contacts, colour by colour, with what their position errors ask for; the bodies move; joints and contacts once
// more, without that. In the end restitution. Reads slots, joints, steps, solverMasses; changes softRows,
// softJointRows[], substepStarts[] and solverBodies[]; writes jointImpulses[] and the impulses of contacts into
// manifolds[].
//
// On the CPU shape the members of one launch, or of two a substep if there are joints, go through all colours, passes
// and bodies together (docs/decisions/0011-solver-in-a-team.md); on the GPU shape each large colour of each pass is a
// launch.
class SolveSubsteps {
 public:
  void enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings);

 private:
  void build(ComputeDevice& device);
  void buildForJoints(ComputeDevice& device);
  void run(Queue& queue, DeviceWorld& world, const std::vector<uint>& passes, uint substep, uint repeats = 1);
  void runPass(Queue& queue, DeviceWorld& world, uint pass, uint substep);
  void prepareJoints(Queue& queue, DeviceWorld& world);
  void runJoints(Queue& queue, DeviceWorld& world, uint pass, uint substep);

  // Built when they are first needed.
  Kernel m_inTeam, m_colour, m_rest, m_bodies, m_storeImpulses;
  Kernel m_prepareJoints, m_jointColour, m_jointsSerial;
};

}  // namespace btgpu
