// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 05. Equality is exact.
#pragma once

#include "../../kernels/shared/step.h"

namespace btgpu {

// The counters that a substep starts with, from those of the one before: all zero, and halted unless that one was
// whole.
inline StepCounters followSubstepReference(const StepCounters& before) {
  StepCounters counters{};
  counters.overflow = before.overflow != 0 || before.quarantined != 0 ? OVERFLOW_BEFORE : 0;
  return counters;
}

}  // namespace btgpu
