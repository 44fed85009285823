// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 70. It walks the rows as the kernel does, but with Bullet's own formulation
// (Jacobian and response of every row precomputed), so it is rounded otherwise. The solver has no bound on
// how far rounding errors grow that would be of use, but it can be had in double as well: the device must be
// off the double result by no more than eight times what the float reference is (largest errors over many
// bodies, from equally many roundings of the same sizes in another order; where rounding decides whether a friction row
// is solved at all, what float references of rows one rounding off are), or by a few roundings of the
// largest value where that is nothing.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/joint.h"
#include "../../kernels/shared/rows.h"
#include "../../kernels/shared/step.h"
#include "contract.h"

namespace btgpu {

// Joints as the solver sees them; all by joint or by row but `order`, which lists joints as they are to be solved.
struct JointSolveReference {
  std::vector<Joint> joints;
  std::vector<JointRow> rows;
  std::vector<JointEffect> effects;
  std::vector<uint> solved, order;
  std::vector<float> impulses;  // in and out
};

struct SolveReference {
  std::vector<SolverBody> bodies;
  std::vector<float> rows, tangent2, torsion;  // laid out as on the device (rows.h)
  std::vector<Manifold> manifolds;             // get the impulses
  JointSolveReference joints;
  // Of 70_solve_splits, where `bodies` are copies: those of a body are copyFirst[i] ... copyFirst[i + 1] - 1, and are
  // averaged after warm starting and after each iteration. Empty: nothing is.
  std::vector<uint> copyFirst = {};
};

// btSequentialImpulseConstraintSolver::solveSingleIteration for `iterations` times over the slots in their
// order, with friction rows after the normal rows of their own manifold instead of all but in the last iteration
// (decision 14), after warm starting, and writeBackContacts; joints go first, and on alone if they want more
// iterations. Of params only the flags count.
void solveVelocitiesReference(const StepParams& params, int iterations, const std::vector<SlotHeader>& slots,
                              const std::vector<SolverMass>& masses, SolveReference& state);

// The same in double, rounded at the end.
void solveVelocitiesExactly(const StepParams& params, int iterations, const std::vector<SlotHeader>& slots,
                            const std::vector<SolverMass>& masses, SolveReference& state);

// `before`: as stage 65 left it; `device`: as stage 70 did.
void checkSolvedVelocities(Contract& contract, const StepParams& params, int iterations,
                           const std::vector<SlotHeader>& slots, const std::vector<SolverMass>& masses,
                           const SolveReference& before, const SolveReference& device);

}  // namespace btgpu
