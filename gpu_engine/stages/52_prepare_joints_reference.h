// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 52, in double. Equal within 32 float roundings of the summands that go into a value, which
// come along, since a right-hand side may be a small difference of large ones.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/joint.h"
#include "contract.h"

namespace btgpu {

struct JointEffectReference {
  double jac = 0, rhs = 0;
  double jacSize = 0;  // relative to jac: absolute summands of its inverse over their sum
  double rhsSize = 0;  // what rhs would be if all its summands had one sign
};

// btSequentialImpulseConstraintSolver::convertJoint from where the row has come back from getInfo2; by row.
std::vector<JointEffectReference> prepareJointsReference(const std::vector<Joint>& joints,
                                                         const std::vector<JointRow>& rows,
                                                         const std::vector<BodyStep>& steps);

void checkPreparedJoints(Contract& contract, const std::vector<JointEffect>& device, const std::vector<float>& impulses,
                         const std::vector<JointEffectReference>& expected);

}  // namespace btgpu
