// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The contracts of primitives.h on the host, by the plainest algorithm there is. Results are equal exactly:
// all of it is integer arithmetic modulo 2^32 and moving of values (a float sort moves floats bit by bit).
#pragma once

#include <vector>

#include "primitives.h"

namespace btgpu::reference {

uint sum(const std::vector<uint>& data);

// out[i] = in[0] + ... + in[i - 1]; out has one element more than `in`, the total.
std::vector<uint> exclusiveScan(const std::vector<uint>& in);

// Ascending indices of the flags that are not 0.
std::vector<uint> compact(const std::vector<uint>& flags);

// For each key k in [0, keyCount): index of the first element of sorted `data` that is >= k, or > k.
std::vector<uint> lowerBounds(const std::vector<uint>& data, size_t keyCount);
std::vector<uint> upperBounds(const std::vector<uint>& data, size_t keyCount);

// How many keys equal b, for b in [0, bins); larger keys are not counted.
std::vector<uint> histogram(const std::vector<uint>& keys, size_t bins);

// Stable sort by each bit range in turn, so that the last range counts most. `values` move with their keys.
template <typename Key>
void radixSort(std::vector<Key>& keys, std::vector<uint>& values, const std::vector<BitRange>& bits);

extern template void radixSort(std::vector<uint>&, std::vector<uint>&, const std::vector<BitRange>&);
extern template void radixSort(std::vector<ulong>&, std::vector<uint>&, const std::vector<BitRange>&);

// Stable ascending sort by IEEE 754's total order: -NaN, -infinity, ..., -0, +0, ..., infinity, NaN.
void floatSort(std::vector<float>& floats, std::vector<uint>& values);

}  // namespace btgpu::reference
