// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/primitives/primitive_test.h"

namespace btgpu {
namespace {

class ScanTest : public PrimitiveTest {
 protected:
  // `items`: how many of `data` the counter, if any, leaves.
  void expectScan(const std::vector<uint>& data, size_t items, const DeviceArray<uint>* counter, bool inPlace) {
    DeviceArray<uint> in = upload(data), out = poisoned(data.size()), total = poisoned(1);
    m_scan.exclusive(queue(), {data.size(), counter}, in, inPlace ? in : out, total);
    auto expected = reference::exclusiveScan(firstOf(data, items));
    EXPECT_EQ(total.toVector(queue()), std::vector<uint>{expected.back()});
    expected.pop_back();
    const auto result = (inPlace ? in : out).toVector(queue());
    ASSERT_EQ(result.size(), data.size());
    EXPECT_EQ(firstOf(result, items), expected) << data.size() << " elements, " << items << " counted";
    for (size_t i = items; i < data.size(); ++i) {
      ASSERT_EQ(result[i], inPlace ? data[i] : kPoison) << "written beyond the count at " << i;
    }
  }

  void expectScan(const std::vector<uint>& data) {
    expectScan(data, data.size(), nullptr, false);
    expectScan(data, data.size(), nullptr, true);
  }

  Scan m_scan{device()};
};

TEST_F(ScanTest, CountsSmall) {
  for (const size_t n : smallCounts()) expectScan(randomUints(n, 0xffffffffu));
}

TEST_F(ScanTest, Counts) {
  for (const size_t n : counts()) {
    expectScan(randomUints(n, 0xffffffffu));
    expectScan(std::vector<uint>(n, 1));
    expectScan(iota(n));
    expectScan(std::vector<uint>(n, 0));
  }
}

TEST_F(ScanTest, CounterOnDeviceSmall) {
  const auto data = randomUints(131, 1000);
  for (const uint value : counterValues(data.size())) {
    const DeviceArray<uint> counter = upload(std::vector<uint>{value});
    const size_t items = std::min<size_t>(value, data.size());
    expectScan(data, items, &counter, false);
    expectScan(data, items, &counter, true);
  }
}

TEST_F(ScanTest, ReusedWithOtherSizesSmall) {
  for (const size_t n : {129, 3, 0, 128}) expectScan(randomUints(n, 100));
}

// Chunks longer than a group, so that a group walks several tiles and reuses its local memory: at most 64 chunks on
// devices with up to 16 compute units.
TEST_F(ScanTest, SeveralTilesSmall) {
  const auto data = randomUints(64 * 129, 1000);
  expectScan(data, data.size(), nullptr, false);
}

TEST_F(ScanTest, Large) {
  const auto data = randomBits<uint>(kLarge);
  expectScan(data, data.size(), nullptr, false);
}

}  // namespace
}  // namespace btgpu
