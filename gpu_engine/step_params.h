// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../kernels/shared/step.h"
#include "device_world.h"
#include "step_settings.h"

namespace btgpu {

// What the kernels of a step are told of its settings and of the room that the host launched for.
StepParams makeStepParams(const StepSettings& settings, const Capacities& capacities, bool torsionRows);

}  // namespace btgpu
