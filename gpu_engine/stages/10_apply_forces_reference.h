// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 10. It computes in double and rounds once; the kernel rounds every operation to float and
// has pow, sin and cos of the device: checkAppliedForces says how far off a value may be. Exact: what must be zero, and
// the positions of bodies that do not move.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/step.h"
#include "contract.h"

namespace btgpu {

// All arrays are indexed by body and equally long.
std::vector<BodyStep> applyForcesReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                                           const std::vector<BodyPose>& poses,
                                           const std::vector<BodyVelocity>& velocities,
                                           const std::vector<BodyForces>& forces, const std::vector<BodyMass>& masses,
                                           const std::vector<BodyDamping>& dampings);

void checkAppliedForces(Contract& contract, const StepParams& params, const std::vector<BodyMass>& masses,
                        const std::vector<BodyStep>& device, const std::vector<BodyStep>& expected);

}  // namespace btgpu
