// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Islands by union-find over the pairs and joints, which of them sleep or wake, and which manifolds and joints the
// solver gets. While no body sleeps or wants to, islands need not be known: each body is then one. Reads pairs,
// manifolds, joints, stepActivations; writes roots[], solved[] and the new stepActivations[] by body index, and
// constraints[] (ascending manifold indices) with constraintCount, and jointSolved[].
class BuildIslands {
 public:
  explicit BuildIslands(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void findIslands(Queue& queue, DeviceWorld& world);

  Kernel m_byOne;  // on the CPU shape, in place of those from m_unite to m_selectJoints where there is little to do
  Kernel m_init, m_unite, m_uniteJoints, m_flatten, m_states, m_selectJoints, m_select, m_list;
  DeviceArray<uint> m_kinds{"body kinds"}, m_parents{"island parents"}, m_wake{"wake flags"};
  DeviceArray<uint> m_flags{"manifold flags"}, m_chunkSums{"constraints of chunks"};
  DeviceArray<uint> m_restless{"who rests"};  // two words, for the steps in turn
  uint m_turn = 0;
};

}  // namespace btgpu
