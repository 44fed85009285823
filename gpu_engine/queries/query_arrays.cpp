// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "query_arrays.h"

#include "upload_all.h"

namespace btgpu {

QueryArrays::QueryArrays(ComputeDevice& d) : device(d), host(d) {}

void QueryArrays::upload(Queue& queue, const QueryItems& from, Items& to) {
  to.treeCount = from.treeCount;
  to.count = static_cast<uint>(from.infos.size());
  uploadAll(queue, from.infos, to.infos);
  uploadAll(queue, from.poses, to.poses);
  uploadAll(queue, from.forms, to.forms);
  uploadAll(queue, from.aabbs, to.aabbs);
  to.tree.sort(queue, to.treeCount, to.infos, to.aabbs);
  to.tree.refit(queue, to.treeCount, to.infos, to.aabbs);
}

void QueryArrays::upload(Queue& queue, const QueryWorld& world) {
  if (m_version == world.version) return;
  m_version = 0;  // until all is enqueued
  isDouble = world.isDouble ? 1 : 0;
  uploadAll(queue, world.children, children);
  uploadAll(queue, world.shapes.shapes.values, shapes);
  m_paddedVertices = world.shapes.hulls.vertices;
  m_paddedVertices.resize(m_paddedVertices.size() + HULL_PADDING);
  uploadAll(queue, m_paddedVertices, hullVertices);
  uploadAll(queue, world.shapes.hulls.faces, hullFaces);
  uploadAll(queue, world.shapes.hulls.corners, hullCorners);
  uploadAll(queue, world.shapes.hulls.edges, hullEdges);
  uploadAll(queue, world.spheres, spheres);
  uploadAll(queue, world.shapes.meshes.meshes, meshes);
  uploadAll(queue, world.shapes.meshes.nodes, meshNodes);
  uploadAll(queue, world.shapes.meshes.triangles, meshTriangles);
  upload(queue, world.device, device);
  upload(queue, world.host, host);
  m_version = world.version;
}

}  // namespace btgpu
