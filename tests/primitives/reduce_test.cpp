// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/primitives/primitive_test.h"

namespace btgpu {
namespace {

class ReduceTest : public PrimitiveTest {
 protected:
  uint deviceSum(const std::vector<uint>& data, const DeviceArray<uint>* counter = nullptr) {
    const DeviceArray<uint> input = upload(data);
    DeviceArray<uint> result = poisoned(1);
    m_reduce.sum(queue(), {data.size(), counter}, input, result);
    return result.toVector(queue()).at(0);
  }

  void expectSums(const std::vector<uint>& data) {
    EXPECT_EQ(deviceSum(data), reference::sum(data)) << data.size() << " elements";
  }

  Reduce m_reduce{device()};
};

TEST_F(ReduceTest, CountsSmall) {
  for (const size_t n : smallCounts()) expectSums(randomUints(n, 0xffffffffu));
}

TEST_F(ReduceTest, Counts) {
  for (const size_t n : counts()) {
    expectSums(randomUints(n, 0xffffffffu));
    expectSums(std::vector<uint>(n, 1));
  }
}

TEST_F(ReduceTest, SumWrapsSmall) { expectSums({0xffffffffu, 0xffffffffu, 5}); }

TEST_F(ReduceTest, CounterOnDeviceSmall) {
  const auto data = randomUints(131, 1000);
  for (const uint value : counterValues(data.size())) {
    const DeviceArray<uint> counter = upload(std::vector<uint>{value});
    EXPECT_EQ(deviceSum(data, &counter), reference::sum(firstOf(data, value))) << "counter " << value;
  }
}

// One object serves arrays of any length, in any order.
TEST_F(ReduceTest, ReusedWithOtherSizesSmall) {
  for (const size_t n : {129, 3, 0, 128}) expectSums(randomUints(n, 100));
}

TEST_F(ReduceTest, Large) { expectSums(randomBits<uint>(kLarge)); }

}  // namespace
}  // namespace btgpu
