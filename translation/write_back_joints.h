// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "read_joints.h"

BTGPU_TRANSLATION_BEGIN

// Writes a step's impulses into the world's joints: applied impulse, joint feedback, and joints that break are
// disabled. Bullet's convertJoints and writeBackJoints. Joints of sleeping islands stay as they are, as in stock.
void writeBackJoints(btDiscreteDynamicsWorld& world, const JointReader& joints, const WorldInput& input,
                     const StepResults& results, btScalar timeStep);

BTGPU_TRANSLATION_END
