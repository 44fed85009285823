// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "reference.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace btgpu::reference {
namespace {

// Reorders `items` and `values` alike, stably, by less(item, item).
template <typename T, typename Less>
void sortWithValues(std::vector<T>& items, std::vector<uint>& values, Less less) {
  std::vector<size_t> order(items.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return less(items[a], items[b]); });
  const std::vector<T> oldItems = items;
  const std::vector<uint> oldValues = values;
  for (size_t i = 0; i < order.size(); ++i) {
    items[i] = oldItems[order[i]];
    values[i] = oldValues[order[i]];
  }
}

bool totalLess(float a, float b) {
  if (std::signbit(a) != std::signbit(b)) return std::signbit(a);
  if (std::isnan(a) || std::isnan(b)) {
    if (std::isnan(a) && std::isnan(b)) return std::signbit(a) ? as_uint(a) > as_uint(b) : as_uint(a) < as_uint(b);
    return std::isnan(a) == std::signbit(a);
  }
  return a < b;
}

}  // namespace

uint sum(const std::vector<uint>& data) { return std::accumulate(data.begin(), data.end(), 0u); }

std::vector<uint> exclusiveScan(const std::vector<uint>& in) {
  std::vector<uint> out = {0};
  for (const uint value : in) out.push_back(out.back() + value);
  return out;
}

std::vector<uint> compact(const std::vector<uint>& flags) {
  std::vector<uint> indices;
  for (size_t i = 0; i < flags.size(); ++i) {
    if (flags[i]) indices.push_back(static_cast<uint>(i));
  }
  return indices;
}

std::vector<uint> lowerBounds(const std::vector<uint>& data, size_t keyCount) {
  std::vector<uint> bounds;
  for (size_t k = 0; k < keyCount; ++k) {
    bounds.push_back(static_cast<uint>(std::lower_bound(data.begin(), data.end(), k) - data.begin()));
  }
  return bounds;
}

std::vector<uint> upperBounds(const std::vector<uint>& data, size_t keyCount) {
  std::vector<uint> bounds;
  for (size_t k = 0; k < keyCount; ++k) {
    bounds.push_back(static_cast<uint>(std::upper_bound(data.begin(), data.end(), k) - data.begin()));
  }
  return bounds;
}

std::vector<uint> histogram(const std::vector<uint>& keys, size_t bins) {
  std::vector<uint> counts(bins, 0);
  for (const uint key : keys) {
    if (key < bins) ++counts[key];
  }
  return counts;
}

template <typename Key>
void radixSort(std::vector<Key>& keys, std::vector<uint>& values, const std::vector<BitRange>& bits) {
  for (const BitRange range : bits) {
    const ulong mask = range.count >= 64 ? ~ulong{0} : (ulong{1} << range.count) - 1;
    const auto part = [&](Key key) { return (static_cast<ulong>(key) >> range.first) & mask; };
    sortWithValues(keys, values, [&](Key a, Key b) { return part(a) < part(b); });
  }
}

template void radixSort(std::vector<uint>&, std::vector<uint>&, const std::vector<BitRange>&);
template void radixSort(std::vector<ulong>&, std::vector<uint>&, const std::vector<BitRange>&);

void floatSort(std::vector<float>& floats, std::vector<uint>& values) { sortWithValues(floats, values, totalLess); }

}  // namespace btgpu::reference
