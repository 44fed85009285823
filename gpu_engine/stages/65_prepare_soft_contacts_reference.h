// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 65 in the fast mode, in float or double. The device must be off the double one by no more
// than eight times what the float one is, field by field over all slots, or by a few roundings of the field's largest
// value: what is chosen by a threshold (the direction of a slip that is next to nothing, restitution) may turn out
// otherwise only where float references of velocities one rounding off show it. How many contacts bounce is equal
// exactly.
#pragma once

#include <vector>

#include "../../kernels/shared/soft.h"
#include "65_prepare_contacts_reference.h"

namespace btgpu {

// What the stage writes. Rows of padding slots and of points that a manifold does not have stay as they are.
struct PrepareSoftReference {
  std::vector<SolverBody> solverBodies;
  std::vector<SolverMass> solverMasses;
  std::vector<BodyVelocity> starts;
  std::vector<Manifold> manifolds;  // in and out: the friction directions are noted in the points
  std::vector<float> rows, rolls;   // laid out as on the device
  uint bouncing = 0;
};

void prepareSoftContactsReference(const PrepareInput& in, PrepareSoftReference& out);

// `before`: rows and manifolds that the stage got.
void checkPreparedSoftContacts(Contract& contract, const PrepareInput& in, const PrepareSoftReference& before,
                               const PrepareSoftReference& device);

}  // namespace btgpu
