// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// stepSimulation in all the ways in which applications call it: the number of substeps, poses, and which
// motion states are told what, in which order, as in stock.
#include <cmath>
#include <functional>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

struct Call {
  char what;  // 's': setWorldTransform, 'g': getWorldTransform
  int body;
  btTransform transform;
};

class RecordingMotionState : public btMotionState {
 public:
  RecordingMotionState(int body, const btTransform& start, std::vector<Call>& calls)
      : m_body(body), m_transform(start), m_calls(calls) {}
  void getWorldTransform(btTransform& transform) const override {
    transform = m_transform;
    m_calls.push_back({'g', m_body, transform});
  }
  void setWorldTransform(const btTransform& transform) override { m_calls.push_back({'s', m_body, transform}); }
  btTransform& transform() { return m_transform; }

 private:
  int m_body;
  btTransform m_transform;
  std::vector<Call>& m_calls;
};

// A floor, two free bodies that spin, a ball that bounces, one that sleeps, one without motion state, a
// kinematic one.
template <typename World>
struct Scene {
  WorldOf<World> w;
  std::vector<Call> calls;
  std::vector<std::unique_ptr<RecordingMotionState>> states;
  std::vector<btRigidBody*> bodies;
  std::vector<std::string> ticks;

  Scene() {
    w.world.setGravity(btVector3(0, -10, 0));
    // A plane: stock finds the contacts of a ball and a box by iteration, and a bounce shows its error of
    // 1e-3.
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0))->setRestitution(1);
    btCollisionShape* box = w.objects.box(btVector3(btScalar(0.3), btScalar(0.4), btScalar(0.5)));
    btCollisionShape* ball = w.objects.sphere(btScalar(0.5));
    btRigidBody* free1 = add(box, btVector3(0, 40, 0));
    free1->setLinearVelocity(btVector3(1, 2, 3));
    free1->setAngularVelocity(btVector3(btScalar(0.3), btScalar(0.2), btScalar(-0.1)));
    btRigidBody* free2 = add(ball, btVector3(5, 30, 0));
    free2->setAngularVelocity(btVector3(1, 0, 0));
    free2->setDamping(btScalar(0.1), btScalar(0.2));
    add(ball, btVector3(10, btScalar(0.8), 0))->setRestitution(btScalar(0.9));
    add(ball, btVector3(15, 20, 0))->forceActivationState(ISLAND_SLEEPING);
    btRigidBody* silent = w.objects.add(1, ball, btVector3(20, 20, 0));
    btRigidBody* kinematic = add(box, btVector3(25, 20, 0));
    w.world.removeRigidBody(kinematic);
    kinematic->setMassProps(0, btVector3(0, 0, 0));
    kinematic->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    kinematic->setActivationState(DISABLE_DEACTIVATION);
    w.world.addRigidBody(kinematic);
    bodies.push_back(silent);
    calls.clear();
    w.world.setInternalTickCallback(tick, this);
  }

  btRigidBody* add(btCollisionShape* shape, const btVector3& at) {
    btRigidBody* body = w.objects.add(1, shape, at);
    states.push_back(
        std::make_unique<RecordingMotionState>(static_cast<int>(bodies.size()), body->getWorldTransform(), calls));
    body->setMotionState(states.back().get());
    bodies.push_back(body);
    return body;
  }
  // The kinematic body, moved by its motion state, as a game moves it.
  void moveKinematic(double dx) { states.back()->transform().getOrigin() += btVector3(btScalar(dx), 0, 0); }

  static void tick(btDynamicsWorld* world, btScalar timeStep) {
    static_cast<Scene*>(world->getWorldUserInfo())->ticks.push_back(std::to_string(double(timeStep)));
  }
};

using Pattern = std::function<int(btDynamicsWorld& world, int frame)>;

struct Case {
  const char* name;
  Pattern step;
  int frames;
};

void PrintTo(const Case& c, std::ostream* stream) { *stream << c.name; }

void expectSameCalls(const std::vector<Call>& ours, const std::vector<Call>& stock, double tolerance) {
  ASSERT_EQ(ours.size(), stock.size());
  for (size_t i = 0; i < ours.size(); ++i) {
    ASSERT_EQ(ours[i].what, stock[i].what) << "call " << i;
    ASSERT_EQ(ours[i].body, stock[i].body) << "call " << i;
    ASSERT_LE(distance(ours[i].transform.getOrigin(), stock[i].transform.getOrigin()), tolerance) << "call " << i;
    ASSERT_LE(distance(ours[i].transform.getBasis(), stock[i].transform.getBasis()), tolerance) << "call " << i;
  }
}

template <typename Prepare>
void compare(const Case& c, const Prepare& prepare) {
  Scene<btGpuDynamicsWorld> gpu;
  Scene<btDiscreteDynamicsWorld> stock;
  prepare(gpu.w.world);
  prepare(stock.w.world);
  // Positions up to 40; the ball's bounce is a contact of one point, solved to the last bit but for rounding.
  const double tolerance = floatNoise(c.frames * 4, 40);
  for (int frame = 0; frame < c.frames; ++frame) {
    gpu.moveKinematic(0.05);
    stock.moveKinematic(0.05);
    ASSERT_EQ(c.step(gpu.w.world, frame), c.step(stock.w.world, frame)) << "return value, frame " << frame;
    ASSERT_EQ(gpu.ticks, stock.ticks) << "substeps, frame " << frame;
    for (size_t i = 0; i < gpu.bodies.size(); ++i) {
      expectNear(stateOf(*gpu.bodies[i]), stateOf(*stock.bodies[i]), tolerance,
                 "frame " + std::to_string(frame) + " body " + std::to_string(i));
    }
    if (testing::Test::HasFailure()) return;
  }
  expectSameCalls(gpu.calls, stock.calls, tolerance);
  EXPECT_GT(stock.calls.size(), size_t(c.frames)) << "motion states should have been called";
  EXPECT_EQ(gpu.w.world.statistics().m_deviceSteps, gpu.ticks.size());
  EXPECT_EQ(gpu.w.world.statistics().m_stockSteps, 0u) << reportText(gpu.w.world);
}

