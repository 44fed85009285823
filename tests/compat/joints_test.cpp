// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Worlds with joints: the same as on stock Bullet, with the steps on the device and only the rows made by the CPU.
#include <cmath>

#include "tests/support/facade_world.h"
#include "tests/support/joints.h"

namespace btgpu::test {
namespace {

constexpr double kStep = 1.0 / 60.0;

// All steps on the device, and the joints named as the CPU's share of those that were not left out since all slept.
void expectJointsOnDevice(const btGpuDynamicsWorld& world, unsigned long long steps) {
  EXPECT_EQ(world.statistics().m_deviceSteps, steps);
  EXPECT_EQ(world.statistics().m_stockSteps, 0u) << reportText(world);
  const btGpuFallback joints = reported(world, "joints");
  EXPECT_EQ(joints.m_count + world.statistics().m_restingSteps, steps);
  EXPECT_EQ(joints.m_reason, "rows by the CPU");
  EXPECT_FALSE(joints.m_wholeStep);
}

// Two bodies and a joint between them: both solvers work on the same rows in the same order. A row's update rounds some
// 8 times, by half a unit in the size of the speeds; there are at most 12 rows and 10 iterations. Gauss-Seidel
// contracts, so errors add up at most, and as roundings go either way, like a random walk.
double oneStepNoise(double speed) { return std::sqrt(8.0 * 120) * 0.5 * double(FLT_EPSILON) * speed; }

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
    const double tolerance = step * oneStepNoise(step == 1 ? 3 : 9) * (1 + step * kStep);
    expectNear(stateOf(*gpu.a), stateOf(*stock.a), tolerance, "A, step " + std::to_string(step));
    expectNear(stateOf(*gpu.b), stateOf(*stock.b), tolerance, "B, step " + std::to_string(step));
    EXPECT_NEAR(double(gpu.joint->getAppliedImpulse()), double(stock.joint->getAppliedImpulse()), 4 * tolerance);
    if (HasFailure()) break;
  }
  expectJointsOnDevice(gpu.w.world, 60);
}

INSTANTIATE_TEST_SUITE_P(All, OneJointTest, ::testing::ValuesIn(jointKinds()),
                         [](const auto& p) { return p.param.name; });

// ---- a class of the application's own

// Keeps two bodies at a distance, and brakes the one's spin about z: rows of two kinds that Bullet has no class for.
class Rod : public btTypedConstraint {
 public:
  Rod(btRigidBody& a, btRigidBody& b, double length)
      : btTypedConstraint(FIXED_CONSTRAINT_TYPE, a, b), m_length(scalar(length)) {}
  void getInfo1(btConstraintInfo1* info) override {
    info->m_numConstraintRows = 2;
    info->nub = 4;
  }
  void getInfo2(btConstraintInfo2* info) override {
    const btVector3 apart = m_rbA.getWorldTransform().getOrigin() - m_rbB.getWorldTransform().getOrigin();
    const btVector3 axis = apart.normalized();
    for (int k = 0; k < 3; ++k) {
      info->m_J1linearAxis[k] = axis[k];
      info->m_J2linearAxis[k] = -axis[k];
    }
    info->m_constraintError[0] = info->fps * info->erp * (m_length - apart.length());
    info->m_J1angularAxis[info->rowskip + 2] = 1;
    info->m_lowerLimit[info->rowskip] = scalar(-0.01);
    info->m_upperLimit[info->rowskip] = scalar(0.01);
  }
  void setParam(int, btScalar, int) override {}
  btScalar getParam(int, int) const override { return 0; }

 private:
  btScalar m_length;
};

TEST(Joints, OfTheApplicationsOwnClass) {
  const JointKind rod{"Rod", [](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
                        return o.joint<Rod>(false, a, b, 1.5);
                      }};
  Pair<StockWorld> stock(rod);
  Pair<GpuWorld> gpu(rod);
  for (int step = 1; step <= 60; ++step) {
    stock.w.run(1);
    gpu.w.run(1);
    const double tolerance = step * oneStepNoise(step == 1 ? 3 : 9) * (1 + step * kStep);
    expectNear(stateOf(*gpu.a), stateOf(*stock.a), tolerance, "A, step " + std::to_string(step));
    expectNear(stateOf(*gpu.b), stateOf(*stock.b), tolerance, "B, step " + std::to_string(step));
    if (HasFailure()) break;
  }
  expectJointsOnDevice(gpu.w.world, 60);
}

