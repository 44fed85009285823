// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// The array of kernels/lib/batches.h (SPLIT_*): as many groups as there is work for.
std::vector<uint> splitForGroups(GroupSplit by, size_t bodyCount);

// In place of colours, for Solver::TwoLevel: groups of constraints, in phases, and batches of each group. Reads
// constraints, manifolds, steps, poses; writes slots[], batches.groupBatches[], batches.batchFirst[], slotFirst[] (only
// the serial batch is of interest there).
class BatchConstraints {
 public:
  explicit BatchConstraints(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings);

 private:
  void assignGroups(Queue& queue, DeviceWorld& world);

  Kernel m_list, m_assign, m_batch, m_begin, m_clear, m_fill;
  Histogram m_histogram;
  RadixSort<uint> m_sort;
  BoundSearch m_search;
  Scan m_scan;
  std::vector<uint> m_split;  // as on the device
  size_t m_groups = 0;        // of all phases
  DeviceArray<SlotHeader> m_headers{"constraint headers"};
  DeviceArray<uint> m_bins{"distances"}, m_distances{"histogram of distances"}, m_keys{"groups of constraints"},
      m_order{"constraints by group"}, m_groupFirst{"group starts"}, m_batchOf{"batches of constraints"},
      m_ranks{"ranks in batches"}, m_left{"constraints left"}, m_sizes{"batch sizes"}, m_total{"batched slots"};
};

}  // namespace btgpu
