// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../gpu_engine/step_settings.h"
#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

// The world's solver and dispatch settings and Bullet's globals, as they are now.
StepSettings readSettings(btDiscreteDynamicsWorld& world, btScalar timeStep);

BTGPU_TRANSLATION_END
