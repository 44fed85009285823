// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "closest_points.h"

#include "upload_all.h"

namespace btgpu {

ClosestPoints::ClosestPoints(ComputeDevice& device)
    : m_closestPoints(device, "queries/closest_points.cl", "closestPoints") {}

void ClosestPoints::upload(Queue& queue, const QueryWorld& world) {
  if (m_version == world.version) return;
  m_version = 0;  // until all is enqueued
  const HullArrays& hulls = world.shapes.hulls;
  uploadAll(queue, world.shapes.shapes.values, m_shapes);
  m_paddedVertices = hulls.vertices;
  m_paddedVertices.resize(m_paddedVertices.size() + HULL_PADDING);
  uploadAll(queue, m_paddedVertices, m_hullVertices);
  uploadAll(queue, hulls.faces, m_hullFaces);
  uploadAll(queue, hulls.corners, m_hullCorners);
  uploadAll(queue, hulls.edges, m_hullEdges);
  m_version = world.version;
}

void ClosestPoints::find(Queue& queue, const QueryWorld& world, const std::vector<ClosestQuery>& queries,
                         std::vector<ClosestAnswer>& answers) {
  queue.enterStage("closest_points");
  answers.resize(queries.size());
  if (queries.empty()) return;
  upload(queue, world);
  uploadAll(queue, queries, m_queries);
  m_answers.resize(queue, queries.size());
  m_closestPoints.launch(queue, queue.device().grid(queries.size()), static_cast<uint>(queries.size()), m_shapes,
                         m_hullVertices, m_hullFaces, m_hullCorners, m_hullEdges, m_queries, m_answers);
  m_answers.copyToHost(queue, answers);
}

}  // namespace btgpu