// ---- bodies that don't move, or move by themselves

template <typename World>
struct Swing {
  // A ball on a rod below: `held` is the fixed body, a static one or a kinematic one that moves.
  explicit Swing(const std::string& held) {
    w.world.setGravity(vector(0, -10, 0));
    ball = w.objects.add(2, w.objects.box(vector(0.3, 0.4, 0.2)), vector(1, 4, 0));
    ball->setActivationState(DISABLE_DEACTIVATION);
    btRigidBody* anchor = nullptr;
    if (held == "static") anchor = w.objects.add(0, w.objects.sphere(scalar(0.2)), vector(0, 5, 0));
    if (held == "kinematic" || held == "kinematic with mass") {
      anchor = w.objects.add(held == "kinematic" ? 0 : 3, w.objects.sphere(scalar(0.2)), vector(0, 5, 0));
      anchor->setCollisionFlags(anchor->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
      anchor->setActivationState(DISABLE_DEACTIVATION);
      platform = anchor;
    }
    if (anchor) {
      w.objects.template joint<btPoint2PointConstraint>(false, *anchor, *ball, vector(0, 0, 0), vector(-1, 1, 0));
    } else {
      w.objects.template joint<btHingeConstraint>(false, *ball, vector(-1, 1, 0), vector(0, 0, 1));
    }
  }
  void step() {
    if (platform) {
      ++m_steps;
      platform->setWorldTransform(btTransform(btQuaternion::getIdentity(), vector(0.02 * m_steps, 5, 0)));
    }
    w.run(1);
  }
  World w;
  btRigidBody *ball, *platform = nullptr;

 private:
  int m_steps = 0;
};

TEST(Joints, ToBodiesThatAreHeld) {
  for (const std::string held : {"fixed body", "static", "kinematic", "kinematic with mass"}) {
    SCOPED_TRACE(held);
    Swing<StockWorld> stock(held);
    Swing<GpuWorld> gpu(held);
    for (int step = 1; step <= 60; ++step) {
      stock.step();
      gpu.step();
      expectNear(stateOf(*gpu.ball), stateOf(*stock.ball), step * oneStepNoise(9) * (1 + step * kStep),
                 "step " + std::to_string(step));
      if (::testing::Test::HasFailure()) return;
    }
    expectJointsOnDevice(gpu.w.world, 60);
  }
}

// ---- chains

// Balls in a row, the first one held, hanging from one joint to the next; `reversed`: the joints added from the other
// end.
template <typename World>
struct Chain {
  explicit Chain(int links, bool reversed = false, int iterations = -1) {
    w.world.setGravity(vector(0, -10, 0));
    btCollisionShape* shape = w.objects.sphere(scalar(0.2));
    for (int i = 0; i <= links; ++i) {
      bodies.push_back(w.objects.add(i == 0 ? 0 : 1, shape, vector(i, 0, 0)));
      bodies.back()->setActivationState(DISABLE_DEACTIVATION);
    }
    for (int k = 0; k < links; ++k) {
      const auto i = static_cast<size_t>(reversed ? links - 1 - k : k);
      auto* joint = w.objects.template joint<btPoint2PointConstraint>(false, *bodies[i], *bodies[i + 1],
                                                                      vector(0.5, 0, 0), vector(-0.5, 0, 0));
      joint->setOverrideNumSolverIterations(iterations);
    }
  }
  // Squares of the gaps at the joints.
  double gaps() const {
    double sum = 0;
    for (size_t i = 1; i < bodies.size(); ++i) {
      const btVector3 a = bodies[i - 1]->getWorldTransform() * vector(0.5, 0, 0);
      const btVector3 b = bodies[i]->getWorldTransform() * vector(-0.5, 0, 0);
      sum += double((a - b).length2());
    }
    return sum;
  }
  World w;
  std::vector<btRigidBody*> bodies;
};

template <typename World>
double gapsOfRun(Chain<World>& chain, int steps) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    chain.w.run(1);
    sum += chain.gaps();
  }
  return std::sqrt(sum / (steps * double(chain.bodies.size() - 1)));
}

