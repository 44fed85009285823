// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Arrays of one step that only the solver variants need; empty in a world that is solved otherwise.
#pragma once

#include "opencl/kernel.h"

namespace btgpu {

// Solver::MassSplitting.
struct SplitArrays {
  DeviceArray<uint> copyFirst{"copy starts"};  // bodies + 1; stage 60: the first copy of each body
  DeviceArray<Joint> joints{
      "split joints"};  // stage 60: bodyA and bodyB are copies, NO_INDEX if the joint is not solved
  DeviceArray<SolverBody> copies{"body copies"};                // stages 67 and 70
  DeviceArray<SolverMass> copyMasses{"masses of body copies"};  // stage 67
  DeviceArray<JointRow> jointRows{"split joint rows"};          // stage 67
};

// Solver::TwoLevel. Groups are those of a phase one behind the other.
struct BatchArrays {
  DeviceArray<uint> split{"group split"};           // BATCH_SPLIT_SIZE; host: how constraints are split into groups
  DeviceArray<uint> groupBatches{"group batches"};  // groups; stage 60: how many batches each has
  DeviceArray<uint> batchFirst{"batch starts"};     // groups * BATCH_LIMIT + 1; stage 60: slots
};

}  // namespace btgpu
