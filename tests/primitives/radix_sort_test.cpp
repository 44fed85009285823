// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <limits>

#include "tests/primitives/primitive_test.h"

namespace btgpu {
namespace {

// The values are the keys' first places, so that comparing them with the stable reference proves stability.
template <typename Key>
class RadixSortTest : public PrimitiveTest {
 protected:
  void expectPairs(const std::vector<Key>& keys, const std::vector<BitRange>& bits, size_t items,
                   const DeviceArray<uint>* counter) {
    DeviceArray<Key> deviceKeys = upload(keys);
    DeviceArray<uint> deviceValues = upload(iota(keys.size()));
    m_sort.pairs(queue(), {keys.size(), counter}, deviceKeys, deviceValues, bits);
    auto expectedKeys = firstOf(keys, items);
    auto expectedValues = iota(expectedKeys.size());
    reference::radixSort(expectedKeys, expectedValues, bits);
    EXPECT_EQ(deviceKeys.size(), keys.size());
    EXPECT_EQ(deviceValues.size(), keys.size());
    EXPECT_EQ(firstOf(deviceKeys.toVector(queue()), items), expectedKeys) << items << " of " << keys.size();
    EXPECT_EQ(firstOf(deviceValues.toVector(queue()), items), expectedValues) << items << " of " << keys.size();
  }

  void expectKeys(const std::vector<Key>& keys, const std::vector<BitRange>& bits) {
    DeviceArray<Key> deviceKeys = upload(keys);
    m_sort.keys(queue(), {keys.size()}, deviceKeys, bits);
    auto expected = keys;
    auto places = iota(keys.size());
    reference::radixSort(expected, places, bits);
    EXPECT_EQ(deviceKeys.toVector(queue()), expected) << keys.size() << " keys only";
  }

  void expectSorted(const std::vector<Key>& keys, const std::vector<BitRange>& bits) {
    expectPairs(keys, bits, keys.size(), nullptr);
    expectKeys(keys, bits);
  }

  // Random, all equal, sorted, reversed.
  void expectAllOrders(size_t count, const std::vector<BitRange>& bits) {
    auto keys = randomBits<Key>(count, static_cast<uint>(count) + 1);
    expectSorted(keys, bits);
    expectSorted(std::vector<Key>(count, static_cast<Key>(0x8000000180000001u)), bits);
    std::sort(keys.begin(), keys.end());
    expectSorted(keys, bits);
    std::reverse(keys.begin(), keys.end());
    expectSorted(keys, bits);
  }

  RadixSort<Key> m_sort{device()};
};

using RadixSort32Test = RadixSortTest<uint>;
using RadixSort64Test = RadixSortTest<ulong>;

TEST_F(RadixSort32Test, CountsSmall) {
  for (const size_t n : {0, 1, 129}) expectSorted(randomBits<uint>(n), {{0, 6}});
}

TEST_F(RadixSort32Test, Counts) {
  for (const size_t n : counts()) expectAllOrders(n, {{0, 32}});
}

TEST_F(RadixSort64Test, CountsSmall) {
  for (const size_t n : {1, 129}) expectSorted(randomBits<ulong>(n), {{30, 4}});
}

TEST_F(RadixSort64Test, Counts) {
  for (const size_t n : counts()) expectAllOrders(n, {{0, 64}});
}

// Ranges that begin and end inside a digit of any width, one bit, none, up to the last bit, and two ranges
// with a gap, as pair keys have: each body index takes as many bits as there are bodies.
TEST_F(RadixSort32Test, BitRanges) {
  const auto keys = randomBits<uint>(1000);
  const std::vector<std::vector<BitRange>> ranges = {
      {},        {{5, 0}},           {{0, 1}},           {{31, 1}},         {{3, 7}},        {{20, 12}},
      {{0, 17}}, {{0, 5}, {16, 11}}, {{16, 11}, {0, 5}}, {{0, 8}, {8, 24}}, {{0, 6}, {6, 6}}};
  for (const auto& bits : ranges) expectSorted(keys, bits);
}

TEST_F(RadixSort64Test, BitRanges) {
  const auto keys = randomBits<ulong>(1000);
  const std::vector<std::vector<BitRange>> ranges = {{{0, 17}, {32, 17}}, {{32, 17}, {0, 17}}, {{63, 1}},  {{31, 2}},
                                                     {{20, 30}},          {{0, 48}},           {{48, 16}}, {{0, 64}}};
  for (const auto& bits : ranges) expectSorted(keys, bits);
}

TEST_F(RadixSort64Test, TwoRangesSmall) {
  auto keys = randomBits<ulong>(131);
  for (ulong& key : keys) key &= 0x0000000300000003u;
  expectSorted(keys, {{0, 2}, {32, 2}});
}

// Few distinct keys, so that most neighbours are equal and only the values tell a stable sort.
TEST_F(RadixSort32Test, StabilitySmall) { expectSorted(randomUints(131, 3), {{0, 2}}); }
TEST_F(RadixSort32Test, Stability) {
  expectSorted(randomUints(5000, 3), {{0, 32}});
  auto keys = randomUints(5000, 0xffffffffu);  // only bits outside the range differ
  for (uint& key : keys) key &= 0xff00ff00u;
  expectSorted(keys, {{0, 8}, {16, 8}});
}

TEST_F(RadixSort32Test, CounterOnDeviceSmall) {
  const auto keys = randomUints(131, 60);
  for (const uint value : {0u, 60u, 0xffffffffu}) {
    const DeviceArray<uint> counter = upload(std::vector<uint>{value});
    expectPairs(keys, {{0, 6}}, std::min<size_t>(value, keys.size()), &counter);
  }
}

TEST_F(RadixSort64Test, CounterOnDevice) {
  const auto keys = randomBits<ulong>(4097);
  for (const uint value : counterValues(keys.size())) {
    const DeviceArray<uint> counter = upload(std::vector<uint>{value});
    expectPairs(keys, {{0, 17}, {32, 17}}, std::min<size_t>(value, keys.size()), &counter);
  }
}

// One object sorts arrays of any length in turn; its scratch arrays have been swapped with the sorted ones.
TEST_F(RadixSort32Test, ReusedWithOtherSizes) {
  for (const size_t n : {1000, 3, 5000, 0, 129}) expectSorted(randomBits<uint>(n), {{0, 20}});
}

// Ascending keys, and equal keys with ascending values, which besides name the places the keys came from:
// there is just one such result, so no slow reference is needed.
template <typename Key>
void expectStablySorted(const std::vector<Key>& in, const std::vector<Key>& keys, const std::vector<uint>& values) {
  ASSERT_EQ(keys.size(), in.size());
  ASSERT_EQ(values.size(), in.size());
  for (size_t i = 0; i < keys.size(); ++i) {
    ASSERT_LT(values[i], in.size());
    ASSERT_EQ(in[values[i]], keys[i]) << "at " << i;
    if (i == 0) continue;
    ASSERT_TRUE(keys[i - 1] < keys[i] || (keys[i - 1] == keys[i] && values[i - 1] < values[i])) << "at " << i;
  }
}

TEST_F(RadixSort32Test, LargePairs) {
  const auto in = randomBits<uint>(kLarge);
  DeviceArray<uint> keys = upload(in), values = upload(iota(kLarge));
  m_sort.pairs(queue(), {kLarge}, keys, values, {{0, 32}});
  expectStablySorted(in, keys.toVector(queue()), values.toVector(queue()));
}

TEST_F(RadixSort64Test, LargeKeys) {
  auto expected = randomBits<ulong>(kLarge);
  DeviceArray<ulong> keys = upload(expected);
  m_sort.keys(queue(), {kLarge}, keys, {{0, 64}});
  std::sort(expected.begin(), expected.end());
  EXPECT_TRUE(keys.toVector(queue()) == expected);
}

class FloatSortTest : public PrimitiveTest {
 protected:
  static std::vector<uint> bitsOf(const std::vector<float>& floats) {
    std::vector<uint> bits;
    for (const float f : floats) bits.push_back(as_uint(f));
    return bits;
  }