// Joints of a long chain are solved in another order than stock's, and stock's own result depends on the order. What
// may be asked: gaps no larger than those of stock's worse order. Short ones are solved in stock's order: the same but
// for noise.
TEST(Joints, ChainHoldsAsInStock) {
  for (const int links : {3, 10, 30}) {
    Chain<StockWorld> stock(links), reversed(links, true);
    Chain<GpuWorld> gpu(links);
    const double ours = gapsOfRun(gpu, 90), forward = gapsOfRun(stock, 90), backward = gapsOfRun(reversed, 90);
    EXPECT_LE(ours, 1.001 * std::max(forward, backward)) << links << " links; " << forward << ", " << backward;
    EXPECT_GE(ours, 0.2 * std::min(forward, backward)) << "too good to be true";
    expectJointsOnDevice(gpu.w.world, 90);
  }
}

// More iterations for a chain: it holds better, as in stock. With one link nothing depends on the order.
TEST(Joints, OverrideIterations) {
  Chain<GpuWorld> few(10), many(10, false, 60);
  Chain<StockWorld> stock(10, false, 60), reversed(10, true, 60);
  const double ours = gapsOfRun(many, 60);
  EXPECT_LT(ours, 0.5 * gapsOfRun(few, 60));
  EXPECT_LE(ours, 1.001 * std::max(gapsOfRun(stock, 60), gapsOfRun(reversed, 60)));
  for (const int iterations : {1, 3, 25}) {
    Chain<GpuWorld> gpuOne(1, false, iterations);
    Chain<StockWorld> stockOne(1, false, iterations);
    gpuOne.w.run(20);
    stockOne.w.run(20);
    expectNear(stateOf(*gpuOne.bodies[1]), stateOf(*stockOne.bodies[1]), 20 * oneStepNoise(9), "one link");
  }
}

// A hub with more joints than there are colours.
TEST(Joints, HubOfFortyFive) {
  const auto build = [](scenes::Objects& o) {
    o.world().setGravity(vector(0, 0, 0));
    btCollisionShape* shape = o.sphere(scalar(0.1));
    btRigidBody* hub = o.add(50, shape, vector(0, 0, 0));
    for (int i = 0; i < 45; ++i) {
      const double angle = 0.14 * i;
      const btVector3 at = vector(3 * std::cos(angle), 3 * std::sin(angle), 0.2 * (i % 5));
      btRigidBody* body = o.add(1, shape, at);
      body->setLinearVelocity(vector(-std::sin(angle), std::cos(angle), 0.1 * i));
      o.joint<btPoint2PointConstraint>(false, *hub, *body, at * scalar(0.1), at * scalar(-0.9));
    }
  };
  GpuWorld gpu;
  StockWorld stock;
  build(gpu.objects);
  build(stock.objects);
  double ours = 0, stocks = 0;
  for (int i = 0; i < 60; ++i) {
    gpu.run(1);
    stock.run(1);
    for (auto [sum, objects] : {std::make_pair(&ours, &gpu.objects), std::make_pair(&stocks, &stock.objects)}) {
      for (int j = 0; j < objects->world().getNumConstraints(); ++j) {
        auto& joint = *static_cast<btPoint2PointConstraint*>(objects->world().getConstraint(j));
        const btVector3 gap = joint.getRigidBodyA().getWorldTransform() * joint.getPivotInA() -
                              joint.getRigidBodyB().getWorldTransform() * joint.getPivotInB();
        *sum += double(gap.length2());
      }
    }
  }
  EXPECT_LE(std::sqrt(ours), 1.1 * std::sqrt(stocks)) << "rows in another order";
  expectJointsOnDevice(gpu.world, 60);
}

// ---- together with contacts

// Two balls on a plane and a rod between them: all rows of the joint before those of the contacts, in both modes.
TEST(Joints, WithContacts) {
  for (const bool interleaved : {false, true}) {
    const auto build = [interleaved](auto& w) {
      w.world.setGravity(vector(0, -10, 0));
      if (interleaved) w.world.getSolverInfo().m_solverMode |= SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS;
      w.objects.add(0, w.objects.plane(vector(0, 1, 0), 0), vector(0, 0, 0));
      btCollisionShape* shape = w.objects.sphere(scalar(0.5));
      btRigidBody* a = w.objects.add(1, shape, vector(0, 0.5, 0));
      btRigidBody* b = w.objects.add(3, shape, vector(2, 0.5, 0));
      a->setLinearVelocity(vector(0, 0, 3));
      b->setAngularVelocity(vector(2, 3, 0));
      const btTransform at = frameBetween(*a, *b);
      w.objects.template joint<btFixedConstraint>(false, *a, *b, frameIn(*a, at), frameIn(*b, at));
    };
    GpuWorld gpu;
    StockWorld stock;
    build(gpu);
    build(stock);
    for (int step = 1; step <= 20; ++step) {
      gpu.run(1);
      stock.run(1);
      for (size_t i = 1; i < 3; ++i) {
        // Twice the noise of a joint alone: as many rows again.
        expectNear(stateOf(*gpu.objects.bodies()[i]), stateOf(*stock.objects.bodies()[i]), 2 * step * oneStepNoise(9),
                   "body " + std::to_string(i) + ", step " + std::to_string(step));
      }
      if (::testing::Test::HasFailure()) return;
    }
    expectJointsOnDevice(gpu.world, 20);
  }
}

