// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../opencl/host_array.h"
#include "../step_results.h"

namespace btgpu {

// The contacts that the host wants to see (StepSettings::contacts): those with points, in pair order. Reads keys and
// manifolds; writes touching[] and fresh[]. Only the counters of the finished step tell how many there are, but the
// host is not to wait twice: as many as there were the last time, and some more, are on their way before it waits at
// all.
class GatherContacts {
 public:
  explicit GatherContacts(ComputeDevice& device);
  // Within the step: selects them, and counts them in StepCounters::touchingCount and ::freshCount. all: carried ones
  // are sent too, and not marked.
  void enqueue(Queue& queue, DeviceWorld& world, bool all);
  // After it: brings as many as are expected, without waiting. The contacts stay until endReads(), which has to come
  // before the next step: on the CPU shape they are seen where the step has left them, since there a copy is nothing
  // but time.
  void enqueueReads(Queue& queue, DeviceWorld& world, bool all);
  // Once the queue is finished: shows them in `results`, whose counters are those of the step. Waits if there were more
  // than expected.
  void finishReads(Queue& queue, DeviceWorld& world, bool all, StepResults& results);
  void endReads(Queue& queue) { m_view.unmap(queue); }

 private:
  void read(Queue& queue, DeviceWorld& world, bool all);
  bool m_inPlace;
  size_t m_touching = 0, m_fresh = 0;  // on their way
  Kernel m_mark, m_list, m_gatherKeys, m_gather;
  DeviceArray<uint> m_flags{"contact flags"}, m_chunkSums{"contacts of chunks"};
  DeviceArray<ulong> m_keys{"contact keys"};
  DeviceArray<Manifold> m_contacts{"contacts"};
  HostArray<ulong> m_hostKeys;
  HostArray<uint> m_hostIndices;       // CPU shape: of the contacts among all manifolds
  HostArray<Manifold> m_hostContacts;  // GPU shape
  HostView<Manifold> m_view;           // CPU shape: of the world's manifolds
};

}  // namespace btgpu
