// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 67, in double. Each value comes with how far a float may be off: what is only kept or copied
// not at all, what is scaled by the roundings of the sum that the scale is made of (24, relative to its summands) and
// of the scaling itself (6).
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/joint.h"
#include "../../kernels/shared/rows.h"
#include "../../kernels/shared/step.h"
#include "contract.h"

namespace btgpu {

struct SplitMassesInput {
  StepParams params{};
  std::vector<SlotHeader> slots;  // with copies
  std::vector<uint> copyFirst;
  std::vector<Manifold> manifolds;
  std::vector<BodyStep> steps;
  std::vector<BodyMass> masses;
  std::vector<SolverMass> solverMasses;
  std::vector<Joint> joints, splitJoints;
  std::vector<JointRow> jointRows;
};

// What the stage changes, as floats (jointEffects and the cfm of the split joint rows by row).
struct SplitMassesState {
  std::vector<float> rows, tangent2, torsion;
  std::vector<JointEffect> effects;
  std::vector<JointRow> splitRows;
  std::vector<SolverBody> copies;
  std::vector<SolverMass> copyMasses;
};

struct SplitMassesReference {
  SplitMassesState values;
  std::vector<double> rowLimits, tangent2Limits, torsionLimits;
  std::vector<double> shareLimits;  // by joint row: of its effect and cfm, relative to their values before
};

// `before`: as stage 65 left it.
SplitMassesReference splitMassesReference(const SplitMassesInput& in, const SplitMassesState& before);

void checkSplitMasses(Contract& contract, const SplitMassesInput& in, const SplitMassesState& before,
                      const SplitMassesState& device, const SplitMassesReference& expected);

}  // namespace btgpu
