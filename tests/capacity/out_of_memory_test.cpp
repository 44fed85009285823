// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The device's memory runs out: at the first step, when the world grows, or in the middle of a step. The
// world then goes on on Bullet's own path, without losing the step, and says so.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <climits>
#include <functional>

#include "compat/world_state.h"
#include "tests/support/facade_world.h"
#include "tests/support/failing_opencl.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

// Balls in a row on a plane, far from each other.
template <typename World>
void build(WorldOf<World>& w, int balls) {
  w.world.setGravity(btVector3(0, -10, 0));
  w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  btCollisionShape* ball = w.objects.sphere(s(0.5));
  for (int i = 0; i < balls; ++i) w.objects.add(1, ball, btVector3(s(2 * i), s(0.6), 0));
}

// All balls into one place, a little apart: each touches most others.
template <typename World>
void heapUp(WorldOf<World>& w) {
  const auto& bodies = w.objects.bodies();
  for (size_t i = 1; i < bodies.size(); ++i) {
    const btTransform t(
        btQuaternion::getIdentity(),
        btVector3(s(0.01 * double(i % 7)), s(0.6 + 0.01 * double(i / 7 % 7)), s(0.01 * double(i / 49))));
    bodies[i]->setWorldTransform(t);
    bodies[i]->setInterpolationWorldTransform(t);
  }
}

std::vector<BodyState> statesOf(const scenes::Objects& objects) {
  std::vector<BodyState> states;
  for (const btRigidBody* b : objects.bodies()) states.push_back(stateOf(*b));
  return states;
}

// Turns the world to the stock path without the contacts of the device, which a failure takes away too.
void leaveDevice(GpuWorld& w) {
  btGpuSettings settings;
  settings.m_profile = true;  // another engine: the old one goes
  settings.m_stockOnly = true;
  btGpuDynamicsWorld::configure(&w.world, settings);
}

// As a step does while the device works, before it is known that this fails: pairs come in another order than stock's.
void updateHostBroadphase(GpuWorld& w) {
  predictTransforms(w.world.getNonStaticRigidBodies(), s(1.0 / 60));
  findState(&w.world)->aabbs.update(w.world);
  w.world.computeOverlappingPairs();
}

class OutOfMemory : public ::testing::Test {
 protected:
  void SetUp() override { FailingOpenCl::reset(); }
  void TearDown() override { FailingOpenCl::reset(); }

  static void expectReported(const GpuWorld& w, unsigned long long stockSteps, const std::string& reason) {
    EXPECT_EQ(w.world.statistics().m_stockSteps, stockSteps);
    EXPECT_EQ(w.world.statistics().m_device, "");
    const auto report = w.world.fallbackReport();
    ASSERT_EQ(report.size(), 1u);
    EXPECT_EQ(report[0].m_what, "device");
    EXPECT_NE(report[0].m_reason.find(reason), std::string::npos) << report[0].m_reason;
    EXPECT_EQ(report[0].m_count, stockSteps);
  }
};

// Or the test's functions are not the ones that the engine calls.
TEST_F(OutOfMemory, CallsPassThroughHere) {
  GpuWorld w;
  build(w, 3);
  w.run(1);
  expectAllOnDevice(w.world);
  EXPECT_GT(FailingOpenCl::buffers(), 20);
  EXPECT_GT(FailingOpenCl::launches(), 20);
}

// More room wanted than any device has: nothing of this fails on purpose.
TEST_F(OutOfMemory, WantedRoomIsTooLarge) {
  btGpuSettings settings;
  settings.m_pairCapacity = INT_MAX;
  GpuWorld w(settings);
  StockWorld stock;
  build(w, 20);
  build(stock, 20);
  ::testing::internal::CaptureStderr();
  w.run(10);
  const std::string said = ::testing::internal::GetCapturedStderr();
  stock.run(10);
  expectReported(w, 10, "bytes");
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 0u);
  EXPECT_EQ(said.find("btgpu:"), said.rfind("btgpu:")) << said;
  EXPECT_NE(said.find("CPU path"), std::string::npos) << said;
  const auto a = statesOf(w.objects), b = statesOf(stock.objects);
  for (size_t i = 0; i < a.size(); ++i) expectSame(a[i], b[i], "body " + std::to_string(i));
  // With settings that fit the world is back on the device.
  btGpuDynamicsWorld::configure(&w.world, {});
  w.run(1);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 1u);
}

