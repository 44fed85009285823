// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <array>

#include "../device_world.h"

namespace btgpu {

// Contact candidates of the analytic shape pairs, one kernel a bucket. Reads pairs, shapes, poses, oldManifolds;
// writes contacts[] by pair index. A bucket's kernel is built when a world first has such shapes.
class CollidePrimitives {
 public:
  // `shapeTypes`: bit SHAPE_* is set if the world has such a shape.
  void enqueue(Queue& queue, DeviceWorld& world, uint shapeTypes);

 private:
  std::array<Kernel, BUCKET_COUNT> m_kernels;
};

}  // namespace btgpu
