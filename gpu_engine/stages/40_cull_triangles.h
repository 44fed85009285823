// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// The triangles of meshes whose box overlaps that of the shape that a pair in BUCKET_MESH has besides. Reads pairs,
// shapes, poses and the meshes; writes triangleHits[], pair by pair and in the order of the tree, with triangleFound[]
// and triangleFirst[] by search; groups of a mesh's parts are the searches of a pair (DeviceWorld::triangleGroups).
class CullTriangles {
 public:
  explicit CullTriangles(ComputeDevice& device) : m_scan(device) {}
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_countSearches, m_countTriangles, m_emitTriangles;  // built when a world first has a mesh
  Scan m_scan;
  DeviceArray<uint> m_searchCount{"triangle searches"}, m_total{"triangle hit count"};
  DeviceArray<TriangleHit> m_kept{"kept triangle hits"};
};

}  // namespace btgpu
