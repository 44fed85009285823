// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// One object's state as the device's structs: pure functions of the object.
#pragma once

#include "../kernels/shared/body.h"
#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

// Everything of a body but its pose.
struct BodyRecord {
  BodyInfo info;
  BodyVelocity velocity;
  BodyForces forces;
  BodyMass mass;
  BodyMaterial material;
  BodyDamping damping;
  BodyActivation activation;
};

// `integrated`: the body is in the world's list of non-static rigid bodies.
BodyRecord readBody(const btCollisionObject& object, int shapeIndex, bool integrated);

// False if any number that the simulation computes with is NaN or infinite.
bool isFiniteBody(const BodyRecord& record, const BodyPose& pose);

BTGPU_TRANSLATION_END
