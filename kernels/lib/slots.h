// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Headers of constraint slots, as all variants of stage 60 make them. OpenCL C only.
#ifndef BTGPU_LIB_SLOTS_H
#define BTGPU_LIB_SLOTS_H
#include "../shared/body.h"
#include "../shared/rows.h"
#include "kernel.h"

// A body that the solver can't move puts no constraints apart.
static inline uint movedBody(CHECKS __global const BodyStep* steps, uint body) {
  return AT(steps, body).angularVelocity.w != 0.0f ? body : NO_INDEX;
}

static inline SlotHeader headerOf(CHECKS uint manifold, __global const Manifold* manifolds,
                                  __global const BodyStep* steps) {
  SlotHeader header;
  header.bodyA = movedBody(WITH_CHECKS steps, AT(manifolds, manifold).bodyA);
  header.bodyB = movedBody(WITH_CHECKS steps, AT(manifolds, manifold).bodyB);
  header.manifold = manifold;
  header.pointCount = AT(manifolds, manifold).pointCount;
  ASSERT(header.pointCount <= MANIFOLD_POINTS, header.pointCount, manifold);
  return header;
}

static inline SlotHeader emptySlot(void) {
  SlotHeader header;
  header.bodyA = header.bodyB = header.manifold = NO_INDEX;
  header.pointCount = 0;
  return header;
}

static inline void fillSlot(CHECKS __global SlotHeader* slots, uint s, SlotHeader header) {
  AT(slots, s) = header;
}

static inline int hasFixedBody(SlotHeader h) { return h.bodyA == NO_INDEX || h.bodyB == NO_INDEX; }
static inline uint padded(uint size) { return (size + BTGPU_LANES - 1) / BTGPU_LANES * BTGPU_LANES; }

#endif
