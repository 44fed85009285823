// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "primitives.h"

#include <algorithm>
#include <utility>

namespace btgpu {
namespace {

constexpr size_t kLightItems = 4;  // that take as long as one of those that a grain is counted in

constexpr Grid kSingleGroupOf(size_t local) { return {local, local}; }

uint groupsOf(Grid grid) { return static_cast<uint>(grid.groups()); }

}  // namespace

Fill::Fill(ComputeDevice& device) : m_fill(device, "primitives/fill.cl", "fillUint") {}

void Fill::run(Queue& queue, DeviceArray<uint>& data, size_t first, size_t count, uint value) {
  if (count == 0) return;
  m_fill.launch(queue, queue.device().grid(count), static_cast<uint>(first), static_cast<uint>(count), value, data);
}

Reduce::Reduce(ComputeDevice& device)
    : m_partial(device, "primitives/reduce.cl", "reducePartial"),
      m_final(device, "primitives/reduce.cl", "reduceFinal") {}

void Reduce::sum(Queue& queue, Count count, const DeviceArray<uint>& data, DeviceArray<uint>& result) {
  const Grid grid = queue.device().chunkGrid(count.capacity);
  m_partials.resize(queue, grid.groups());
  result.resize(queue, 1);
  m_partial.launch(queue, grid, count.limit(), count.onDevice(), data, m_partials);
  m_final.launch(queue, kSingleGroupOf(grid.local), groupsOf(grid), m_partials, result);
}

Scan::Scan(ComputeDevice& device)
    : m_chunkSums(device, "primitives/scan.cl", "scanChunkSums"),
      m_chunks(device, "primitives/scan.cl", "scanChunks") {}

void Scan::exclusive(Queue& queue, Count count, const DeviceArray<uint>& in, DeviceArray<uint>& out,
                     DeviceArray<uint>& total) {
  // The only chunk begins at zero.
  const bool one = queue.device().isForOne(count.capacity / kLightItems);
  const Grid grid = one ? Grid{} : queue.device().chunkGrid(count.capacity);
  m_sums.resize(queue, grid.groups());
  out.resize(queue, count.capacity);
  total.resize(queue, 1);
  if (!one) m_chunkSums.launch(queue, grid, count.limit(), count.onDevice(), in, m_sums);
  m_chunks.launch(queue, grid, count.limit(), count.onDevice(), in, m_sums, out, total);
}

Compact::Compact(ComputeDevice& device)
    : m_scan(device),
      m_scatter(device, "primitives/compact.cl", "compactScatter"),
      m_byOne(device, "primitives/compact.cl", "compactByOne") {}

void Compact::run(Queue& queue, Count count, const DeviceArray<uint>& flags, DeviceArray<uint>& indices,
                  DeviceArray<uint>& total) {
  indices.resize(queue, count.capacity);
  if (queue.device().isForOne(count.capacity / kLightItems)) {
    total.resize(queue, 1);
    m_byOne.launch(queue, {}, count.limit(), count.onDevice(), flags, indices, total);
    return;
  }
  m_scan.exclusive(queue, count, flags, m_offsets, total);
  m_scatter.launch(queue, queue.device().grid(count.capacity), count.limit(), count.onDevice(), flags, m_offsets,
                   indices);
}

BoundSearch::BoundSearch(ComputeDevice& device) : m_search(device, "primitives/bound_search.cl", "boundSearch") {}

void BoundSearch::run(Queue& queue, Count count, const DeviceArray<uint>& data, size_t keyCount, uint upper,
                      DeviceArray<uint>& bounds) {
  bounds.resize(queue, keyCount);
  m_search.launch(queue, queue.device().grid(keyCount), count.limit(), count.onDevice(), static_cast<uint>(keyCount),
                  upper, data, bounds);
}

void BoundSearch::lower(Queue& queue, Count count, const DeviceArray<uint>& data, size_t keyCount,
                        DeviceArray<uint>& bounds) {
  run(queue, count, data, keyCount, 0u, bounds);
}

void BoundSearch::upper(Queue& queue, Count count, const DeviceArray<uint>& data, size_t keyCount,
                        DeviceArray<uint>& bounds) {
  run(queue, count, data, keyCount, 1u, bounds);
}

Histogram::Histogram(ComputeDevice& device)
    : m_tables(device, "primitives/histogram.cl", "histogramTables"),
      m_sum(device, "primitives/histogram.cl", "histogramSum") {}

void Histogram::run(Queue& queue, Count count, const DeviceArray<uint>& keys, size_t bins,
                    DeviceArray<uint>& histogram) {
  const Grid grid = queue.device().chunkGrid(count.capacity);
  m_counts.resize(queue, bins * grid.groups());
  histogram.resize(queue, bins);
  m_tables.launch(queue, grid, count.limit(), count.onDevice(), static_cast<uint>(bins), keys, m_counts);
  m_sum.launch(queue, queue.device().grid(bins), static_cast<uint>(bins), groupsOf(grid), m_counts, histogram);
}

namespace {

constexpr const char* keyOption(const uint*) { return ""; }
constexpr const char* keyOption(const ulong*) { return "-DBTGPU_KEY64"; }

}  // namespace

template <typename Key>
RadixSort<Key>::RadixSort(ComputeDevice& device)
    : m_count(device, "primitives/radix_sort.cl", "radixCount", keyOption(static_cast<Key*>(nullptr))),
      m_scatter(device, "primitives/radix_sort.cl", "radixScatter", keyOption(static_cast<Key*>(nullptr))),
      m_scanRows(device, "primitives/scan.cl", "scanRows"),
      m_radixBits(device.shape() == KernelShape::Cpu ? 8 : 6) {}  // RADIX_BITS in radix_sort.cl

template <typename Key>
void RadixSort<Key>::keys(Queue& queue, Count count, DeviceArray<Key>& keys, const std::vector<BitRange>& bits) {
  run(queue, count, keys, nullptr, bits);
}

template <typename Key>
void RadixSort<Key>::pairs(Queue& queue, Count count, DeviceArray<Key>& keys, DeviceArray<uint>& values,
                           const std::vector<BitRange>& bits) {
  run(queue, count, keys, &values, bits);
}

template <typename Key>
void RadixSort<Key>::run(Queue& queue, Count count, DeviceArray<Key>& keys, DeviceArray<uint>* values,
                         const std::vector<BitRange>& bits) {
  const Grid grid = queue.device().chunkGrid(count.capacity);
  const size_t radix = size_t{1} << m_radixBits, local = queue.device().groupSize();
  m_tables.resize(queue, radix * grid.groups());
  m_totals.resize(queue, radix);
  m_otherKeys.resize(queue, keys.size());
  if (values) m_otherValues.resize(queue, values->size());
  for (const BitRange range : bits) {
    for (uint done = 0; done < range.count; done += m_radixBits) {
      const uint shift = range.first + done;
      const uint mask = (1u << std::min(m_radixBits, range.count - done)) - 1u;
      m_count.launch(queue, grid, count.limit(), count.onDevice(), shift, mask, keys, m_tables);
      // On a GPU a group a row; on a CPU all rows together are little work.
      const size_t rowGroups = queue.device().shape() == KernelShape::Gpu ? mask + 1 : 1;
      m_scanRows.launch(queue, {rowGroups * local, local}, mask + 1, groupsOf(grid), m_tables, m_totals);
      m_scatter.launch(queue, grid, count.limit(), count.onDevice(), shift, mask, keys, Optional<uint>{values},
                       m_tables, m_totals, m_otherKeys, Optional<uint>{values ? &m_otherValues : nullptr});
      swap(keys, m_otherKeys);
      if (values) swap(*values, m_otherValues);
    }
  }
}

template class RadixSort<uint>;
template class RadixSort<ulong>;

FloatSort::FloatSort(ComputeDevice& device)
    : m_toKeys(device, "primitives/radix_sort.cl", "floatsToKeys"),
      m_toFloats(device, "primitives/radix_sort.cl", "keysToFloats"),
      m_sort(device) {}

void FloatSort::pairs(Queue& queue, Count count, DeviceArray<float>& floats, DeviceArray<uint>& values) {
  m_keys.resize(queue, floats.size());
  m_toKeys.launch(queue, queue.device().grid(count.capacity), count.limit(), count.onDevice(), floats, m_keys);
  m_sort.pairs(queue, count, m_keys, values, {{0, 32}});
  m_toFloats.launch(queue, queue.device().grid(count.capacity), count.limit(), count.onDevice(), m_keys, floats);
}

}  // namespace btgpu
