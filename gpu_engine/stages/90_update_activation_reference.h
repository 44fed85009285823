// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 90. Must be equal exactly: a timer grows by one float addition, and the comparison
// with the sleeping threshold is the same float expression, so that even a speed on the threshold is decided
// alike.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/step.h"

namespace btgpu {

// btDiscreteDynamicsWorld::updateActivationState. `activations`: in, as stage 55 left them; out, the state of
// the world. Velocities of sleeping bodies become zero.
void updateActivationReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                               const std::vector<BodyDamping>& dampings, std::vector<BodyVelocity>& velocities,
                               std::vector<BodyActivation>& activations);

}  // namespace btgpu
