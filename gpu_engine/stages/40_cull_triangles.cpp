// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "40_cull_triangles.h"

namespace btgpu {
namespace {

// Searches that keep a GPU busy. A CPU has enough of them with one a pair.
constexpr size_t kSearches = 1 << 16;

uint groupsFor(const ComputeDevice& device, size_t pairCapacity, uint mostParts) {
  if (device.shape() == KernelShape::Cpu || mostParts == 0) return 1;
  return static_cast<uint>(std::clamp<size_t>(kSearches / std::max<size_t>(1, pairCapacity), 1, mostParts));
}

}  // namespace

void CullTriangles::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("40_cull_triangles");
  if (!m_emitTriangles.isBuilt()) {
    constexpr const char* kFile = "stages/40_cull_triangles.cl";
    m_countSearches = Kernel(queue.device(), kFile, "countSearches");
    m_countTriangles = Kernel(queue.device(), kFile, "countTriangles");
    m_emitTriangles = Kernel(queue.device(), kFile, "emitTriangles");
  }
  DeviceWorld& w = world;
  w.triangleGroups = groupsFor(queue.device(), w.capacities.pairs, w.mostMeshParts);
  const size_t searches = w.capacities.pairs * w.triangleGroups;
  const auto grid = queue.device().grid(searches);
  w.triangleFound.resize(queue, searches);
  w.triangleFirst.resize(queue, searches);
  m_kept.resize(queue, searches * HITS_KEPT);
  m_searchCount.resize(queue, 1);
  m_total.resize(queue, 1);
  m_countSearches.launch(queue, {1, 1}, w.counters, w.bucketFirst, w.triangleGroups, m_searchCount);
  m_countTriangles.launch(queue, grid, m_searchCount, static_cast<uint>(searches), w.triangleGroups, w.bucketFirst,
                          w.items, w.pairs, w.infos, w.shapes, w.hullVertices, w.poses, w.meshes, w.meshParts,
                          w.meshNodes, w.meshTriangles, w.triangleFound, m_kept);
  m_scan.exclusive(queue, {searches, &m_searchCount}, w.triangleFound, w.triangleFirst, m_total);
  m_emitTriangles.launch(queue, grid, m_searchCount, static_cast<uint>(searches), w.triangleGroups,
                         static_cast<uint>(w.capacities.triangleHits), m_total, w.bucketFirst, w.items, w.pairs,
                         w.infos, w.shapes, w.hullVertices, w.poses, w.meshes, w.meshParts, w.meshNodes,
                         w.meshTriangles, w.triangleFound, w.triangleFirst, m_kept, w.counters, w.triangleHits);
}

}  // namespace btgpu
