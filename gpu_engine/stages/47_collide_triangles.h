// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Contacts of each triangle that stage 40 found (touches[], by hit), and out of these at most four candidates for each
// pair in BUCKET_MESH (contacts[]).
class CollideTriangles {
 public:
  // shapeTypes: bit SHAPE_* for every shape in use; kernels are built when a world first has such shapes.
  void enqueue(Queue& queue, DeviceWorld& world, uint shapeTypes);

 private:
  void collide(Queue& queue, DeviceWorld& world, Kernel& kernel);

  Kernel m_collideSpheres, m_collideConvex, m_collideCurved, m_pickTouches;
};

}  // namespace btgpu
