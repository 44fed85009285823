// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../kernels/shared/step.h"
#include "step_settings.h"

namespace btgpu {

// What the kernels of a step are told of its settings.
StepParams makeStepParams(const StepSettings& settings, bool torsionRows);

}  // namespace btgpu
