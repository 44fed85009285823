// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Worlds with joints: the same as on stock Bullet, with the steps on the device and only the rows made by the CPU.
#include <cmath>

#include "tests/support/facade_world.h"
#include "tests/support/joints.h"

namespace btgpu::test {
namespace {

constexpr double kStep = 1.0 / 60.0;

// All steps on the device, and the joints named as the CPU's share.
void expectJointsOnDevice(const btGpuDynamicsWorld& world, unsigned long long steps) {
  EXPECT_EQ(world.statistics().m_deviceSteps, steps);
  EXPECT_EQ(world.statistics().m_stockSteps, 0u) << reportText(world);
  const btGpuFallback joints = reported(world, "joints");
  EXPECT_EQ(joints.m_count, steps);
  EXPECT_EQ(joints.m_reason, "rows by the CPU");
  EXPECT_FALSE(joints.m_wholeStep);
}

// Two bodies and a joint between them: both solvers work on the same rows in the same order. A row's update rounds its
// velocity, the impulse and the bodies' change, some 8 roundings of half a unit in the size of the speeds (below 8);
// there are at most 12 rows and 10 iterations, and Gauss-Seidel contracts, so that errors add up at most.
double oneStepNoise(double speed) { return 8 * 120 * 0.5 * double(FLT_EPSILON) * speed; }

template <typename World>
struct Pair {
  explicit Pair(const JointKind& kind) {
    addJointBodies(w.objects, a, b);
    joint = kind.make(w.objects, *a, *b);
  }
  World w;
  btRigidBody *a = nullptr, *b = nullptr;
  btTypedConstraint* joint = nullptr;
};

class OneJointTest : public ::testing::TestWithParam<JointKind> {};

TEST_P(OneJointTest, StepsAsStock) {
  Pair<StockWorld> stock(GetParam());
  Pair<GpuWorld> gpu(GetParam());
  for (int step = 1; step <= 60; ++step) {
    stock.w.run(1);
    gpu.w.run(1);
    // What the steps before were off goes on: a position by its velocity, a velocity by the joint's lever. Free
    // bodies with one joint don't amplify it.
    const double tolerance = step * oneStepNoise(8) * (1 + step * kStep);
    expectNear(stateOf(*gpu.a), stateOf(*stock.a), tolerance, "A, step " + std::to_string(step));
    expectNear(stateOf(*gpu.b), stateOf(*stock.b), tolerance, "B, step " + std::to_string(step));
    EXPECT_NEAR(double(gpu.joint->getAppliedImpulse()), double(stock.joint->getAppliedImpulse()), 4 * tolerance);
    if (HasFailure()) break;
  }
  expectJointsOnDevice(gpu.w.world, 60);
}

INSTANTIATE_TEST_SUITE_P(All, OneJointTest, ::testing::ValuesIn(jointKinds()),
                         [](const auto& p) { return p.param.name; });

}  // namespace
}  // namespace btgpu::test
