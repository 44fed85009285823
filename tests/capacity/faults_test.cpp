// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Calls of OpenCL that fail, whichever and whenever. One that fails once costs nothing but the time to do the step
// again: the run ends with the bits of the run without it. While nothing works the world goes on on Bullet's own path,
// as stock would from the same state, and it comes back to the device by itself.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <cmath>
#include <cstdlib>
#include <map>

#include "tests/support/facade_world.h"
#include "tests/support/failing_opencl.h"
#include "tests/support/world_hash.h"

namespace btgpu::test {
namespace {

// A class of the application's own: its shapes are the host's.
class OwnCylinder : public btCylinderShape {
 public:
  using btCylinderShape::btCylinderShape;
};

btScalar s(double v) { return static_cast<btScalar>(v); }

constexpr int kSteps = 5;
constexpr int kCodes[] = {CL_OUT_OF_RESOURCES, CL_MEM_OBJECT_ALLOCATION_FAILURE, CL_OUT_OF_HOST_MEMORY,
                          CL_DEVICE_NOT_AVAILABLE, CL_INVALID_COMMAND_QUEUE};

struct Plan {
  bool contacts = true;
  bool piles = true;   // what comes lies in one place, and the arrays are too small for its pairs
  bool ahead = false;  // four substeps a step, which the device does ahead: without what the CPU does in between
};

// A bit of everything: primitives, hulls, a joint, a shape that Bullet collides, a body that is asleep; bodies that
// come in the second step, and one that goes in the third.
class SmallRun {
 public:
  explicit SmallRun(const Plan& plan = {}) : m_plan(plan), m_world(settings(plan)) {
    auto& o = m_world.objects;
    m_world.world.setGravity(btVector3(0, -10, 0));
    o.add(0, o.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    const btVector3 half(s(0.5), s(0.5), s(0.5));
    for (int i = 0; i < 3; ++i) o.add(1, o.box(half), btVector3(s(0.1 * i), s(0.5 + i), 0));
    btRigidBody* ball = o.add(1, o.sphere(s(0.5)), btVector3(3, s(0.5), 0));
    btRigidBody* other = o.add(1, o.sphere(s(0.5)), btVector3(s(4.2), s(0.5), 0));
    o.add(1, o.hull({btVector3(0, 0, 0), btVector3(1, 0, 0), btVector3(0, 1, 0), btVector3(0, 0, 1)}),
          btVector3(6, s(0.1), 0));
    o.add(1, o.box(half), btVector3(10, s(0.5), 0))->forceActivationState(ISLAND_SLEEPING);
    if (plan.ahead) return;
    o.joint<btPoint2PointConstraint>(false, *ball, *other, btVector3(s(0.6), 0, 0), btVector3(s(-0.6), 0, 0));
    o.add(1, &m_cylinder, btVector3(8, s(0.5), 0));
  }

  void step() {
    auto& o = m_world.objects;
    if (m_step == 1) {
      for (int i = 0; i < 40; ++i) {
        const btVector3 piled(s(-4 + 0.01 * i), s(1 + 0.01 * (i % 7)), s(0.013 * (i % 5)));
        o.add(1, o.sphere(s(0.5)), m_plan.piles ? piled : btVector3(s(-4 - 2 * i), s(0.45), 0));
      }
    }
    if (m_step == 2) m_world.world.removeRigidBody(o.bodies()[1]);
    m_world.world.stepSimulation(s((m_plan.ahead ? 4 : 1) / 60.0), m_plan.ahead ? 4 : 0, s(1 / 60.0));
    ++m_step;
    m_hash.add(m_world.world);
  }
  void run(int steps = kSteps) {
    for (int i = 0; i < steps; ++i) step();
  }

  std::uint64_t hash() const { return m_hash.value(); }
  btGpuStatistics statistics() const { return m_world.world.statistics(); }
  GpuWorld& world() { return m_world; }
  std::vector<BodyState> states() const {
    std::vector<BodyState> states;
    for (const btRigidBody* b : m_world.objects.bodies()) states.push_back(stateOf(*b));
    return states;
  }
  // Turns to the stock path without asking the device for anything.
  void leaveDevice() {
    btGpuSettings other = settings(m_plan);
    other.m_profile = true;  // another engine: the old one goes
    other.m_stockOnly = true;
    btGpuDynamicsWorld::configure(&m_world.world, other);
  }

 private:
  static btGpuSettings settings(const Plan& plan) {
    btGpuSettings settings;
    settings.m_contacts = plan.contacts;
    return settings;
  }
  Plan m_plan;
  OwnCylinder m_cylinder{btVector3(s(0.4), s(0.5), s(0.4))};
  GpuWorld m_world;
  WorldHash m_hash;
  int m_step = 0;
};

class Faults : public ::testing::Test {
 protected:
  void SetUp() override {
    FailingOpenCl::reset();
    SmallRun warm;  // programs are in their cache from here on
    warm.run();
    FailingOpenCl::reset();
  }
  void TearDown() override { FailingOpenCl::reset(); }

  static void expectFinite(const std::vector<BodyState>& states, const std::string& what) {
    for (const BodyState& b : states) {
      const btVector3 sum = b.transform.getOrigin() + b.linear + b.angular;
      ASSERT_TRUE(std::isfinite(double(sum.x() + sum.y() + sum.z()))) << what;
    }
  }

