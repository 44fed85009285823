// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// Islands by union-find over the pairs and joints, which of them sleep or wake, and which manifolds and joints the
// solver gets. Reads pairs, manifolds, joints, stepActivations; writes roots[], solved[] and the new stepActivations[] by body index, and
// constraints[] (ascending manifold indices) with constraintCount, and jointSolved[].
class BuildIslands {
 public:
  explicit BuildIslands(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_init, m_unite, m_uniteJoints, m_flatten, m_states, m_solved, m_selectJoints, m_select, m_count;
  Compact m_compact;
  DeviceArray<uint> m_parents{"island parents"}, m_wake{"wake flags"}, m_flags{"manifold flags"};
};

}  // namespace btgpu
