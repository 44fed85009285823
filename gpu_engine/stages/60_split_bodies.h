// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// In place of colours, for Solver::MassSplitting: a copy of each body for each of its constraints, and slots that name
// copies in place of bodies. Reads constraints, manifolds, steps, joints; writes slots[], slotFirst[] (all slots are of
// one colour), split.copyFirst[] and split.joints[].
class SplitBodies {
 public:
  explicit SplitBodies(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_begin, m_list, m_assign;
  RadixSort<uint> m_sort;
  BoundSearch m_search;
  DeviceArray<uint> m_keys{"bodies of ends"}, m_ends{"ends"}, m_endCount{"end count"};
};

}  // namespace btgpu
