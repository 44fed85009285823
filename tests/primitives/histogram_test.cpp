// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/primitives/primitive_test.h"

namespace btgpu {
namespace {

class HistogramTest : public PrimitiveTest {
 protected:
  void expectHistogram(const std::vector<uint>& keys, size_t items, size_t bins, const DeviceArray<uint>* counter) {
    const DeviceArray<uint> input = upload(keys);
    DeviceArray<uint> result = poisoned(bins);
    m_histogram.run(queue(), {keys.size(), counter}, input, bins, result);
    EXPECT_EQ(result.toVector(queue()), reference::histogram(firstOf(keys, items), bins))
        << items << " of " << keys.size() << " keys, " << bins << " bins";
  }

  void expectHistogram(const std::vector<uint>& keys, size_t bins) {
    expectHistogram(keys, keys.size(), bins, nullptr);
  }

  Histogram m_histogram{device()};
};

TEST_F(HistogramTest, CountsSmall) {
  for (const size_t n : smallCounts()) {
    for (const size_t bins : {0, 1, 7, 129}) expectHistogram(randomUints(n, static_cast<uint>(bins) + 1), bins);
  }
}

TEST_F(HistogramTest, Counts) {
  for (const size_t n : counts()) {
    for (const size_t bins : {1, 7, 128, 1000}) {
      expectHistogram(randomUints(n, static_cast<uint>(bins) - 1), bins);
      expectHistogram(std::vector<uint>(n, static_cast<uint>(bins) - 1), bins);
      expectHistogram(iota(n), bins);
    }
  }
}

// Keys outside the bins are not counted, however large.
TEST_F(HistogramTest, KeysOutsideSmall) {
  expectHistogram({0, 6, 7, 8, 0xffffffffu, 0x80000000u, 6}, 7);
  expectHistogram(std::vector<uint>(129, 7), 7);
}

TEST_F(HistogramTest, CounterOnDeviceSmall) {
  const auto keys = randomUints(131, 6);
  for (const uint value : counterValues(keys.size())) {
    const DeviceArray<uint> counter = upload(std::vector<uint>{value});
    expectHistogram(keys, std::min<size_t>(value, keys.size()), 7, &counter);
  }
}

TEST_F(HistogramTest, ReusedWithOtherSizesSmall) {
  for (const size_t bins : {7, 200, 1}) expectHistogram(randomUints(129, 250), bins);
}

TEST_F(HistogramTest, Large) {
  auto keys = randomBits<uint>(kLarge);
  for (uint& key : keys) key &= 63;
  expectHistogram(keys, 60);
}

}  // namespace
}  // namespace btgpu
