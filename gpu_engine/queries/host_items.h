// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "query_arrays.h"

namespace btgpu {

// Lists, for each of many rays or sweeps, the objects that only the host can try it against.
class HostItems {
 public:
  // `file`: has the kernels countHostItems and emitHostItems.
  HostItems(ComputeDevice& device, const char* file)
      : m_count(device, file, "countHostItems"), m_emit(device, file, "emitHostItems"), m_scan(device) {}

  // `asking`, `hits`: rays or sweeps, and what they hit on the device. Waits.
  template <typename Asking, typename Hit>
  void find(Queue& queue, const QueryArrays::Items& items, size_t count, const DeviceArray<Asking>& asking,
            const DeviceArray<Hit>& hits, HostLists& lists) {
    const Grid grid = queue.device().grid(count);
    const uint n = static_cast<uint>(count);
    m_counts.resize(queue, count);
    m_offsets.resize(queue, count);
    m_total.resize(queue, 1);
    m_count.launch(queue, grid, n, items.treeCount, items.count, items.tree.levels(), items.tree.nodes(),
                   items.tree.order(), items.infos, asking, hits, m_counts);
    m_scan.exclusive(queue, {count}, m_counts, m_offsets, m_total);
    const uint total = m_total.toVector(queue).front();
    m_offsets.copyToHost(queue, lists.hostFirst, false);
    m_objects.resize(queue, std::max(1u, total));
    m_enters.resize(queue, std::max(1u, total));
    m_emit.launch(queue, grid, n, items.treeCount, items.count, items.tree.levels(), items.tree.nodes(),
                  items.tree.order(), items.infos, asking, hits, m_offsets, m_objects, m_enters);
    lists.hostObjects.resize(total);
    lists.hostEnters.resize(total);
    queue.read(m_objects.buffer(), 0, total * sizeof(uint), lists.hostObjects.data(), false);
    queue.read(m_enters.buffer(), 0, total * sizeof(float), lists.hostEnters.data(), false);
    queue.finish();
    lists.hostFirst.push_back(total);
  }

 private:
  Kernel m_count, m_emit;
  Scan m_scan;
  DeviceArray<uint> m_counts{"host items of queries"}, m_offsets{"offsets of host items"}, m_total{"host item count"};
  DeviceArray<uint> m_objects{"host objects of queries"};
  DeviceArray<float> m_enters{"where queries enter host objects"};
};

}  // namespace btgpu
