// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A random walk over Bullet's API, on stock and twice on btgpu: held against stock after each step, and alone. After
// each operation all three worlds hold the same objects in the same order and nothing that is gone; the two of btgpu's
// are the same bit for bit; and each step of the first is stock's (docs/crosscheck.md).
//
//   BTGPU_WALK_SEEDS=10-19 BTGPU_WALK_LENGTH=10000   which walks, and how long; left out: 7-10, 500
//   BTGPU_WALK_VERBOSE=1                             tells each operation before it is done on btgpu
//   BTGPU_WALK_ONLY=0,3,17                           these operations of each walk only
//   BTGPU_WALK_SHRINK=200                            so many attempts to fail with fewer operations
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "random_walk.h"

namespace btgpu::test {
namespace {

// Blocks that Bullet's allocator has given out.
std::atomic<long> blocks{0};

void* allocate(std::size_t size, int alignment) {
  ++blocks;
  void* block = nullptr;
  return posix_memalign(&block, static_cast<std::size_t>(std::max(alignment, 16)), size) == 0 ? block : nullptr;
}
void release(void* block) {
  if (!block) return;
  --blocks;
  std::free(block);
}

std::string environmentOr(const char* name, const char* otherwise) {
  const char* value = std::getenv(name);
  return value ? value : otherwise;
}

std::vector<std::uint32_t> seeds() {
  const std::string text = environmentOr("BTGPU_WALK_SEEDS", "7-10");
  unsigned first = 1, last = 0;
  if (std::sscanf(text.c_str(), "%u-%u", &first, &last) != 2) last = first;
  std::vector<std::uint32_t> all;
  for (std::uint32_t seed = first; seed <= last; ++seed) all.push_back(seed);
  return all;
}

// Those of BTGPU_WALK_ONLY.
std::vector<Operation> chosen(std::vector<Operation> walk) {
  const std::string text = environmentOr("BTGPU_WALK_ONLY", "");
  if (text.empty()) return walk;
  std::vector<Operation> some;
  std::istringstream in(text);
  for (std::string number; std::getline(in, number, ',');) some.push_back(walk.at(std::stoul(number)));
  return some;
}

void tell(std::uint32_t seed, const std::vector<Operation>& walk, const WalkResult& result) {
  std::printf("seed %u fails after %zu operations: %s\n", seed, result.done.size(), result.failure.c_str());
  const std::size_t first = walk.size() > 60 ? result.done.size() - std::min<std::size_t>(40, result.done.size()) : 0;
  std::string only;
  for (std::size_t i = first; i < result.done.size(); ++i) {
    std::printf("  %d: %s\n", walk[i].index, result.done[i].c_str());
    only += (only.empty() ? "" : ",") + std::to_string(walk[i].index);
  }
  if (first == 0) std::printf("BTGPU_WALK_ONLY=%s\n", only.c_str());
}

TEST(RandomWalk, IsStocks) {
  const int length = std::atoi(environmentOr("BTGPU_WALK_LENGTH", "500").c_str());
  const bool verbose = environmentOr("BTGPU_WALK_VERBOSE", "0") != "0";
  const int attempts = std::atoi(environmentOr("BTGPU_WALK_SHRINK", "0").c_str());
  ASSERT_GT(length, 0);
  unsigned long long device = 0, stock = 0, checked = 0, resting = 0;
  for (const std::uint32_t seed : seeds()) {
    std::vector<Operation> walk = chosen(makeWalk(seed, length));
    WalkResult result = runWalk(walk, seed, verbose);
    device += result.deviceSteps;
    stock += result.stockSteps;
    checked += result.checkedSteps;
    resting += result.restingSteps;
    std::printf(
        "seed %u: %zu operations, %llu steps on the device, %llu on stock's path, %llu checked, %llu at rest, %ld "
        "blocks left\n",
        seed, result.done.size(), result.deviceSteps, result.stockSteps, result.checkedSteps, result.restingSteps,
        blocks.load());
    for (const btGpuFallback& f : result.fallbacks) {
      if (f.m_wholeStep) std::printf("  %s: %s (%llu)\n", f.m_what.c_str(), f.m_reason.c_str(), f.m_count);
    }
    std::fflush(stdout);
    // What threads keep for themselves comes once.
    constexpr long kKept = 8;
    EXPECT_LE(blocks, kKept) << "seed " << seed << " leaks";
    if (result.failure.empty()) continue;
    tell(seed, walk, result);
    ADD_FAILURE() << "BTGPU_WALK_SEEDS=" << seed << " BTGPU_WALK_LENGTH=" << result.done.size() << ": "
                  << result.failure;
    if (attempts == 0) continue;
    walk.resize(result.done.size());
    walk = shrinkWalk(walk, seed, attempts);
    tell(seed, walk, runWalk(walk, seed));
  }
  if (HasFailure()) return;
  EXPECT_GT(resting, 0u);
  EXPECT_GT(checked, 0u);
  EXPECT_LT(stock, device / 5) << "too little of it was btgpu's";
}

}  // namespace
}  // namespace btgpu::test

int main(int argc, char** argv) {
  btAlignedAllocSetCustomAligned(btgpu::test::allocate, btgpu::test::release);
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
