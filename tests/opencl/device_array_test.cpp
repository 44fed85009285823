// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/opencl/device_array.h"

#include <algorithm>
#include <numeric>

#include "kernels/shared/contact.h"
#include "tests/support/device_test.h"

namespace btgpu {
namespace {

class DeviceArrayTest : public DeviceTest {
 protected:
  static std::vector<uint> iota(size_t count, uint first = 0) {
    std::vector<uint> values(count);
    std::iota(values.begin(), values.end(), first);
    return values;
  }
};

TEST_F(DeviceArrayTest, StartsEmpty) {
  DeviceArray<uint> array("named");
  EXPECT_TRUE(array.empty());
  EXPECT_EQ(array.size(), 0u);
  EXPECT_EQ(array.capacity(), 0u);
  EXPECT_EQ(array.name(), "named");
  EXPECT_TRUE(array.toVector(queue()).empty());
}

TEST_F(DeviceArrayTest, CopiesFromAndToHost) {
  for (const size_t n : {1, 15, 16, 17, 1000}) {
    DeviceArray<uint> array("data");
    array.copyFromHost(queue(), iota(n));
    EXPECT_EQ(array.size(), n);
    EXPECT_GE(array.capacity(), n);
    EXPECT_EQ(array.toVector(queue()), iota(n));
  }
}

TEST_F(DeviceArrayTest, CopiesNothing) {
  DeviceArray<uint> array("data");
  array.copyFromHost(queue(), {});
  EXPECT_TRUE(array.empty());
  array.copyFromHost(queue(), iota(3));
  array.copyFromHost(queue(), {});
  EXPECT_TRUE(array.empty());
  EXPECT_TRUE(array.toVector(queue()).empty());
}

TEST_F(DeviceArrayTest, PushBackKeepsWhatIsThere) {
  DeviceArray<uint> array("data");
  for (uint i = 0; i < 200; ++i) {
    array.push_back(queue(), i * 3);
    ASSERT_EQ(array.size(), i + 1);
    const auto host = array.toVector(queue());
    for (uint k = 0; k <= i; ++k) ASSERT_EQ(host[k], k * 3) << "after " << i + 1;
  }
}

// The values must outlive the copies: here they do.
TEST_F(DeviceArrayTest, PushBackWithoutWait) {
  const auto values = iota(300, 7);
  DeviceArray<uint> array("data");
  const int waits = queue().waits();
  for (const uint& v : values) array.push_back(queue(), v, false);
  EXPECT_EQ(queue().waits(), waits) << "a copy without wait waited";
  EXPECT_EQ(array.toVector(queue()), values);
}

TEST_F(DeviceArrayTest, GrowthIsGeometric) {
  DeviceArray<uint> array("data");
  int growths = 0;
  for (uint i = 0; i < 10000; ++i) {
    const size_t before = array.capacity();
    array.resize(queue(), i + 1);
    growths += array.capacity() != before;
  }
  // Each growth is by half at least, from 16 elements on: log(10000 / 16) / log(1.5) = 15.9, and the first.
  EXPECT_LE(growths, 17);
}

TEST_F(DeviceArrayTest, ResizeKeepsContents) {
  DeviceArray<uint> array("data");
  array.copyFromHost(queue(), iota(100));
  array.resize(queue(), 5000);
  EXPECT_EQ(array.size(), 5000u);
  auto host = array.toVector(queue());
  host.resize(100);
  EXPECT_EQ(host, iota(100));

  array.resize(queue(), 10);
  EXPECT_EQ(array.toVector(queue()), iota(10));
  EXPECT_GE(array.capacity(), 5000u) << "shrinking must not give memory back";
  array.reserve(queue(), 20000);
  EXPECT_EQ(array.size(), 10u);
  EXPECT_EQ(array.toVector(queue()), iota(10));
}

TEST_F(DeviceArrayTest, CopiesRanges) {
  DeviceArray<uint> array("data");
  array.copyFromHost(queue(), std::vector<uint>(100, 0));
  const auto source = iota(100, 1000);
  array.copyRangeFromHost(queue(), source, 0, 1);
  array.copyRangeFromHost(queue(), source, 10, 0);
  array.copyRangeFromHost(queue(), source, 20, 5);
  array.copyRangeFromHost(queue(), source, 99, 1);
  const auto host = array.toVector(queue());
  for (size_t i = 0; i < host.size(); ++i) {
    const bool copied = i == 0 || (i >= 20 && i < 25) || i == 99;
    EXPECT_EQ(host[i], copied ? source[i] : 0u) << "at " << i;
  }
}

TEST_F(DeviceArrayTest, CopiesWithoutWait) {
  auto source = iota(1 << 20);
  DeviceArray<uint> array("data");
  const int waits = queue().waits();
  array.copyFromHost(queue(), source, false);
  std::vector<uint> host;
  array.copyToHost(queue(), host, false);
  std::vector<uint> patch(source.size(), 7);
  array.copyRangeFromHost(queue(), patch, 5, 10, false);
  std::vector<uint> patched;
  array.copyToHost(queue(), patched, false);
  EXPECT_EQ(queue().waits(), waits) << "a copy without wait waited";
  queue().finish();
  EXPECT_EQ(queue().waits(), waits + 1);
  EXPECT_TRUE(host == source);
  for (size_t i = 5; i < 15; ++i) source[i] = 7;
  EXPECT_TRUE(patched == source) << "the queue is in order";
}

TEST_F(DeviceArrayTest, HoldsStructs) {
  std::vector<Manifold> manifolds(33);
  for (size_t i = 0; i < manifolds.size(); ++i) {
    manifolds[i] = {};
    manifolds[i].bodyA = static_cast<uint>(i);
    manifolds[i].points[3].flags = static_cast<int>(i * 2);
  }
  DeviceArray<Manifold> array("manifolds");
  for (const Manifold& m : manifolds) array.push_back(queue(), m);
  const auto host = array.toVector(queue());
  ASSERT_EQ(host.size(), manifolds.size());
  for (size_t i = 0; i < host.size(); ++i) {
    EXPECT_EQ(host[i].bodyA, i);
    EXPECT_EQ(host[i].points[3].flags, static_cast<int>(i * 2));
  }
}

// What the host sees of an array in place: the first elements, also after the array has changed and grown.
TEST_F(DeviceArrayTest, IsSeenInPlace) {
  DeviceArray<uint> array("seen array");
  HostView<uint> view;
  for (const uint size : {100u, 7u, 5000u}) {
    view.unmap(queue());
    auto values = iota(size);
    for (uint& v : values) v += size;
    array.copyFromHost(queue(), values);
    view.map(queue(), array, size - 1);
    queue().finish();
    EXPECT_TRUE(std::equal(values.begin(), values.end() - 1, view.data())) << size;
  }
  view.map(queue(), array, 0);
  EXPECT_EQ(view.data(), nullptr);
}

// More than any device has: the error names the array, and the array stays usable.
TEST_F(DeviceArrayTest, TooLargeIsReported) {
  DeviceArray<uint> array("huge array");
  array.copyFromHost(queue(), iota(10));
  try {
    array.resize(queue(), size_t{1} << 50);
    FAIL() << "four petabytes were allocated";
  } catch (const OpenClError& e) {
    EXPECT_EQ(e.kind(), OpenClError::Kind::OutOfMemory) << e.what();
    EXPECT_NE(std::string(e.what()).find("huge array"), std::string::npos) << e.what();
  }
  EXPECT_EQ(array.toVector(queue()), iota(10));
}

}  // namespace
}  // namespace btgpu
