// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/kernel.h"

// Single work item: new counters for a substep that is launched on top of another one. If that one has to be repeated,
// or put bodies into quarantine, which the host has to hear of first, nothing of this substep happens.
SINGLE_KERNEL followSubstep(__global StepCounters* counters) {
  const int halted = counters->overflow || counters->quarantined;
  const StepCounters zero = {0};
  *counters = zero;
  if (halted) counters->overflow = OVERFLOW_BEFORE;
}
