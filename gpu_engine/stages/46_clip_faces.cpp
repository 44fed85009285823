// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "46_clip_faces.h"

namespace btgpu {

ClipFaces::ClipFaces(ComputeDevice& device) : m_clipFaces(device, "stages/46_clip_faces.cl", "clipFaces") {}

void ClipFaces::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("46_clip_faces");
  const size_t capacity = world.capacities.pairs;
  m_clipFaces.launch(queue, queue.device().grid(capacity), world.counters, world.bucketFirst, world.items, world.pairs,
                     world.infos, world.shapes, world.poses, world.axes, world.contacts);
}

}  // namespace btgpu
