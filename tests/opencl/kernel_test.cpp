// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The checked binding of kernel arguments. fillUint(uint first, uint count, uint value, uint* data) and
// reducePartial(uint capacity, const uint* counter, const uint* data, uint* partial) serve as examples.
#include "gpu_engine/opencl/kernel.h"

#include <functional>

#include "tests/support/device_test.h"

namespace btgpu {
namespace {

class KernelTest : public DeviceTest {
 protected:
  // The error of `action`, which must mention all of `parts`.
  static void expectError(const std::function<void()>& action, const std::vector<std::string>& parts) {
    try {
      action();
      ADD_FAILURE() << "no error";
    } catch (const OpenClError& e) {
      EXPECT_EQ(e.kind(), OpenClError::Kind::General);
      for (const auto& part : parts) {
        EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << '"' << e.what() << "\" lacks " << part;
      }
    }
  }

  DeviceArray<uint> m_uints{"uints"};
  DeviceArray<float> m_floats{"floats"};
};

TEST_F(KernelTest, RightArgumentsRun) {
  Kernel fill(device(), "primitives/fill.cl", "fillUint");
  m_uints.copyFromHost(queue(), {1, 2, 3});
  fill.launch(queue(), device().grid(2), 1u, 2u, 9u, m_uints);
  EXPECT_EQ(m_uints.toVector(queue()), (std::vector<uint>{1, 9, 9}));
}

// What is bound already is not bound again: it must be known whenever an array's memory or a value is another one.
TEST_F(KernelTest, ArgumentsThatChangeAreBoundAgain) {
  Kernel fill(device(), "primitives/fill.cl", "fillUint");
  const auto run = [&](uint first, uint count, uint value, DeviceArray<uint>& array) {
    fill.launch(queue(), device().grid(count), first, count, value, array);
  };
  DeviceArray<uint> other("others");
  m_uints.copyFromHost(queue(), {0, 0, 0});
  other.copyFromHost(queue(), {0, 0, 0});
  run(0, 1, 5, m_uints);
  run(0, 1, 5, m_uints);
  run(1, 1, 6, m_uints);
  run(1, 1, 6, other);
  std::swap(m_uints, other);
  run(2, 1, 6, other);
  EXPECT_EQ(m_uints.toVector(queue()), (std::vector<uint>{0, 6, 0}));
  EXPECT_EQ(other.toVector(queue()), (std::vector<uint>{5, 6, 6}));
  other.resize(queue(), 1000);  // moves to other memory
  run(2, 1, 7, other);
  EXPECT_EQ(other.toVector(queue())[2], 7u);
  other = DeviceArray<uint>("others");
  other.copyFromHost(queue(), {0, 0, 0});  // may get the handle of the memory that was given back
  run(2, 1, 7, other);
  EXPECT_EQ(other.toVector(queue()), (std::vector<uint>{0, 0, 7}));
}

TEST_F(KernelTest, WrongCountIsReported) {
  Kernel fill(device(), "primitives/fill.cl", "fillUint");
  m_uints.copyFromHost(queue(), {1, 2, 3});
  const auto grid = device().grid(3);
  expectError([&] { fill.launch(queue(), grid, 0u, 3u, 9u); }, {"fillUint", "4 arguments", "3 were bound"});
  expectError([&] { fill.launch(queue(), grid, 0u, 3u, 9u, m_uints, 1u); }, {"fillUint", "4 arguments", "5 were"});
  expectError([&] { fill.launch(queue(), grid); }, {"fillUint", "4 arguments", "0 were bound"});
  EXPECT_EQ(m_uints.toVector(queue()), (std::vector<uint>{1, 2, 3})) << "the kernel ran all the same";
}

TEST_F(KernelTest, WrongTypeIsReported) {
  Kernel fill(device(), "primitives/fill.cl", "fillUint");
  m_uints.copyFromHost(queue(), {1, 2, 3});
  m_floats.copyFromHost(queue(), {1, 2, 3});
  const auto grid = device().grid(3);
  expectError([&] { fill.launch(queue(), grid, 0u, 3u, 9u, m_floats); }, {"fillUint", "argument 3", "uint*", "float*"});
  expectError([&] { fill.launch(queue(), grid, 0u, 3.0f, 9u, m_uints); }, {"fillUint", "argument 1", "float"});
  expectError([&] { fill.launch(queue(), grid, 0u, 3u, 9u, 5u); }, {"fillUint", "argument 3", "uint*"});
  expectError([&] { fill.launch(queue(), grid, m_uints, 3u, 9u, m_uints); }, {"fillUint", "argument 0", "uint*"});
  EXPECT_EQ(m_uints.toVector(queue()), (std::vector<uint>{1, 2, 3})) << "the kernel ran all the same";

  // A failed binding leaves nothing behind: the next launch starts over.
  fill.launch(queue(), grid, 0u, 3u, 9u, m_uints);
  EXPECT_EQ(m_uints.toVector(queue()), (std::vector<uint>{9, 9, 9}));
}

TEST_F(KernelTest, StructPointersAreTold) {
  Kernel list(device(), "stages/95_gather_contacts.cl", "listContacts");
  DeviceArray<StepCounters> counters("counters");
  DeviceArray<StepParams> params("params");
  StepCounters onePair{};
  onePair.pairCount = 1;
  counters.copyFromHost(queue(), {onePair});
  params.copyFromHost(queue(), {StepParams{}});
  DeviceArray<uint> flags("flags"), sums("sums"), touching("touching"), fresh("fresh");
  flags.copyFromHost(queue(), {3});  // of a pair that touches and is fresh
  for (auto* array : {&sums, &touching, &fresh}) array->copyFromHost(queue(), {7, 7});
  const Grid grid = device().chunkGrid(1);
  ASSERT_EQ(grid.groups(), 1u);
  list.launch(queue(), grid, 1u, counters, flags, sums, touching, fresh);
  EXPECT_EQ(counters.toVector(queue())[0].touchingCount, 1u);
  EXPECT_EQ(fresh.toVector(queue()), (std::vector<uint>{0, 7}));
  expectError([&] { list.launch(queue(), grid, 1u, params, flags, sums, touching, fresh); },
              {"listContacts", "argument 1", "StepCounters*", "StepParams*"});
}

TEST_F(KernelTest, OptionalArgumentMayBeNull) {
  Kernel partial(device(), "primitives/reduce.cl", "reducePartial");
  m_uints.copyFromHost(queue(), {5});
  DeviceArray<uint> counter("counter"), result("result");
  counter.copyFromHost(queue(), {0});
  result.copyFromHost(queue(), {7});
  const Grid grid = {device().groupSize(), device().groupSize()};
  partial.launch(queue(), grid, 1u, Optional<uint>{nullptr}, m_uints, result);
  EXPECT_EQ(result.toVector(queue()), std::vector<uint>{5});
  partial.launch(queue(), grid, 1u, Optional<uint>{&counter}, m_uints, result);
  EXPECT_EQ(result.toVector(queue()), std::vector<uint>{0});
  // Also a null pointer has a type.
  expectError([&] { partial.launch(queue(), grid, 1u, Optional<float>{nullptr}, m_uints, result); },
              {"reducePartial", "argument 1", "uint*", "float*"});
  expectError([&] { partial.launch(queue(), grid, 1u, Optional<float>{&m_floats}, m_uints, result); },
              {"reducePartial", "argument 1", "uint*", "float*"});
}

TEST_F(KernelTest, UnknownKernelIsReported) {
  expectError([&] { Kernel(device(), "primitives/fill.cl", "fillUnit"); }, {"fillUnit", "kernels/primitives/fill.cl"});
}

TEST_F(KernelTest, UnknownFileIsReported) {
  try {
    Kernel(device(), "primitives/nothing.cl", "nothing");
    FAIL() << "no error";
  } catch (const OpenClError& e) {
    EXPECT_EQ(e.kind(), OpenClError::Kind::Build);
    EXPECT_NE(std::string(e.what()).find("kernels/primitives/nothing.cl"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace btgpu
