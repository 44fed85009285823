// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

// Writes a step's results into Bullet's objects, through the calls that stock makes: velocities, transforms with
// interpolation state and world inertia, activation states and timers; and takes them over into the reader's mirror,
// with which it compares. A body that rests and that nobody has touched is not touched. Runs no callback. False if
// there was nothing to write to any object: all of them rest.
bool writeBackBodies(WorldReader& reader, const StepResults& results, btScalar timeStep);

// Slots of the bodies that go farther in the step than their CCD motion threshold: stock sweeps them.
std::vector<std::uint32_t> fastBodies(const WorldReader& reader, const StepResults& results, btScalar timeStep);

// The same as writeBackBodies, one after the other in the order of `bodies`, the world's list, as stock integrates
// them. Those of `fast` (ascending) are moved by `sweep` (btDiscreteDynamicsWorld::integrateTransformsInternal), from
// where they were with the velocities of the solver: as in stock bodies before them are where they go, those behind
// them where they were. What becomes of them the device learns in the next step.
using Sweep = std::function<void(btRigidBody& body)>;
void writeBackInOrder(WorldReader& reader, const StepResults& results, btScalar timeStep,
                      const btAlignedObjectArray<btRigidBody*>& bodies, const std::vector<std::uint32_t>& fast,
                      const Sweep& sweep);

BTGPU_TRANSLATION_END
