// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/primitives/primitive_test.h"

namespace btgpu {
namespace {

class CompactTest : public PrimitiveTest {
 protected:
  void expectCompacted(const std::vector<uint>& flags, size_t items, const DeviceArray<uint>* counter) {
    const DeviceArray<uint> input = upload(flags);
    DeviceArray<uint> indices = poisoned(flags.size()), total = poisoned(1);
    m_compact.run(queue(), {flags.size(), counter}, input, indices, total);
    const auto expected = reference::compact(firstOf(flags, items));
    ASSERT_EQ(total.toVector(queue()), std::vector<uint>{static_cast<uint>(expected.size())});
    const auto result = indices.toVector(queue());
    EXPECT_EQ(firstOf(result, expected.size()), expected) << flags.size() << " flags, " << items << " counted";
    for (size_t i = expected.size(); i < result.size(); ++i) {
      ASSERT_EQ(result[i], kPoison) << "written beyond the total at " << i;
    }
  }

  void expectCompacted(const std::vector<uint>& flags) { expectCompacted(flags, flags.size(), nullptr); }

  Compact m_compact{device()};
};

TEST_F(CompactTest, CountsSmall) {
  for (const size_t n : smallCounts()) expectCompacted(randomUints(n, 1));
}

TEST_F(CompactTest, Counts) {
  for (const size_t n : counts()) {
    expectCompacted(randomUints(n, 1));
    expectCompacted(std::vector<uint>(n, 0));
    expectCompacted(std::vector<uint>(n, 1));
    if (n == 0) continue;
    std::vector<uint> one(n, 0);
    one.back() = 1;
    expectCompacted(one);
  }
}

TEST_F(CompactTest, CounterOnDeviceSmall) {
  const auto flags = randomUints(131, 1);
  for (const uint value : counterValues(flags.size())) {
    const DeviceArray<uint> counter = upload(std::vector<uint>{value});
    expectCompacted(flags, std::min<size_t>(value, flags.size()), &counter);
  }
}

// After an overflow of the step the flags may be anything; nothing outside `indices` may be written then.
// Under Oclgrind a write out of bounds is an error; elsewhere the test at least must not crash.
TEST_F(CompactTest, FlagsNeverWrittenSmall) {
  const std::vector<uint> flags(131, kPoison);
  const DeviceArray<uint> input = upload(flags);
  DeviceArray<uint> indices = poisoned(flags.size()), total = poisoned(1);
  m_compact.run(queue(), {flags.size()}, input, indices, total);
  for (const uint index : indices.toVector(queue())) EXPECT_TRUE(index < flags.size() || index == kPoison) << index;
}

TEST_F(CompactTest, Large) {
  auto flags = randomBits<uint>(kLarge);
  for (uint& f : flags) f &= 1;
  expectCompacted(flags);
}

}  // namespace
}  // namespace btgpu
