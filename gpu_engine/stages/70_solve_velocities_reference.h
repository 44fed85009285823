// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 70. Works in float like the kernel, but with Bullet's own formulation (Jacobian and
// response of every row precomputed), so it is rounded otherwise: each update of a row adds some tens of
// roundings of the velocities at hand, and these errors add up at most linearly over the updates that a body
// gets. The test derives its tolerance from that.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/rows.h"
#include "../../kernels/shared/step.h"

namespace btgpu {

struct SolveReference {
  std::vector<SolverBody> bodies;
  std::vector<float> rows, tangent2, torsion;  // laid out as on the device (rows.h)
  std::vector<Manifold> manifolds;             // get the impulses
};

// btSequentialImpulseConstraintSolver::solveSingleIteration for `iterations` times over the slots in their
// order, after warm starting, and writeBackContacts. Of params only the flags count.
void solveVelocitiesReference(const StepParams& params, int iterations, const std::vector<SlotHeader>& slots,
                              const std::vector<SolverMass>& masses, SolveReference& state);

}  // namespace btgpu
