// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "../bullet.h"

BTGPU_TRANSLATION_BEGIN

// What the application tells a joint's motors: on or off, targets, limits of force; in an order that is the joint's
// type's own. None of a joint without motors.
std::vector<btScalar> motorsOf(btTypedConstraint& joint);
// As motorsOf() had them of a joint of the same type; nothing happens without any.
void setMotors(btTypedConstraint& joint, const std::vector<btScalar>& motors);

BTGPU_TRANSLATION_END
