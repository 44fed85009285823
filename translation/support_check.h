// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>

#include "bullet.h"
#include "fallback_list.h"

BTGPU_TRANSLATION_BEGIN

// Adds to `missing` everything about the world itself that the device can't do yet: foreign solvers,
// dispatchers and callbacks, solver modes. Objects are checked while they are read (read_world.h), joints too
// (read_joints.h).
void checkWorld(btDiscreteDynamicsWorld& world, btScalar timeStep, FallbackList& missing);

// True if the application is told of pairs as they appear and go, by a callback that may change bodies: then
// the host's pairs have to be found before the bodies are read.
bool hasPairCallback(btDiscreteDynamicsWorld& world);

// Name of the callback by which the application takes part in every contact (of this object); null if there is none.
const char* globalContactCallback(const btCollisionDispatcher& dispatcher);
const char* contactCallback(const btCollisionObject& object);

// Types of shapes (bit XX_SHAPE_PROXYTYPE) that are the host's because the application has registered an algorithm for
// them. Of two types that it has one for, one of both.
std::uint64_t typesWithOwnAlgorithms(const btCollisionDispatcher& dispatcher);

// The same as checkWorld for one object of the world. True if it is supported.
bool checkObject(const btCollisionObject& object, FallbackList& missing);

// True if the object asks for continuous collision detection (setCcdMotionThreshold). Also one that sleeps: it may be
// woken and thrown within the step.
bool isSwept(const btCollisionObject& object);

BTGPU_TRANSLATION_END
