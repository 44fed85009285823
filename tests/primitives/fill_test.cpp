// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/primitives/primitives.h"
#include "tests/support/device_test.h"

namespace btgpu {
namespace {

class FillTest : public DeviceTest {
 protected:
  void expectFilled(size_t size, size_t first, size_t count) {
    DeviceArray<uint> data("data");
    data.copyFromHost(queue(), std::vector<uint>(size, 7));
    Fill fill(device());
    fill.run(queue(), data, first, count, 42);
    const auto host = data.toVector(queue());
    for (size_t i = 0; i < size; ++i) { ASSERT_EQ(host[i], i >= first && i < first + count ? 42u : 7u) << "at " << i; }
  }
};

TEST_F(FillTest, RangesSmall) {
  expectFilled(1, 0, 1);
  expectFilled(10, 3, 0);
  expectFilled(10, 3, 4);
  expectFilled(300, 1, 299);
}

TEST_F(FillTest, Large) { expectFilled(16u << 20, 5, (16u << 20) - 11); }

}  // namespace
}  // namespace btgpu
