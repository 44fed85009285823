// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 10. Equal within 2e-6 relative to the larger of 1 and the value's own scale (see
// the test): the reference computes in double and rounds once, the kernel rounds every operation to float and
// has pow, sin and cos of the device. Exact: what must be zero, and the positions of bodies that do not move.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/step.h"

namespace btgpu {

// All arrays are indexed by body and equally long.
std::vector<BodyStep> applyForcesReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                                           const std::vector<BodyPose>& poses,
                                           const std::vector<BodyVelocity>& velocities,
                                           const std::vector<BodyForces>& forces, const std::vector<BodyMass>& masses,
                                           const std::vector<BodyDamping>& dampings);

}  // namespace btgpu
