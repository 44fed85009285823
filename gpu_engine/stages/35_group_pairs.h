// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// Turns the sorted keys into pairs and lists them by the algorithm that finds their contacts.
// Reads keys, oldKeys, infos, shapes, stepActivations; writes pairs[] in key order, items[] (pair indices, bucket by
// bucket, ascending within) and bucketFirst[] (where each bucket begins in items[]).
class GroupPairs {
 public:
  explicit GroupPairs(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_describePairs;
  Kernel m_listPairs;  // on the CPU shape, and the two that follow on the GPU shape
  RadixSort<uint> m_sort;
  BoundSearch m_boundSearch;
  DeviceArray<uint> m_buckets{"pair buckets"}, m_tables{"pairs of buckets"};
};

}  // namespace btgpu
