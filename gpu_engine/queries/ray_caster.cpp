// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "ray_caster.h"

#include "upload_all.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "queries/cast_rays.cl";

}  // namespace

RayCaster::RayCaster(ComputeDevice& device) : m_castRays(device, kFile, "castRays"), m_hostItems(device, kFile) {}

void RayCaster::cast(Queue& queue, QueryArrays& w, const QueryWorld& world, const Ray* rays, size_t count,
                     RayResults& results) {
  queue.enterStage("cast_rays");
  results.hits.resize(count);
  results.hostFirst.clear();
  if (count == 0) return;
  w.upload(queue, world);
  m_rays.resize(queue, count);
  m_hits.resize(queue, count);
  queue.write(m_rays.buffer(), 0, count * sizeof(Ray), rays, false);
  m_castRays.launch(queue, queue.device().grid(count), static_cast<uint>(count), w.device.treeCount, w.device.count,
                    w.isDouble, w.device.tree.levels(), w.device.tree.nodes(), w.device.tree.order(), w.device.infos,
                    w.device.poses, w.device.forms, w.children, w.shapes, w.hullVertices, w.spheres, w.meshes,
                    w.meshNodes, w.meshTriangles, m_rays, m_hits);
  queue.read(m_hits.buffer(), 0, count * sizeof(RayHit), results.hits.data(), w.host.count == 0);
  if (w.host.count > 0) m_hostItems.find(queue, w.host, count, m_rays, m_hits, results);
}

}  // namespace btgpu
