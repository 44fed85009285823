// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// One manifold a pair: candidates reduced to four points and merged into the manifold of the last step.
// Reads pairs, contacts, oldManifolds; writes manifolds[] in pair order.
class ReduceAndMatchContacts {
 public:
  explicit ReduceAndMatchContacts(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_matchContacts;
};

}  // namespace btgpu