// Every allocation of the first step fails once: the world is stock's own from its first step on.
TEST_F(OutOfMemory, EachAllocationOfTheFirstStep) {
  int allocations = 0;
  {
    GpuWorld w;
    build(w, 20);
    FailingOpenCl::reset();
    w.run(1);
    allocations = FailingOpenCl::buffers();
  }
  StockWorld stock;
  build(stock, 20);
  stock.run(3);
  const auto expected = statesOf(stock.objects);
  for (int k = 0; k < allocations; k += 3) {
    GpuWorld w;
    build(w, 20);
    FailingOpenCl::reset();
    FailingOpenCl::failBuffersAfter(k, CL_MEM_OBJECT_ALLOCATION_FAILURE);
    w.run(3);
    EXPECT_GE(FailingOpenCl::failures(), 1) << k;
    expectReported(w, 3, "CL_MEM_OBJECT_ALLOCATION_FAILURE");
    const auto states = statesOf(w.objects);
    for (size_t i = 0; i < states.size(); ++i) {
      expectSame(states[i], expected[i], "allocation " + std::to_string(k) + ", body " + std::to_string(i));
    }
  }
}

// The pairs explode, and the memory for them is not there: each allocation of that step fails once, some when
// the step starts, most when it is to be repeated.
TEST_F(OutOfMemory, EachAllocationOfAStepThatGrows) {
  constexpr int kBalls = 80;
  int allocations = 0;
  unsigned long long redos = 0;
  std::vector<BodyState> expected;
  {
    GpuWorld stock;
    build(stock, kBalls);
    stock.run(2);
    heapUp(stock);
    updateHostBroadphase(stock);
    leaveDevice(stock);
    stock.run(2);
    EXPECT_EQ(stock.world.statistics().m_stockSteps, 2u);
    expected = statesOf(stock.objects);

    GpuWorld w;
    build(w, kBalls);
    w.run(2);
    heapUp(w);
    FailingOpenCl::reset();
    w.run(1);
    allocations = FailingOpenCl::buffers();
    redos = w.world.statistics().m_repeatedSteps;
    EXPECT_GT(w.world.statistics().m_pairs, 2000u);
  }
  ASSERT_GE(redos, 1u);
  ASSERT_GE(allocations, 5);
  for (int k = 0; k < allocations; ++k) {
    FailingOpenCl::reset();
    GpuWorld w;
    build(w, kBalls);
    w.run(2);
    heapUp(w);
    FailingOpenCl::reset();
    FailingOpenCl::failBuffersAfter(k, k % 2 ? CL_OUT_OF_RESOURCES : CL_MEM_OBJECT_ALLOCATION_FAILURE);
    w.run(2);
    EXPECT_GE(FailingOpenCl::failures(), 1) << k;
    EXPECT_EQ(w.world.statistics().m_deviceSteps, 2u) << k;
    expectReported(w, 2, k % 2 ? "CL_OUT_OF_RESOURCES" : "CL_MEM_OBJECT_ALLOCATION_FAILURE");
    const auto states = statesOf(w.objects);
    for (size_t i = 0; i < states.size(); ++i) {
      expectSame(states[i], expected[i], "allocation " + std::to_string(k) + ", body " + std::to_string(i));
    }
  }
}

// A device with little memory: an array over its largest allocation.
TEST_F(OutOfMemory, ArrayLargerThanTheDeviceAllows) {
  GpuWorld w;
  build(w, 80);
  w.run(2);
  heapUp(w);
  FailingOpenCl::failBuffersLargerThan(500000, CL_INVALID_BUFFER_SIZE);
  w.run(2);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 2u);
  expectReported(w, 2, "CL_INVALID_BUFFER_SIZE");
}

