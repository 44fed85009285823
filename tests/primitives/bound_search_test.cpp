// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/primitives/primitive_test.h"

namespace btgpu {
namespace {

class BoundSearchTest : public PrimitiveTest {
 protected:
  void expectBounds(std::vector<uint> data, size_t items, size_t keyCount, const DeviceArray<uint>* counter) {
    std::sort(data.begin(), data.end());
    const DeviceArray<uint> input = upload(data);
    DeviceArray<uint> lower = poisoned(keyCount), upper = poisoned(keyCount);
    m_search.lower(queue(), {data.size(), counter}, input, keyCount, lower);
    m_search.upper(queue(), {data.size(), counter}, input, keyCount, upper);
    const auto counted = firstOf(data, items);
    EXPECT_EQ(lower.toVector(queue()), reference::lowerBounds(counted, keyCount))
        << items << " of " << data.size() << " elements, " << keyCount << " keys";
    EXPECT_EQ(upper.toVector(queue()), reference::upperBounds(counted, keyCount))
        << items << " of " << data.size() << " elements, " << keyCount << " keys";
  }

  void expectBounds(const std::vector<uint>& data, size_t keyCount) {
    expectBounds(data, data.size(), keyCount, nullptr);
  }

  BoundSearch m_search{device()};
};

TEST_F(BoundSearchTest, CountsSmall) {
  for (const size_t n : smallCounts()) {
    for (const size_t keys : {0, 1, 129}) expectBounds(randomUints(n, 140), keys);
  }
}

TEST_F(BoundSearchTest, Counts) {
  for (const size_t n : counts()) {
    for (const size_t keys : counts()) {
      expectBounds(randomUints(n, static_cast<uint>(keys) + 10), keys);
      expectBounds(std::vector<uint>(n, static_cast<uint>(keys / 2)), keys);
      expectBounds(iota(n), keys);
    }
  }
}

// Keys are at the very ends: all data below the first key but one, all above the last key, the largest uint.
TEST_F(BoundSearchTest, EndsSmall) {
  expectBounds(std::vector<uint>(10, 0), 5);
  expectBounds(std::vector<uint>(10, 0xffffffffu), 5);
  expectBounds({0, 4, 0xffffffffu}, 5);
}

TEST_F(BoundSearchTest, CounterOnDeviceSmall) {
  const auto data = randomUints(131, 60);
  for (const uint value : counterValues(data.size())) {
    const DeviceArray<uint> counter = upload(std::vector<uint>{value});
    expectBounds(data, std::min<size_t>(value, data.size()), 50, &counter);
  }
}

// The keys are as many as the data: the work is per key.
TEST_F(BoundSearchTest, Large) { expectBounds(randomUints(kLarge, kLarge), kLarge); }

}  // namespace
}  // namespace btgpu
