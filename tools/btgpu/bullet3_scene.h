// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <btBulletDynamicsCommon.h>

#include "bullet3/bullet3_peer.h"

namespace btgpu::tool {

// The bodies of a world as Bullet3's pipeline takes them: boxes and spheres, as they are; static planes as large
// boxes. Throws InputError that names what else there is. What Bullet3 fixes in its code (bullet3_peer.h) is not kept.
Bullet3Scene convertToBullet3(const btDiscreteDynamicsWorld& world, btScalar timeStep);

}  // namespace btgpu::tool
