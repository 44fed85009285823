// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

// The AABB of a proxy relative to the origin, rounded outwards.
Aabb aabbOf(const btBroadphaseProxy& proxy, const double (&origin)[3]);

// For setForceUpdateAllAabbs(false): lists the AABBs of inactive objects that the device would otherwise take anew,
// since the application has changed something of theirs. `current`: the broadphase has been kept so.
void listKeptAabbs(const btCollisionWorld& world, bool current, WorldReader& reader);

BTGPU_TRANSLATION_END