constexpr double kStep = 1.0 / 60;
btScalar s(double v) { return static_cast<btScalar>(v); }

// Frame times as of an uneven display: 1/75 to 1/20 of a second, one long hang.
double unevenFrame(int frame) {
  return frame == 20 ? 0.5 : 1.0 / 75 + (frame * 37 % 11) / 11.0 * (1.0 / 20 - 1.0 / 75);
}

const Case kCases[] = {
    {"FixedSteps", [](auto& w, int) { return w.stepSimulation(s(kStep), 10, s(kStep)); }, 40},
    {"SmallerFixedSteps", [](auto& w, int) { return w.stepSimulation(s(kStep), 10, s(1.0 / 250)); }, 20},
    {"LargerFixedSteps", [](auto& w, int) { return w.stepSimulation(s(1.0 / 144), 4, s(kStep)); }, 40},
    {"OneStepOfTheFrame", [](auto& w, int f) { return w.stepSimulation(s(unevenFrame(f)), 1, s(unevenFrame(f))); }, 40},
    {"NoSubsteps", [](auto& w, int) { return w.stepSimulation(s(kStep), 0); }, 40},
    {"NoSubstepsUneven", [](auto& w, int f) { return w.stepSimulation(s(unevenFrame(f)), 0, 0); }, 40},
    {"UnevenFrames", [](auto& w, int f) { return w.stepSimulation(s(unevenFrame(f)), 4, s(kStep)); }, 60},
    {"TooFewSubsteps", [](auto& w, int f) { return w.stepSimulation(s(unevenFrame(f)), 1, s(1.0 / 120)); }, 40},
    {"Defaults", [](auto& w, int f) { return w.stepSimulation(s(unevenFrame(f))); }, 40},
    {"ZeroTime", [](auto& w, int f) { return w.stepSimulation(s(f % 2 ? 0 : kStep), f % 3 ? 2 : 0, s(kStep)); }, 30},
    {"VaryingFixedStep", [](auto& w, int f) { return w.stepSimulation(s(kStep), 5, s(f % 2 ? 1.0 / 60 : 1.0 / 90)); },
     40},
};

class Stepping : public testing::TestWithParam<Case> {};

TEST_P(Stepping, AsStock) {
  compare(GetParam(), [](btDiscreteDynamicsWorld&) {});
}

TEST_P(Stepping, AllMotionStates) {
  compare(GetParam(), [](btDiscreteDynamicsWorld& world) { world.setSynchronizeAllMotionStates(true); });
}

TEST_P(Stepping, WithoutLatency) {
  compare(GetParam(), [](btDiscreteDynamicsWorld& world) { world.setLatencyMotionStateInterpolation(false); });
}

INSTANTIATE_TEST_SUITE_P(Patterns, Stepping, testing::ValuesIn(kCases),
                         [](const testing::TestParamInfo<Case>& test) { return std::string(test.param.name); });

// A time step that is no positive number is the stock path's business.
TEST(SteppingOdd, NegativeTime) {
  Scene<btGpuDynamicsWorld> gpu;
  Scene<btDiscreteDynamicsWorld> stock;
  gpu.w.run(5);
  stock.w.run(5);
  EXPECT_EQ(gpu.w.world.stepSimulation(s(-kStep), 0), stock.w.world.stepSimulation(s(-kStep), 0));
  EXPECT_EQ(gpu.w.world.statistics().m_stockSteps, 1u);
  EXPECT_EQ(reported(gpu.w.world, "time step").m_count, 1u);
  gpu.w.run(5);
  stock.w.run(5);
  EXPECT_EQ(gpu.w.world.statistics().m_deviceSteps, 10u);
  for (const size_t i : {0u, 1u}) {
    expectNear(stateOf(*gpu.bodies[i]), stateOf(*stock.bodies[i]), floatNoise(11, 40), "body " + std::to_string(i));
  }
}

// Manual stepping, as some applications do it: single parts of the step through the public interface.
TEST(SteppingOdd, SynchronizeByHand) {
  Scene<btGpuDynamicsWorld> gpu;
  Scene<btDiscreteDynamicsWorld> stock;
  gpu.w.run(3);
  stock.w.run(3);
  gpu.calls.clear();
  stock.calls.clear();
  gpu.w.world.synchronizeMotionStates();
  stock.w.world.synchronizeMotionStates();
  gpu.w.world.synchronizeSingleMotionState(gpu.bodies[3]);
  stock.w.world.synchronizeSingleMotionState(stock.bodies[3]);
  expectSameCalls(gpu.calls, stock.calls, floatNoise(3, 40));
  EXPECT_FALSE(stock.calls.empty());
}

}  // namespace
}  // namespace btgpu::test