// Boxes that overlap, linked so that they don't collide; then collisions are turned off and on at run time.
TEST(Joints, LinkedBodiesDontCollide) {
  const auto run = [](auto& w, std::vector<double>& seen) {
    w.world.setGravity(vector(0, 0, 0));
    btCollisionShape* shape = w.objects.box(vector(0.5, 0.5, 0.5));
    btRigidBody* a = w.objects.add(1, shape, vector(0, 0, 0));
    btRigidBody* b = w.objects.add(1, shape, vector(0.8, 0.1, 0));
    btRigidBody* c = w.objects.add(1, shape, vector(5, 0, 0));
    btRigidBody* d = w.objects.add(1, shape, vector(5.8, 0.1, 0));
    c->setIgnoreCollisionCheck(d, true);
    b->setAngularVelocity(vector(0, 0, 1));
    const btTransform at = frameBetween(*a, *b);
    auto* joint = w.objects.template joint<btHingeConstraint>(true, *a, *b, frameIn(*a, at), frameIn(*b, at));
    const auto note = [&] {
      for (const btRigidBody* body : {a, b, c, d}) {
        seen.push_back(double(body->getWorldTransform().getOrigin().x()));
        seen.push_back(double(body->getLinearVelocity().x()));
      }
    };
    w.run(10);
    note();
    d->setIgnoreCollisionCheck(c, true);  // both ways now: still the one pair
    c->setIgnoreCollisionCheck(d, false);
    w.run(1);
    note();
    w.objects.remove(joint);
    d->setIgnoreCollisionCheck(c, false);
    w.run(1);  // now they push each other apart
    note();
  };
  GpuWorld gpu;
  StockWorld stock;
  std::vector<double> ours, stocks;
  run(gpu, ours);
  run(stock, stocks);
  ASSERT_EQ(ours.size(), stocks.size());
  for (size_t i = 0; i < ours.size(); ++i) {
    // Up to the last step no contact: noise. Then both push apart, but in another order of points.
    const bool pushed = i >= 16;
    EXPECT_NEAR(ours[i], stocks[i], pushed ? 0.02 : 12 * oneStepNoise(3)) << i;
  }
  EXPECT_EQ(ours[12], ours[4]) << "ignored, C stays";
  EXPECT_LT(ours[20], ours[12]) << "pushed";
  expectAllOnDevice(gpu.world, {"joints"});
}

// ---- at run time

// One ball after another is let go, joined, switched off and on; the joint breaks at last.
TEST(Joints, ChangeAtRunTime) {
  struct Seen {
    BodyState a, b;
    bool enabled;
    btScalar impulse;
  };
  const auto run = [](auto& pair, const JointKind& kind, std::vector<Seen>& seen) {
    const auto note = [&] {
      seen.push_back({stateOf(*pair.a), stateOf(*pair.b), pair.joint && pair.joint->isEnabled(),
                      pair.joint ? pair.joint->getAppliedImpulse() : btScalar(0)});
    };
    pair.w.run(5);
    note();
    pair.joint->setEnabled(false);
    pair.w.run(5);
    note();
    pair.joint->setEnabled(true);
    pair.w.run(5);
    note();
    pair.w.objects.remove(pair.joint);
    pair.joint = nullptr;
    pair.w.run(5);
    note();
    pair.joint = kind.make(pair.w.objects, *pair.a, *pair.b);
    pair.w.run(3);
    note();
    pair.joint->setBreakingImpulseThreshold(scalar(0.05));
    pair.b->applyCentralImpulse(vector(1, 0, 0));
    pair.w.run(1);
    note();
    pair.w.run(3);
    note();
  };
  for (const JointKind& kind : jointKinds()) {
    if (kind.name != "ball" && kind.name != "hingeLimit" && kind.name != "fixed") continue;
    SCOPED_TRACE(kind.name);
    Pair<StockWorld> stock(kind);
    Pair<GpuWorld> gpu(kind);
    std::vector<Seen> ours, stocks;
    run(gpu, kind, ours);
    run(stock, kind, stocks);
    for (size_t i = 0; i < ours.size(); ++i) {
      const double tolerance = 30 * oneStepNoise(9);
      expectNear(ours[i].a, stocks[i].a, tolerance, "A at " + std::to_string(i));
      expectNear(ours[i].b, stocks[i].b, tolerance, "B at " + std::to_string(i));
      EXPECT_EQ(ours[i].enabled, stocks[i].enabled) << i;
      EXPECT_NEAR(double(ours[i].impulse), double(stocks[i].impulse), tolerance) << i;
    }
    EXPECT_FALSE(ours[5].enabled) << "must break";
    EXPECT_EQ(gpu.w.world.statistics().m_stockSteps, 0u) << reportText(gpu.w.world);
  }
}

