// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// How far apart the surfaces of a pair may be for a contact.
#ifndef BTGPU_LIB_CONTACT_THRESHOLD_H
#define BTGPU_LIB_CONTACT_THRESHOLD_H
#include "../shared/contact.h"
#include "bounds.h"
#include "kernel.h"

// Of a slot: that of its body's shape, which for a compound is the compound's own, as in Bullet.
static float slotThreshold(CHECKS uint slot, __global const BodyInfo* infos, __global const Shape* shapes) {
  const BodyInfo info = AT(infos, slot);
  const int shape = info.flags & BODY_CHILD ? AT(infos, info.parent).shapeIndex : info.shapeIndex;
  return AT(shapes, shape).breakingThreshold;
}

// Of a pair: fixed with its manifold (btCollisionDispatcher::getNewManifold).
static float contactThreshold(CHECKS Pair pair, __global const BodyInfo* infos, __global const Shape* shapes,
                              __global const Manifold* oldManifolds) {
  if (pair.oldManifold != NO_INDEX) return AT(oldManifolds, pair.oldManifold).breakingThreshold;
  return fmin(slotThreshold(WITH_CHECKS pair.bodyA, infos, shapes), slotThreshold(WITH_CHECKS pair.bodyB, infos, shapes));
}

#endif