  // BTGPU_TEST_FAULTS: how many in each test, in place of the few that fit into a short run.
  static int wanted(int few) {
    const char* many = std::getenv("BTGPU_TEST_FAULTS");
    return many ? std::atoi(many) : few;
  }
};

// The calls at which a fault is tried: as many of each kind, evenly over all of that kind.
std::vector<int> spread(const std::vector<std::string>& calls, int wanted) {
  std::map<std::string, std::vector<int>> kinds;
  for (size_t i = 0; i < calls.size(); ++i) kinds[calls[i]].push_back(static_cast<int>(i));
  const auto ofEach = std::max<size_t>(2, static_cast<size_t>(wanted) / kinds.size());
  std::vector<int> chosen;
  for (const auto& [name, all] : kinds) {
    const size_t count = std::min(ofEach, all.size());
    for (size_t i = 0; i < count; ++i) chosen.push_back(all[i * (all.size() - 1) / std::max<size_t>(1, count - 1)]);
  }
  return chosen;
}

struct Faultless {
  std::uint64_t hash = 0;
  std::vector<std::string> calls;
};

// The run without faults. Its device is closed again: the others open it anew, and make as many calls.
Faultless faultlessRun(const Plan& plan) {
  FailingOpenCl::reset();
  SmallRun run(plan);
  run.run();
  EXPECT_EQ(run.statistics().m_stockSteps, 0u) << reportText(run.world().world);
  EXPECT_EQ(run.statistics().m_repeatedSteps > 0, plan.piles);
  EXPECT_EQ(run.statistics().m_prefetchedSteps > 0, plan.ahead);
  EXPECT_GT(FailingOpenCl::calls().size(), 1000u);
  return {run.hash(), FailingOpenCl::calls()};
}

void once(const Plan& plan, int wanted) {
  const Faultless faultless = faultlessRun(plan);
  unsigned long long recovered = 0;
  for (const int k : spread(faultless.calls, wanted)) {
    const int code = kCodes[k % std::size(kCodes)];
    const std::string what =
        std::to_string(code) + " in call " + std::to_string(k) + ", " + faultless.calls[static_cast<size_t>(k)] + "\n";
    FailingOpenCl::reset();
    FailingOpenCl::failCallsAfter(k, 1, code);
    SmallRun run(plan);
    run.run();
    ASSERT_EQ(FailingOpenCl::failures(), 1) << what;
    ASSERT_EQ(run.hash(), faultless.hash) << what << reportText(run.world().world);
    ASSERT_EQ(run.statistics().m_stockSteps, 0u) << what;
    ASSERT_LE(run.statistics().m_recoveredSteps, 1u) << what;
    recovered += run.statistics().m_recoveredSteps;
  }
  EXPECT_GT(recovered, 0u);
}

TEST_F(Faults, Once) { once({}, wanted(50)); }
TEST_F(Faults, OnceWithoutContacts) { once({false}, wanted(30)); }
TEST_F(Faults, OnceInSubstepsAhead) { once({true, true, true}, wanted(50)); }

// From some call on everything fails: the step in which it does is Bullet's own, from the state before it, and so are
// those that follow. (No pile: stock's result for one depends on the order of its pairs, which may have been found
// once already when the device fails.)
TEST_F(Faults, ForGood) {
  const Plan plan{true, false};
  const auto calls = faultlessRun(plan).calls;
  for (const int k : spread(calls, wanted(30))) {
    const std::string what = "call " + std::to_string(k) + ", " + calls[static_cast<size_t>(k)];
    FailingOpenCl::reset();
    FailingOpenCl::failAllAfter(k, kCodes[k % std::size(kCodes)]);
    SmallRun run(plan);
    run.run();
    const auto deviceSteps = static_cast<int>(run.statistics().m_deviceSteps);
    ASSERT_EQ(run.statistics().m_stockSteps + run.statistics().m_deviceSteps, unsigned(kSteps)) << what;
    expectFinite(run.states(), what);
    FailingOpenCl::reset();
    SmallRun stock(plan);
    stock.run(deviceSteps);
    stock.leaveDevice();
    stock.run(kSteps - deviceSteps);
    const auto a = run.states(), b = stock.states();
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) expectSame(a[i], b[i], what + ", body " + std::to_string(i));
    if (HasFailure()) return;
  }
}

// A device that is gone for some steps: the world is back on it by itself.
TEST_F(Faults, BackAfterAWhile) {
  const auto calls = faultlessRun({}).calls;
  int gone = 0;
  for (const int k : spread(calls, wanted(10))) {
    const std::string what = "call " + std::to_string(k) + ", " + calls[static_cast<size_t>(k)];
    FailingOpenCl::reset();
    FailingOpenCl::failAllAfter(k, CL_OUT_OF_RESOURCES);
    SmallRun run;
    run.run();
    if (run.statistics().m_stockSteps == 0) continue;  // one of the last calls, which can be done without
    ++gone;
    ASSERT_EQ(run.statistics().m_device, "") << what;
    FailingOpenCl::reset();
    run.run(10);
    EXPECT_NE(run.statistics().m_device, "") << what;
    const auto before = run.statistics().m_deviceSteps;
    run.run(3);
    EXPECT_EQ(run.statistics().m_deviceSteps, before + 3) << what;
    expectFinite(run.states(), what);
  }
  EXPECT_GT(gone, 5);
}

}  // namespace
}  // namespace btgpu::test