TEST(Joints, FeedbackIsStocks) {
  for (const JointKind& kind : jointKinds()) {
    SCOPED_TRACE(kind.name);
    Pair<StockWorld> stock(kind);
    Pair<GpuWorld> gpu(kind);
    btJointFeedback ours, stocks;
    gpu.joint->setJointFeedback(&ours);
    stock.joint->setJointFeedback(&stocks);
    for (const auto& pair : {gpu.a, stock.a}) pair->setAngularFactor(vector(1, 0.5, 1));
    gpu.w.run(2);
    stock.w.run(2);
    // Forces are impulses over the time step, sums over six rows.
    const double tolerance = 60 * 6 * 2 * oneStepNoise(3);
    EXPECT_LE(distance(ours.m_appliedForceBodyA, stocks.m_appliedForceBodyA), tolerance);
    EXPECT_LE(distance(ours.m_appliedForceBodyB, stocks.m_appliedForceBodyB), tolerance);
    EXPECT_LE(distance(ours.m_appliedTorqueBodyA, stocks.m_appliedTorqueBodyA), tolerance);
    EXPECT_LE(distance(ours.m_appliedTorqueBodyB, stocks.m_appliedTorqueBodyB), tolerance);
    EXPECT_GT(length(ours.m_appliedForceBodyA) + length(ours.m_appliedTorqueBodyA), 10 * tolerance);
  }
}

// ---- sleep

