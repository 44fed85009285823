// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Puts the host's manifolds behind those of the pairs: manifolds[pairCount + k] = hostManifolds[k]; manifoldCount is the
// number of both. Launched only if the host found any.
class AppendHostContacts {
 public:
  explicit AppendHostContacts(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_count, m_append;
};

}  // namespace btgpu
