// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The reference is the definition itself: new counters, and a mark if the step before failed.
#include "gpu_engine/stages/05_follow_substep.h"

#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

class FollowSubstepTest : public DeviceTest {
 protected:
  uint overflowAfter(uint overflow, uint quarantined) {
    StageBench bench(queue(), WorldBuilder().finish());
    StepCounters before;
    std::memset(&before, StageBench::kPoison, sizeof before);
    before.overflow = overflow;
    before.quarantined = quarantined;
    bench.setCounters(before);
    bench.run<FollowSubstep>();
    StepCounters after = bench.counters(), expected{};
    expected.overflow = after.overflow;
    EXPECT_TRUE(sameBits(after, expected)) << "counters start at zero";
    return after.overflow;
  }
};

TEST_F(FollowSubstepTest, AfterAStepThatSucceededSmall) { EXPECT_EQ(overflowAfter(0, 0), 0u); }

TEST_F(FollowSubstepTest, AfterAnOverflowSmall) {
  for (uint bit = 1; bit <= OVERFLOW_ABSENT; bit *= 2) EXPECT_EQ(overflowAfter(bit, 0), OVERFLOW_BEFORE) << bit;
}

TEST_F(FollowSubstepTest, AfterAQuarantineSmall) { EXPECT_EQ(overflowAfter(0, 3), OVERFLOW_BEFORE); }

// A chain of substeps: the first failure stops all.
TEST_F(FollowSubstepTest, AfterOneThatDidNothingSmall) {
  EXPECT_EQ(overflowAfter(OVERFLOW_BEFORE, 0), OVERFLOW_BEFORE);
}

}  // namespace
}  // namespace btgpu
