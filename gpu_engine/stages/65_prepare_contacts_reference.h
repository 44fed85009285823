// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 65, in double, rounded once. What is copied must be equal exactly; a computed value
// must be equal within some tens of float roundings of the largest summand that goes into it, which
// checkPreparedContacts derives value by value (a velocity error may be a small difference of large velocities).
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/rows.h"
#include "../../kernels/shared/step.h"
#include "contract.h"

namespace btgpu {

// What the stage reads; arrays over all bodies, `slots` as stage 60 left them.
struct PrepareInput {
  StepParams params{};
  std::vector<BodyInfo> infos;
  std::vector<BodyPose> poses;
  std::vector<BodyStep> steps;
  std::vector<BodyMass> masses;
  std::vector<BodyMaterial> materials;
  std::vector<SlotHeader> slots;
};

// What it writes. The rows of padding slots and of points that a manifold does not have stay as they are.
struct PrepareReference {
  std::vector<SolverBody> solverBodies;
  std::vector<SolverMass> solverMasses;
  std::vector<Manifold> manifolds;             // in and out: the friction directions are noted in the points
  std::vector<float> rows, tangent2, torsion;  // laid out as on the device (rows.h)
};

// Bullet's btSequentialImpulseConstraintSolver::convertContact with setupContactConstraint,
// setupFrictionConstraint, setupTorsionalFrictionConstraint and applyAnisotropicFriction. A contact that
// Bullet skips has a normal row of zeros and friction rows without meaning (zero here).
void prepareContactsReference(const PrepareInput& in, PrepareReference& out);

// `before`: the manifolds that the stage got.
void checkPreparedContacts(Contract& contract, const PrepareInput& in, const std::vector<Manifold>& before,
                           const PrepareReference& device, const PrepareReference& expected);

// Index of float `field` of a slot in an array with `fields` floats a slot (rows.h).
size_t rowIndex(size_t slot, size_t fields, size_t field);

}  // namespace btgpu
