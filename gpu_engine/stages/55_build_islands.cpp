// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "55_build_islands.h"

#include <algorithm>

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
      m_selectJoints(device, kFile, "selectJoints"),
      m_select(device, kFile, "selectManifolds"),
      m_list(device, kFile, "listConstraints") {
  if (device.shape() == KernelShape::Cpu) m_byOne = Kernel(device, kFile, "islandsByOne");
}

void BuildIslands::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("55_build_islands");
  const uint bodies = static_cast<uint>(world.bodyCount), pairs = static_cast<uint>(world.capacities.pairs);
  const Grid bodyGrid = queue.device().grid(bodies);
  const Grid chunks = queue.device().chunkGrid(pairs);
  m_kinds.resize(queue, bodies);
  m_parents.resize(queue, bodies);
  m_wake.resize(queue, bodies);
  m_flags.resize(queue, pairs);
  m_chunkSums.resize(queue, chunks.groups());
  if (m_restless.empty()) m_restless.copyFromHost(queue, {0, 0});
  m_turn = 1 - m_turn;
  m_init.launch(queue, bodyGrid, bodies, m_turn, world.counters, world.infos, world.stepActivations, world.steps,
                m_kinds, m_parents, world.islandFlags, m_wake, world.solved, m_restless);
  if (queue.device().isForOne(std::max(bodies, world.jointCount))) {
    m_byOne.launch(queue, {}, bodies, pairs, world.jointCount, m_turn, world.counters, world.params, world.pairs,
                   world.manifolds, world.infos, world.joints, m_restless, m_kinds, m_parents, m_wake, world.roots,
                   world.islandFlags, world.stepActivations, world.solved, world.jointSolved);
  } else {
    findIslands(queue, world);
  }
  m_select.launch(queue, chunks, pairs, bodies, world.counters, world.params, world.manifolds, m_kinds, world.roots,
                  world.islandFlags, world.solved, m_flags, m_chunkSums);
  m_list.launch(queue, chunks, pairs, world.counters, world.params, m_flags, m_chunkSums, world.constraints,
                world.constraintCount);
}

void BuildIslands::findIslands(Queue& queue, DeviceWorld& world) {
  const uint bodies = static_cast<uint>(world.bodyCount), pairs = static_cast<uint>(world.capacities.pairs);
  const Grid bodyGrid = queue.device().grid(bodies), pairGrid = queue.device().grid(pairs);
  m_unite.launch(queue, pairGrid, pairs, m_turn, world.counters, world.params, world.pairs, world.manifolds,
                 world.infos, m_kinds, m_restless, m_parents, m_wake);
  const Grid jointGrid = queue.device().grid(world.jointCount);
  if (world.jointCount > 0) {
    m_uniteJoints.launch(queue, jointGrid, world.jointCount, m_turn, world.counters, world.params, world.joints,
                         m_restless, m_parents);
  }
  m_flatten.launch(queue, bodyGrid, bodies, world.counters, m_kinds, world.stepActivations, m_parents, world.roots,
                   world.islandFlags);
  m_states.launch(queue, bodyGrid, bodies, world.counters, world.roots, m_wake, m_kinds, world.islandFlags,
                  world.stepActivations);
  if (world.jointCount > 0) {
    m_selectJoints.launch(queue, jointGrid, world.jointCount, world.counters, world.joints, m_kinds, world.roots,
                          world.islandFlags, world.solved, world.jointSolved);
  }
}

}  // namespace btgpu