// Three balls far apart on a plane, linked; a fourth one alone. Linked ones sleep and wake together, a joint that
// sleeps keeps its impulse, and a disabled one links nothing.
TEST(Joints, SleepTogether) {
  const auto build = [](auto& w) {
    w.world.setGravity(vector(0, -10, 0));
    w.objects.add(0, w.objects.plane(vector(0, 1, 0), 0), vector(0, 0, 0));
    btCollisionShape* shape = w.objects.sphere(scalar(0.5));
    for (int i = 0; i < 4; ++i) w.objects.add(1, shape, vector(3 * i, 0.5, 0));
    const auto& bodies = w.objects.bodies();
    for (size_t i = 1; i < 3; ++i) {
      const btTransform at = frameBetween(*bodies[i], *bodies[i + 1]);
      w.objects.template joint<btFixedConstraint>(false, *bodies[i], *bodies[i + 1], frameIn(*bodies[i], at),
                                                  frameIn(*bodies[i + 1], at));
    }
    auto* off = w.objects.template joint<btPoint2PointConstraint>(false, *bodies[3], *bodies[4], vector(1.5, 0, 0),
                                                                  vector(-1.5, 0, 0));
    off->setEnabled(false);
    off->internalSetAppliedImpulse(scalar(5));
  };
  GpuWorld gpu;
  StockWorld stock;
  build(gpu);
  build(stock);
  const auto expectSameStates = [&](int step) {
    for (size_t i = 1; i < 5; ++i) {
      EXPECT_EQ(gpu.objects.bodies()[i]->getActivationState(), stock.objects.bodies()[i]->getActivationState())
          << "body " << i << ", step " << step;
    }
    // Stock forgets the impulse of a disabled joint while its island is awake, and leaves it alone in one that sleeps.
    EXPECT_EQ(gpu.world.getConstraint(2)->getAppliedImpulse(), stock.world.getConstraint(2)->getAppliedImpulse())
        << "step " << step;
  };
  const auto impulses = [&gpu] {
    return std::make_pair(gpu.world.getConstraint(0)->getAppliedImpulse(),
                          gpu.world.getConstraint(1)->getAppliedImpulse());
  };
  int asleep = 0;
  for (int step = 0; step < 400; ++step) {
    for (auto* bodies : {&gpu.objects.bodies(), &stock.objects.bodies()}) {
      if (step == 60) (*bodies)[1]->applyCentralImpulse(vector(0, 0, 1));  // one of the three is kept awake a while
      if (step == 300) (*bodies)[3]->activate(true);
    }
    const auto before = impulses();
    gpu.run(1);
    stock.run(1);
    expectSameStates(step);
    if (gpu.objects.bodies()[1]->getActivationState() == ISLAND_SLEEPING) {
      EXPECT_EQ(impulses(), before) << "asleep";
      // Set while they sleep, it stays in both.
      for (auto* world : {static_cast<btDiscreteDynamicsWorld*>(&gpu.world), &stock.world}) {
        world->getConstraint(2)->internalSetAppliedImpulse(scalar(step));
      }
    }
    asleep += gpu.objects.bodies()[1]->getActivationState() == ISLAND_SLEEPING;
    if (step == 301) {
      EXPECT_NE(gpu.objects.bodies()[1]->getActivationState(), ISLAND_SLEEPING) << "woken by its link";
    }
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(asleep, 50);
  EXPECT_LT(asleep, 350);
  expectJointsOnDevice(gpu.world, 400);
}

// ---- the order of joints

// Chains of different length, each held at one end, whose joints are added in turns; everything moves.
template <typename World>
struct Chains {
  Chains() {
    w.world.setGravity(vector(0, -10, 0));
    btCollisionShape* shape = w.objects.sphere(scalar(0.2));
    const std::vector<int> links = {40, 25, 60};
    std::vector<std::vector<btRigidBody*>> chains(links.size());
    for (size_t c = 0; c < links.size(); ++c) {
      for (int i = 0; i <= links[c]; ++i) {
        btRigidBody* body = w.objects.add(i == 0 ? 0 : 1, shape, vector(i, 0, 3.0 * double(c)));
        if (i > 0) body->setLinearVelocity(vector(0, std::sin(2.0 * i), std::cos(3.0 * i)));
        chains[c].push_back(body);
      }
    }
    for (size_t i = 0; i < 60; ++i) {
      for (const auto& chain : chains) {
        if (i + 1 >= chain.size()) continue;
        w.objects.template joint<btPoint2PointConstraint>(false, *chain[i], *chain[i + 1], vector(0.5, 0, 0),
                                                          vector(-0.5, 0, 0));
      }
    }
  }
  World w;
};

// Ten iterations leave another result in each order of the joints; stock's is that of its sort by islands. 180 rows of
// the longest chain in 10 iterations round as those of oneStepNoise() do.
TEST(Joints, ChainsAreSolvedInStocksOrder) {
  Chains<StockWorld> stock;
  Chains<GpuWorld> gpu;
  stock.w.run(1);
  gpu.w.run(1);
  const double tolerance = oneStepNoise(3) * std::sqrt(180.0 * 10 / 120);
  for (size_t i = 0; i < gpu.w.objects.bodies().size(); ++i) {
    expectNear(stateOf(*gpu.w.objects.bodies()[i]), stateOf(*stock.w.objects.bodies()[i]), tolerance,
               "body " + std::to_string(i));
    if (::testing::Test::HasFailure()) return;
  }
  expectJointsOnDevice(gpu.w.world, 1);
}

// ---- what goes to the stock path

TEST(Joints, BodyOutsideTheWorld) {
  const JointKind kind = jointKinds().front();
  Pair<GpuWorld> gpu(kind);
  gpu.w.run(2);
  gpu.w.world.removeRigidBody(gpu.b);
  gpu.w.run(2);
  const btGpuFallback outside = reported(gpu.w.world, "joint to a body outside the world");
  EXPECT_EQ(outside.m_count, 2u);
  EXPECT_TRUE(outside.m_wholeStep);
  EXPECT_EQ(gpu.w.world.statistics().m_stockSteps, 2u);
  gpu.w.world.addRigidBody(gpu.b);
  gpu.w.run(2);
  EXPECT_EQ(gpu.w.world.statistics().m_deviceSteps, 4u);
}

}  // namespace
}  // namespace btgpu::test