// Two steps, then four substeps in one call, of which something breaks; they must end as `expected` all the same.
// Returns how many substeps were ahead.
unsigned long long fourSubsteps(const btGpuSettings& settings, const std::vector<BodyState>& expected,
                                const std::function<void()>& breakThem, const std::string& what) {
  FailingOpenCl::reset();
  GpuWorld w(settings);
  build(w, 20);
  w.run(2);
  FailingOpenCl::reset();
  breakThem();
  w.world.stepSimulation(s(4 / 60.0), 4, s(1 / 60.0));
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 6u) << what;
  expectAllOnDevice(w.world);
  const auto states = statesOf(w.objects);
  for (size_t i = 0; i < states.size(); ++i) expectSame(states[i], expected[i], what);
  return w.world.statistics().m_prefetchedSteps;
}

// What running a substep ahead wants on top is not there: substeps come one by one, on the device.
TEST_F(OutOfMemory, EachAllocationForSubstepsAhead) {
  btGpuSettings settings;
  settings.m_contacts = false;  // their arrays may grow at any time
  GpuWorld single(settings);
  build(single, 20);
  single.run(6);
  const auto expected = statesOf(single.objects);
  int allocations = 0;
  for (int k = -1; k < std::max(1, allocations); ++k) {
    const auto ahead = fourSubsteps(
        settings, expected, [k] { FailingOpenCl::failBuffersAfter(k, CL_MEM_OBJECT_ALLOCATION_FAILURE); },  // -1: never
        std::to_string(k));
    if (k < 0) {
      allocations = FailingOpenCl::buffers();
      EXPECT_GE(allocations, 8);
    }
    EXPECT_EQ(FailingOpenCl::failures() > 0, k >= 0);
    EXPECT_EQ(ahead, k < 0 ? 3u : 0u) << k;
  }
}

// The same at a launch, with half of the substep ahead on its way.
TEST_F(OutOfMemory, AtALaunchOfASubstepAhead) {
  btGpuSettings settings;
  settings.m_contacts = false;
  GpuWorld counted(settings), single(settings);
  for (GpuWorld* w : {&counted, &single}) build(*w, 20);
  single.run(6);
  const auto expected = statesOf(single.objects);
  counted.run(2);
  FailingOpenCl::reset();
  counted.run(1);
  const int launches = FailingOpenCl::launches();
  for (const int k : {launches, launches + 1, launches + launches / 2, 2 * launches}) {
    const auto ahead = fourSubsteps(
        settings, expected, [k] { FailingOpenCl::failOneLaunchAfter(k, CL_MEM_OBJECT_ALLOCATION_FAILURE); },
        std::to_string(k));
    EXPECT_EQ(FailingOpenCl::failures(), 1) << k;
    EXPECT_EQ(ahead, 0u) << k;
  }
}

// Drivers that take memory only when it is used say so at a launch, with half of the step on its way.
TEST_F(OutOfMemory, AtALaunch) {
  GpuWorld counted;
  build(counted, 20);
  counted.run(2);
  FailingOpenCl::reset();
  counted.run(1);
  const int launches = FailingOpenCl::launches();
  for (const int k : {0, 1, launches / 2, launches - 1}) {
    GpuWorld w, stock;
    build(w, 20);
    build(stock, 20);
    w.run(2);
    stock.run(2);
    leaveDevice(stock);
    FailingOpenCl::reset();
    FailingOpenCl::failLaunchesAfter(k, CL_MEM_OBJECT_ALLOCATION_FAILURE);
    w.run(2);
    stock.run(2);
    EXPECT_GE(FailingOpenCl::failures(), 1) << k;
    expectReported(w, 2, "CL_MEM_OBJECT_ALLOCATION_FAILURE");
    const auto a = statesOf(w.objects), b = statesOf(stock.objects);
    for (size_t i = 0; i < a.size(); ++i) expectSame(a[i], b[i], std::to_string(k) + ", body " + std::to_string(i));
    FailingOpenCl::reset();
  }
}

}  // namespace
}  // namespace btgpu::test
