// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "55_build_islands.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/55_build_islands.cl";

}  // namespace

BuildIslands::BuildIslands(ComputeDevice& device)
    : m_init(device, kFile, "islandInit"),
      m_unite(device, kFile, "islandUnite"),
      m_uniteJoints(device, kFile, "islandUniteJoints"),
      m_flatten(device, kFile, "islandFlatten"),
      m_states(device, kFile, "islandStates"),
      m_solved(device, kFile, "islandSolved"),
      m_selectJoints(device, kFile, "selectJoints"),
      m_select(device, kFile, "selectManifolds"),
      m_count(device, kFile, "countConstraints"),
      m_compact(device) {}

void BuildIslands::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("55_build_islands");
  const uint bodies = static_cast<uint>(world.bodyCount), pairs = static_cast<uint>(world.capacities.pairs);
  const Grid bodyGrid = queue.device().grid(bodies), pairGrid = queue.device().grid(pairs);
  m_parents.resize(queue, bodies);
  m_wake.resize(queue, bodies);
  m_flags.resize(queue, pairs);
  m_init.launch(queue, bodyGrid, bodies, m_parents, world.islandFlags, m_wake);
  m_unite.launch(queue, pairGrid, pairs, world.counters, world.params, world.pairs, world.manifolds, world.infos,
                 world.stepActivations, m_parents, m_wake);
  const Grid jointGrid = queue.device().grid(world.jointCount);
  if (world.jointCount > 0) {
    m_uniteJoints.launch(queue, jointGrid, world.jointCount, world.counters, world.joints, m_parents);
  }
  m_flatten.launch(queue, bodyGrid, bodies, world.counters, world.infos, world.stepActivations, m_parents, world.roots,
                   world.islandFlags);
  m_states.launch(queue, bodyGrid, bodies, world.counters, world.infos, world.roots, m_wake, world.islandFlags,
                  world.stepActivations);
  m_solved.launch(queue, bodyGrid, bodies, world.counters, world.infos, world.roots, world.islandFlags, world.solved);
  if (world.jointCount > 0) {
    m_selectJoints.launch(queue, jointGrid, world.jointCount, world.counters, world.joints, world.infos, world.steps,
                          world.roots, world.islandFlags, world.solved, world.jointSolved);
  }
  m_select.launch(queue, pairGrid, pairs, world.counters, world.params, world.manifolds, world.infos,
                  world.stepActivations, world.steps, world.roots, world.islandFlags, world.solved, m_flags);
  const auto& manifoldCount = world.hostManifoldCount > 0 ? world.manifoldCount : world.pairCount;
  m_compact.run(queue, {pairs, &manifoldCount}, m_flags, world.constraints, world.constraintCount);
  m_count.launch(queue, {1, 1}, world.constraintCount, world.counters);
}

}  // namespace btgpu
