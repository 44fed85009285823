// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../opencl/host_array.h"
#include "../primitives/primitives.h"
#include "../step_results.h"

namespace btgpu {

// The contacts that the host wants to see (StepSettings::contacts): those with points, in pair order. Reads keys and
// manifolds; writes touching[] and fresh[]. In two halves, since only the counters of the finished step tell how many
// there are.
class GatherContacts {
 public:
  explicit GatherContacts(ComputeDevice& device);
  // Within the step: selects them, and counts them in StepCounters::touchingCount and ::freshCount. all: carried ones
  // are sent too, and not marked.
  void enqueue(Queue& queue, DeviceWorld& world, bool all);
  // After it: brings them, without waiting. The contacts stay until endReads(), which has to come before the next step:
  // on the CPU shape they are seen where the step has left them, since there a copy is nothing but time.
  void enqueueReads(Queue& queue, DeviceWorld& world, const StepCounters& counters, bool all);
  // Once the queue is finished: shows them.
  void show(StepResults& results);
  void endReads(Queue& queue) { m_view.unmap(queue); }

 private:
  bool m_inPlace;
  Kernel m_mark, m_count, m_gatherKeys, m_gather;
  Compact m_compact;
  DeviceArray<uint> m_touchingFlags{"touching flags"}, m_freshFlags{"fresh flags"};
  DeviceArray<uint> m_touchingCount{"touching count"}, m_freshCount{"fresh count"};
  DeviceArray<ulong> m_keys{"contact keys"};
  DeviceArray<Manifold> m_contacts{"contacts"};
  HostArray<ulong> m_hostKeys;
  HostArray<uint> m_hostIndices;       // CPU shape: of the contacts among all manifolds
  HostArray<Manifold> m_hostContacts;  // GPU shape
  HostView<Manifold> m_view;           // CPU shape: of the world's manifolds
};

}  // namespace btgpu
