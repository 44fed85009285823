// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Fixture of the tests of the parallel primitives: inputs, poisoned outputs, and the counts that all of them
// get.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "gpu_engine/primitives/primitives.h"
#include "gpu_engine/primitives/reference.h"
#include "tests/support/device_test.h"

namespace btgpu {

class PrimitiveTest : public DeviceTest {
 protected:
  static constexpr uint kPoison = 0xdeadbeef;
  static constexpr size_t kLarge = size_t{16} << 20;

  // None, one, around the group size of 128.
  static std::vector<size_t> smallCounts() { return {0, 1, 127, 128, 129}; }
  // Also one that is spread over several chunks with the normal grain, and is no multiple of anything.
  static std::vector<size_t> counts() { return {0, 1, 127, 128, 129, 4096 + 1}; }

  // What a device counter may hold for this capacity: nothing, less, all, one and many too many.
  static std::vector<uint> counterValues(size_t capacity) {
    const uint n = static_cast<uint>(capacity);
    return {0, n / 2, n, n + 1, 0xffffffffu};
  }

  // Uniform in [0, limit].
  static std::vector<uint> randomUints(size_t count, uint limit, uint seed = 1) {
    std::mt19937 generator(seed);
    std::uniform_int_distribution<uint> distribution(0, limit);
    std::vector<uint> values(count);
    for (uint& v : values) v = distribution(generator);
    return values;
  }

  // The full range without a distribution's cost, for the Large cases.
  template <typename T>
  static std::vector<T> randomBits(size_t count, uint seed = 1) {
    std::mt19937_64 generator(seed);
    std::vector<T> values(count);
    for (T& v : values) v = static_cast<T>(generator());
    return values;
  }

  static std::vector<uint> iota(size_t count) {
    std::vector<uint> values(count);
    for (size_t i = 0; i < count; ++i) values[i] = static_cast<uint>(i);
    return values;
  }

  template <typename T>
  static std::vector<T> firstOf(std::vector<T> values, size_t count) {
    values.resize(std::min(count, values.size()));
    return values;
  }

  template <typename T>
  DeviceArray<T> upload(const std::vector<T>& values) {
    DeviceArray<T> array("test input");
    array.copyFromHost(queue(), values);
    return array;
  }

  DeviceArray<uint> poisoned(size_t count) { return upload(std::vector<uint>(count, kPoison)); }
};

}  // namespace btgpu
