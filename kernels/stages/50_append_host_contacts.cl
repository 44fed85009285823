// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The manifolds that the host found (shapes and callbacks that the device lacks) take their place behind those of the
// pairs; from here on the solver knows no difference.
#include "../lib/kernel.h"
#include "../shared/contact.h"

// Single work item: how many manifolds there are in all, and whether they fit.
SINGLE_KERNEL countHostContacts(uint capacity, __global const StepParams* params, __global StepCounters* counters,
                                __global uint* manifoldCount) {
  if (counters->overflow) return;
  *manifoldCount = counters->pairCount + params->hostManifoldCount;
  if (*manifoldCount > capacity) counters->overflow |= OVERFLOW_PAIRS;
}

KERNEL appendHostContacts(CHECKS __global const StepParams* params, __global const StepCounters* counters,
                          __global const Manifold* hostManifolds, __global Manifold* manifolds) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(k, params->hostManifoldCount) { AT(manifolds, counters->pairCount + k) = AT(hostManifolds, k); }
}
