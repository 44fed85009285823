// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

// Writes a step's results into Bullet's objects, through the calls that stock makes: velocities, transforms with
// interpolation state and world inertia, activation states and timers; and takes them over into the reader's mirror,
// with which it compares. A body that rests and that nobody has touched is not touched. Runs no callback.
void writeBackBodies(WorldReader& reader, const StepResults& results, btScalar timeStep);

BTGPU_TRANSLATION_END