  void expectSorted(const std::vector<float>& floats, size_t items, const DeviceArray<uint>* counter) {
    DeviceArray<float> deviceFloats = upload(floats);
    DeviceArray<uint> deviceValues = upload(iota(floats.size()));
    m_sort.pairs(queue(), {floats.size(), counter}, deviceFloats, deviceValues);
    auto expected = firstOf(floats, items);
    auto expectedValues = iota(expected.size());
    reference::floatSort(expected, expectedValues);
    EXPECT_EQ(bitsOf(firstOf(deviceFloats.toVector(queue()), items)), bitsOf(expected));
    EXPECT_EQ(firstOf(deviceValues.toVector(queue()), items), expectedValues);
  }

  void expectSorted(const std::vector<float>& floats) { expectSorted(floats, floats.size(), nullptr); }

  FloatSort m_sort{device()};
};

TEST_F(FloatSortTest, SpecialValuesSmall) {
  using Limits = std::numeric_limits<float>;
  const float infinity = Limits::infinity();
  expectSorted({});
  expectSorted({-3.5f});
  expectSorted({1,
                0.0f,
                -0.0f,
                infinity,
                -1,
                -infinity,
                Limits::max(),
                Limits::lowest(),
                Limits::min(),
                -Limits::min(),
                Limits::denorm_min(),
                -Limits::denorm_min(),
                0.0f,
                -0.0f,
                1,
                -1,
                Limits::quiet_NaN(),
                -Limits::quiet_NaN(),
                infinity,
                -infinity});
}

TEST_F(FloatSortTest, Random) {
  std::mt19937 generator(5);
  std::normal_distribution<float> distribution(0.0f, 100.0f);
  for (const size_t n : counts()) {
    std::vector<float> floats(n);
    for (float& f : floats) f = distribution(generator);
    expectSorted(floats);
    std::sort(floats.begin(), floats.end());
    expectSorted(floats);
    std::reverse(floats.begin(), floats.end());
    expectSorted(floats);
  }
  expectSorted(std::vector<float>(129, -2.0f));
}

TEST_F(FloatSortTest, CounterOnDevice) {
  std::vector<float> floats(131);
  for (size_t i = 0; i < floats.size(); ++i) floats[i] = static_cast<float>(i * 37 % 131) - 60.0f;
  for (const uint value : counterValues(floats.size())) {
    const DeviceArray<uint> counter = upload(std::vector<uint>{value});
    expectSorted(floats, std::min<size_t>(value, floats.size()), &counter);
  }
}

}  // namespace
}  // namespace btgpu
