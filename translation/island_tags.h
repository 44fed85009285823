// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

// What stock's step leaves in btCollisionObject::getIslandTag and getCompanionId, from StepResults::roots. Two objects
// have the same tag where they are in the same island. A tag counts the objects that are neither static nor kinematic,
// as in stock; which one of an island lends it its number follows from the slots here, and from the order of the pairs
// there.
void writeIslandTags(const btCollisionObjectArray& objects, const WorldReader& reader, const StepResults& results);

BTGPU_TRANSLATION_END
