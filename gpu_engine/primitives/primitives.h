// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The parallel primitives of the paper ("Use Parallel Primitives"), each with a body for GPUs and one for CPU
// devices behind one interface. All are deterministic. None waits for the device.
#pragma once

#include <vector>

#include "../opencl/kernel.h"

namespace btgpu {

// How many items a primitive works on: `capacity`, or the smaller of that and a counter on the device.
struct Count {
  size_t capacity;
  const DeviceArray<uint>* counter = nullptr;

  uint limit() const { return static_cast<uint>(capacity); }
  Optional<uint> onDevice() const { return {counter}; }
};

class Fill {
 public:
  explicit Fill(ComputeDevice& device);
  // data[first, first + count) = value
  void run(Queue& queue, DeviceArray<uint>& data, size_t first, size_t count, uint value);

 private:
  Kernel m_fill;
};

class Reduce {
 public:
  explicit Reduce(ComputeDevice& device);
  // result[0] = sum of data[0, count), modulo 2^32.
  void sum(Queue& queue, Count count, const DeviceArray<uint>& data, DeviceArray<uint>& result);

 private:
  Kernel m_partial, m_final;
  DeviceArray<uint> m_partials{"reduce partial sums"};
};

class Scan {
 public:
  explicit Scan(ComputeDevice& device);
  // out[i] = in[0] + ... + in[i - 1], total[0] = the sum of all, modulo 2^32. `in` and `out` may be the same array.
  void exclusive(Queue& queue, Count count, const DeviceArray<uint>& in, DeviceArray<uint>& out,
                 DeviceArray<uint>& total);

 private:
  Kernel m_chunkSums, m_chunks;
  DeviceArray<uint> m_sums{"scan chunk sums"};
};

class Compact {
 public:
  explicit Compact(ComputeDevice& device);
  // indices[0, total[0]) = ascending indices i with flags[i] = 1. Flags are 0 or 1.
  void run(Queue& queue, Count count, const DeviceArray<uint>& flags, DeviceArray<uint>& indices,
           DeviceArray<uint>& total);

 private:
  Scan m_scan;
  Kernel m_scatter, m_byOne;
  DeviceArray<uint> m_offsets{"compaction offsets"};
};

class BoundSearch {
 public:
  explicit BoundSearch(ComputeDevice& device);
  // bounds[k] = index of the first element of sorted data[0, count) that is >= k (lower) or > k (upper), for the
  // keys k in [0, keyCount); `count` if there is none.
  void lower(Queue& queue, Count count, const DeviceArray<uint>& data, size_t keyCount, DeviceArray<uint>& bounds);
  void upper(Queue& queue, Count count, const DeviceArray<uint>& data, size_t keyCount, DeviceArray<uint>& bounds);

 private:
  void run(Queue& queue, Count count, const DeviceArray<uint>& data, size_t keyCount, uint upper,
           DeviceArray<uint>& bounds);
  Kernel m_search;
};

class Histogram {
 public:
  explicit Histogram(ComputeDevice& device);
  // histogram[b] = how many of keys[0, count) equal b, for b in [0, bins).
  void run(Queue& queue, Count count, const DeviceArray<uint>& keys, size_t bins, DeviceArray<uint>& histogram);

 private:
  Kernel m_tables, m_sum;
  DeviceArray<uint> m_counts{"histogram tables"};
};

// Bits [first, first + count) of a key.
struct BitRange {
  uint first, count;
};

// Stable sort by the given bits of the keys, lowest range first, so that the last one counts most; all other bits are
// ignored. Sorts [0, count); what the arrays hold behind that is lost.
template <typename Key>
class RadixSort {
 public:
  explicit RadixSort(ComputeDevice& device);
  void keys(Queue& queue, Count count, DeviceArray<Key>& keys, const std::vector<BitRange>& bits);
  void pairs(Queue& queue, Count count, DeviceArray<Key>& keys, DeviceArray<uint>& values,
             const std::vector<BitRange>& bits);

 private:
  void run(Queue& queue, Count count, DeviceArray<Key>& keys, DeviceArray<uint>* values,
           const std::vector<BitRange>& bits);

  Kernel m_count, m_scatter, m_scanRows;
  uint m_radixBits;
  DeviceArray<uint> m_tables{"radix tables"}, m_totals{"radix totals"}, m_otherValues{"radix values"};
  DeviceArray<Key> m_otherKeys{"radix keys"};
};

extern template class RadixSort<uint>;
extern template class RadixSort<ulong>;

// Floats sorted by order-preserving keys (-0 before +0; NaN at the ends by sign).
class FloatSort {
 public:
  explicit FloatSort(ComputeDevice& device);
  void pairs(Queue& queue, Count count, DeviceArray<float>& floats, DeviceArray<uint>& values);

 private:
  Kernel m_toKeys, m_toFloats;
  RadixSort<uint> m_sort;
  DeviceArray<uint> m_keys{"float sort keys"};
};

}  // namespace btgpu
