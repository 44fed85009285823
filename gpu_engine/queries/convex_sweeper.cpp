// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "convex_sweeper.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "queries/cast_sweeps.cl";

}  // namespace

ConvexSweeper::ConvexSweeper(ComputeDevice& device)
    : m_castSweeps(device, kFile, "castSweeps"), m_hostItems(device, kFile) {}

void ConvexSweeper::cast(Queue& queue, QueryArrays& w, const QueryWorld& world, const Sweep* sweeps, size_t count,
                         SweepResults& results) {
  queue.enterStage("cast_sweeps");
  results.hits.resize(count);
  results.hostFirst.clear();
  if (count == 0) return;
  w.upload(queue, world);
  m_sweeps.resize(queue, count);
  m_hits.resize(queue, count);
  queue.write(m_sweeps.buffer(), 0, count * sizeof(Sweep), sweeps, false);
  m_castSweeps.launch(queue, queue.device().grid(count), static_cast<uint>(count), w.device.treeCount, w.device.count,
                      w.device.tree.levels(), w.device.tree.nodes(), w.device.tree.order(), w.device.infos,
                      w.device.poses, w.device.forms, w.children, w.shapes, w.hullVertices, w.hullFaces, w.hullCorners,
                      w.hullEdges, w.meshes, w.meshNodes, w.meshTriangles, m_sweeps, m_hits);
  queue.read(m_hits.buffer(), 0, count * sizeof(SweepHit), results.hits.data(), w.host.count == 0);
  if (w.host.count > 0) m_hostItems.find(queue, w.host, count, m_sweeps, m_hits, results);
}

}  // namespace btgpu
