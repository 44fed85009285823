// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pictures of worlds, drawn on the CPU: triangles, one light, its shadows; no OpenGL, no window. The background is
// transparent, and so is what stands still where it is far from the moving bodies.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "image.h"

namespace btgpu::tool {

struct Camera {
  btVector3 eye, right, up, forward;  // axes of length 1
  btVector3 focus;                    // middle of what is looked at
  btScalar radius;                    // of what is looked at
  btScalar tangentX, tangentY;        // of half the opening angles
};

// Sees the moving bodies of all `worlds`, all but the few that flew away, with the longer side across.
Camera cameraFor(const std::vector<const btDiscreteDynamicsWorld*>& worlds, int width, int height);

// A body has the same colour in all worlds that hold it at the same index.
Image drawWorld(const btDiscreteDynamicsWorld& world, const Camera& camera, int width, int height);

}  // namespace btgpu::tool
