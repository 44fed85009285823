// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "ray_caster.h"

#include "upload_all.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "queries/cast_rays.cl";

}  // namespace

RayCaster::RayCaster(ComputeDevice& device)
    : m_castRays(device, kFile, "castRays"),
      m_countHostItems(device, kFile, "countHostItems"),
      m_emitHostItems(device, kFile, "emitHostItems"),
      m_scan(device),
      m_device(device),
      m_host(device) {}

void RayCaster::upload(Queue& queue, const QueryItems& from, Items& to) {
  to.treeCount = from.treeCount;
  to.count = static_cast<uint>(from.infos.size());
  uploadAll(queue, from.infos, to.infos);
  uploadAll(queue, from.poses, to.poses);
  uploadAll(queue, from.childOf, to.childOf);
  uploadAll(queue, from.aabbs, to.aabbs);
  to.tree.sort(queue, to.treeCount, to.infos, to.aabbs);
  to.tree.refit(queue, to.treeCount, to.aabbs);
}

void RayCaster::upload(Queue& queue, const QueryWorld& world) {
  if (m_version == world.version) return;
  m_version = 0;  // until all is enqueued
  m_isDouble = world.isDouble ? 1 : 0;
  uploadAll(queue, world.children, m_children);
  uploadAll(queue, world.shapes.shapes.values, m_shapes);
  m_paddedVertices = world.shapes.hulls.vertices;
  m_paddedVertices.resize(m_paddedVertices.size() + HULL_PADDING);
  uploadAll(queue, m_paddedVertices, m_hullVertices);
  upload(queue, world.device, m_device);
  upload(queue, world.host, m_host);
  m_version = world.version;
}

void RayCaster::cast(Queue& queue, const QueryWorld& world, const Ray* rays, size_t count, RayResults& results) {
  queue.enterStage("cast_rays");
  results.hits.resize(count);
  results.hostFirst.clear();
  if (count == 0) return;
  upload(queue, world);
  m_rays.resize(queue, count);
  m_hits.resize(queue, count);
  queue.write(m_rays.buffer(), 0, count * sizeof(Ray), rays, false);
  m_castRays.launch(queue, queue.device().grid(count), static_cast<uint>(count), m_device.treeCount, m_device.count,
                    m_isDouble, m_device.tree.levels(), m_device.tree.nodes(), m_device.tree.order(), m_device.infos,
                    m_device.poses, m_device.childOf, m_children, m_shapes, m_hullVertices, m_rays, m_hits);
  queue.read(m_hits.buffer(), 0, count * sizeof(RayHit), results.hits.data(), m_host.count == 0);
  if (m_host.count > 0) findHostItems(queue, count, results);
}

void RayCaster::findHostItems(Queue& queue, size_t count, RayResults& results) {
  const Grid grid = queue.device().grid(count);
  const uint rays = static_cast<uint>(count);
  m_counts.resize(queue, count);
  m_offsets.resize(queue, count);
  m_total.resize(queue, 1);
  m_countHostItems.launch(queue, grid, rays, m_host.treeCount, m_host.count, m_host.tree.levels(), m_host.tree.nodes(),
                          m_host.tree.order(), m_host.infos, m_rays, m_hits, m_counts);
  m_scan.exclusive(queue, {count}, m_counts, m_offsets, m_total);
  const uint total = m_total.toVector(queue).front();
  m_offsets.copyToHost(queue, results.hostFirst, false);
  m_objects.resize(queue, std::max(1u, total));
  m_enters.resize(queue, std::max(1u, total));
  m_emitHostItems.launch(queue, grid, rays, m_host.treeCount, m_host.count, m_host.tree.levels(), m_host.tree.nodes(),
                         m_host.tree.order(), m_host.infos, m_rays, m_hits, m_offsets, m_objects, m_enters);
  results.hostObjects.resize(total);
  results.hostEnters.resize(total);
  queue.read(m_objects.buffer(), 0, total * sizeof(uint), results.hostObjects.data(), false);
  queue.read(m_enters.buffer(), 0, total * sizeof(float), results.hostEnters.data(), false);
  queue.finish();
  results.hostFirst.push_back(total);
}

}  // namespace btgpu
