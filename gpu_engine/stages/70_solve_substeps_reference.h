// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 70 in the fast mode. Every row, of contacts, friction and joints alike, is a pair of
// Jacobians with responses, and each substep begins with impulses applied row by row, where the kernels carry on
// velocities. It can be had in double: the device must be off that by no more than eight times what the float reference
// is, or by a few roundings of the largest value (as 70_solve_velocities_reference.h, and for the same reason; where
// rounding decides between two branches, float references of starts one rounding off tell how much that makes).
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/joint.h"
#include "../../kernels/shared/soft.h"
#include "../../kernels/shared/step.h"
#include "contract.h"

namespace btgpu {

struct SubstepJoints {
  std::vector<Joint> joints;
  std::vector<JointRow> rows;
  std::vector<JointEffect> effects;
  std::vector<uint> solved, order;
  std::vector<float> lastImpulses;
  std::vector<float> impulses;  // out
};

struct SubstepReference {
  std::vector<SolverBody> bodies;   // in: velocities as the first substep begins; out: as stage 80 wants them
  std::vector<float> rows, rolls;   // laid out as on the device
  std::vector<Manifold> manifolds;  // get the impulses
  SubstepJoints joints;
};

// `steps`: as stage 10 left them; `slots` in their order, colour by colour.
void solveSubstepsReference(const StepParams& params, const std::vector<BodyStep>& steps,
                            const std::vector<SlotHeader>& slots, const std::vector<SolverMass>& masses,
                            SubstepReference& state);

// `before`: as stage 65 left it; `device`: as stage 70 did.
void checkSolvedSubsteps(Contract& contract, const StepParams& params, const std::vector<BodyStep>& steps,
                         const std::vector<SlotHeader>& slots, const std::vector<SolverMass>& masses,
                         const SubstepReference& before, const SubstepReference& device);

}  // namespace btgpu
