// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/80_integrate_poses.h"

#include <cmath>
#include <limits>

#include "gpu_engine/stages/80_integrate_poses_reference.h"
#include "kernels/lib/vec.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

// What stage 80 reads, made by hand.
struct PoseScene {
  WorldBuilder builder;
  StepSettings settings;
  std::vector<BodyStep> steps;
  std::vector<SolverBody> solverBodies;
  std::vector<uint> solved;

  // A body that the solver moves, if it is dynamic, and that has been solved.
  uint add(uint flags = BODY_INTEGRATED, int state = STATE_ACTIVE) {
    const uint i = builder.add(m_shape, {1, 2, 3, 0}, 1);
    builder.info(i).flags = BODY_PRESENT | BODY_RIGID | flags;
    builder.activation(i).state = state;
    steps.push_back({});
    steps.back().angularVelocity.w = flags & BODY_STATIC ? 0.0f : 1.0f;
    solverBodies.push_back({});
    solved.push_back(1);
    return i;
  }
  uint bodyCount() const { return builder.bodyCount(); }

 private:
  int m_shape = builder.sphere(1);
};

struct Poses : PosesReference {
  StepCounters counters;
};

class IntegratePosesTest : public DeviceTest {
 protected:
  Poses device(const PoseScene& scene, uint overflow = 0) {
    const WorldInput in = scene.builder.finish();
    StageBench bench(queue(), in, scene.settings);
    DeviceWorld& world = bench.world();
    bench.write(world.steps, scene.steps);
    bench.write(world.solverBodies, scene.solverBodies);
    bench.write(world.solved, scene.solved);
    bench.write(world.stepActivations, in.activations.values);
    StepCounters counters{};
    counters.overflow = overflow;
    bench.setCounters(counters);
    bench.run<IntegratePoses>();
    Poses out;
    out.infos = bench.read(world.infos, in.bodyCount);
    out.poses = bench.read(world.poses, in.bodyCount);
    out.velocities = bench.read(world.velocities, in.bodyCount);
    out.counters = bench.counters();
    out.quarantined = out.counters.quarantined;
    return out;
  }

  static PosesReference before(const PoseScene& scene) {
    const WorldInput in = scene.builder.finish();
    return {in.infos.values, in.poses.values, in.velocities.values, 0};
  }

  Poses expectAsReference(const PoseScene& scene) {
    const Poses actual = device(scene);
    const PosesReference was = before(scene);
    PosesReference expected = was;
    integratePosesReference(makeStepParams(scene.settings, false), scene.steps, scene.solverBodies, scene.solved,
                            scene.builder.finish().activations.values, expected);
    Contract contract("80_integrate_poses");
    checkIntegratedPoses(contract, makeStepParams(scene.settings, false), scene.steps, scene.solverBodies, was, actual,
                         expected);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return actual;
  }
};

// ---- by hand

TEST_F(IntegratePosesTest, FreeMotionSmall) {
  PoseScene scene;
  const uint i = scene.add();
  scene.builder.velocity(i).linear = {100, 0, 0, 0};  // not this one: damped in steps[]
  scene.steps[i].linearVelocity = {60, 0, 0, 1};
  scene.steps[i].externalLinear = {0, -6, 0, 0};
  scene.steps[i].angularVelocity = {0, 0, 30, 1};
  const Poses p = expectAsReference(scene);
  EXPECT_EQ(p.velocities[i].linear.x, 60);
  EXPECT_EQ(p.velocities[i].linear.y, -6);
  EXPECT_FLOAT_EQ(p.poses[i].position.x, 2);
  EXPECT_FLOAT_EQ(p.poses[i].position.y, 1.9f);
  EXPECT_FLOAT_EQ(p.poses[i].orientation.z, std::sin(0.25f));  // half of 30 / 60
}

// The fastest spin: a turn by a quarter of pi, but with Bullet's overlong sine part.
TEST_F(IntegratePosesTest, FastSpinSmall) {
  PoseScene scene;
  for (const float rate : {47.0f, 47.2f, 100.0f, 1e6f}) scene.steps[scene.add()].angularVelocity = {rate, 0, 0, 1};
  for (const float rate : {0.0f, 1e-5f, 3e-4f, 4e-4f, 9e-4f, 2e-3f}) {
    scene.steps[scene.add()].angularVelocity = {0, rate, 0, 1};
  }
  const Poses p = expectAsReference(scene);
  const float quarterPi = 0.78539816f, tangent = 100.0f / 60 / quarterPi * std::tan(quarterPi / 2);
  EXPECT_NEAR(p.poses[2].orientation.x / p.poses[2].orientation.w, tangent, 1e-5f);
}

TEST_F(IntegratePosesTest, SplitPushSmall) {
  for (const bool split : {true, false}) {
    PoseScene scene;
    scene.settings.splitImpulse = split;
    scene.settings.splitImpulseTurnErp = 0.5f;
    const uint awake = scene.add(), asleep = scene.add(BODY_INTEGRATED, STATE_SLEEPING), unsolved = scene.add();
    for (const uint i : {awake, asleep, unsolved}) {
      scene.steps[i].linearVelocity = {0, 0, 60, 1};
      scene.solverBodies[i].pushLinear = {6, 0, 0, 0};
      scene.solverBodies[i].turnAngular = {0, 12, 0, 0};
    }
    scene.solved[unsolved] = 0;
    const Poses p = expectAsReference(scene);
    EXPECT_FLOAT_EQ(p.poses[awake].position.x, split ? 1.1f : 1);
    EXPECT_FLOAT_EQ(p.poses[awake].orientation.y, split ? std::sin(0.05f) : 0);
    EXPECT_FLOAT_EQ(p.poses[awake].position.z, 4);
    EXPECT_EQ(p.velocities[awake].linear.x, 0) << "a push is no velocity";
    EXPECT_FLOAT_EQ(p.poses[asleep].position.x, split ? 1.1f : 1) << "Bullet pushes what an awake body touches";
    EXPECT_EQ(p.poses[asleep].position.z, 3);
    EXPECT_EQ(p.poses[unsolved].position.x, 1);
  }
}

// Who moves, by state; all are solved.
TEST_F(IntegratePosesTest, StatesSmall) {
  PoseScene scene;
  for (int state = STATE_UNSET; state <= STATE_FIXED_BASE; ++state) {
    const uint i = scene.add(BODY_INTEGRATED, state);
    scene.steps[i].linearVelocity = {6, 0, 0, 1};
    scene.steps[i].angularVelocity = {0, 6, 0, 1};
  }
  const Poses p = expectAsReference(scene);
  for (int state = STATE_UNSET; state <= STATE_FIXED_BASE; ++state) {
    const bool moves = state != STATE_SLEEPING && state != STATE_DISABLE_SIMULATION && state != STATE_FIXED_BASE;
    EXPECT_FLOAT_EQ(p.poses[static_cast<size_t>(state)].position.x, moves ? 1.1f : 1) << "state " << state;
    EXPECT_EQ(p.velocities[static_cast<size_t>(state)].linear.x, 6) << "damped, but not stopped";
  }
}

TEST_F(IntegratePosesTest, StaticAndKinematicSmall) {
  PoseScene scene;
  for (const uint flags : {BODY_STATIC, BODY_KINEMATIC, BODY_KINEMATIC | BODY_INTEGRATED, 0u}) {
    const uint i = scene.add(flags);
    scene.builder.velocity(i) = {{1, 2, 3, 0}, {4, 5, 6, 0}};
    scene.steps[i].linearVelocity = {7, 7, 7, scene.steps[i].linearVelocity.w};
    scene.solverBodies[i].deltaLinear = {0.5f, 0, 0, 0};
    scene.solverBodies[i].pushLinear = {0, 6, 0, 0};
  }
  const Poses p = expectAsReference(scene);
  EXPECT_EQ(p.velocities[0].linear.x, 1) << "static";
  EXPECT_EQ(p.poses[0].position.y, 2);
  for (const uint i : {1u, 2u, 3u}) {
    EXPECT_EQ(p.velocities[i].linear.x, 1.5f) << "pushed by the solver, body " << i;
    EXPECT_FLOAT_EQ(p.poses[i].position.y, 2.1f);
    EXPECT_EQ(p.poses[i].position.x, 1) << "but moved by the application alone";
  }
}

TEST_F(IntegratePosesTest, AbsentAndQuarantinedSmall) {
  PoseScene scene;
  const uint absent = scene.add(), quarantined = scene.add(BODY_INTEGRATED | BODY_QUARANTINED);
  scene.builder.info(absent).flags = BODY_INTEGRATED;
  for (const uint i : {absent, quarantined}) {
    scene.builder.pose(i).position.x = kNan;
    scene.steps[i].linearVelocity = {1, kInf, 0, 1};
  }
  EXPECT_EQ(expectAsReference(scene).quarantined, 0u) << "not a second time";
}

// Every way to come out not finite. The pose stays, the velocity goes, the neighbours do not notice.
TEST_F(IntegratePosesTest, QuarantineSmall) {
  PoseScene good, bad;
  for (PoseScene* scene : {&good, &bad}) {
    for (int i = 0; i < 30; ++i) {
      const uint body = scene->add();
      const float v = static_cast<float>(i);
      scene->steps[body].linearVelocity = {v, 1, 2, 1};
      scene->steps[body].angularVelocity = {1, v, 2, 1};
      scene->builder.velocity(body).linear = {v, 1, 2, 0};
    }
  }
  bad.steps[1].linearVelocity.y = kNan;
  bad.steps[3].angularVelocity.z = kInf;
  bad.steps[5].externalLinear.x = -kInf;
  bad.steps[7].externalAngular.y = kNan;
  bad.solverBodies[9].deltaLinear.x = kNan;
  bad.solverBodies[11].deltaAngular.x = kInf;
  bad.solverBodies[13].pushLinear.x = kNan;
  bad.solverBodies[15].turnAngular.x = kNan;
  bad.builder.pose(17).position.z = kInf;
  bad.builder.pose(19).orientation.w = kNan;
  bad.steps[21].linearVelocity.x = bad.steps[21].externalLinear.x = 3e38f;  // overflows
  const Poses p = expectAsReference(bad), reference = device(good);
  EXPECT_EQ(p.quarantined, 11u);
  for (uint i = 0; i < bad.bodyCount(); ++i) {
    const bool expected = i % 2 == 1 && i <= 21;
    EXPECT_EQ((p.infos[i].flags & BODY_QUARANTINED) != 0, expected) << "body " << i;
    if (expected) {
      EXPECT_TRUE(sameBits(p.velocities[i], BodyVelocity{})) << "body " << i;
      EXPECT_TRUE(sameBits(p.poses[i], bad.builder.pose(i))) << "body " << i;
    } else {
      EXPECT_TRUE(sameBits(p.poses[i], reference.poses[i])) << "body " << i;
      EXPECT_TRUE(sameBits(p.velocities[i], reference.velocities[i])) << "body " << i;
    }
  }
}

// The first stage that changes the state of the world must not do so when the step has to be repeated.
TEST_F(IntegratePosesTest, NothingAfterOverflowSmall) {
  PoseScene scene;
  scene.steps[scene.add()].linearVelocity = {60, kNan, 0, 1};
  scene.steps[scene.add()].linearVelocity = {60, 0, 0, 1};
  const PosesReference was = before(scene);
  for (const uint overflow : {OVERFLOW_PAIRS, OVERFLOW_SLOTS, OVERFLOW_ABSENT}) {
    const Poses p = device(scene, overflow);
    EXPECT_EQ(p.quarantined, 0u);
    for (uint i = 0; i < 2; ++i) {
      EXPECT_TRUE(sameBits(p.infos[i], was.infos[i]));
      EXPECT_TRUE(sameBits(p.poses[i], was.poses[i]));
      EXPECT_TRUE(sameBits(p.velocities[i], was.velocities[i]));
    }
  }
}

// ---- random

PoseScene randomScene(uint bodies, unsigned seed) {
  std::mt19937 random(seed);
  PoseScene scene;
  const uint kinds[] = {BODY_INTEGRATED,
                        BODY_INTEGRATED,
                        BODY_INTEGRATED,
                        BODY_INTEGRATED,
                        BODY_STATIC,
                        BODY_KINEMATIC,
                        BODY_KINEMATIC | BODY_INTEGRATED,
                        0,
                        BODY_INTEGRATED | BODY_QUARANTINED};
  while (scene.bodyCount() < bodies) {
    const uint i = scene.add(kinds[random() % std::size(kinds)], static_cast<int>(random() % 7));
    if (random() % 16 == 0) scene.builder.info(i).flags &= ~BODY_PRESENT;
    scene.builder.pose(i) = {uniform3(random, -100, 100), randomTurn(random)};
    scene.builder.velocity(i) = {uniform3(random, -5, 5), uniform3(random, -5, 5)};
    const float moves = random() % 4 ? 1.0f : 0.0f, spin = random() % 4 ? 10.0f : 100.0f;
    BodyStep& step = scene.steps[i];
    step.linearVelocity = withW(uniform3(random, -5, 5), 1);
    step.angularVelocity = withW(uniform3(random, -spin, spin), moves);
    step.externalLinear = uniform3(random, -1, 1);
    step.externalAngular = uniform3(random, -1, 1);
    SolverBody& s = scene.solverBodies[i];
    s.deltaLinear = uniform3(random, -5, 5);
    s.deltaAngular = uniform3(random, -5, 5);
    if (random() % 2) s.pushLinear = uniform3(random, -5, 5);
    if (random() % 2) s.turnAngular = uniform3(random, -5, 5);
    scene.solved[i] = random() % 2;
  }
  return scene;
}

TEST_F(IntegratePosesTest, RandomSmall) { expectAsReference(randomScene(61, 1)); }

TEST_F(IntegratePosesTest, Random) {
  for (const uint bodies : {127u, 128u, 129u, 5000u}) expectAsReference(randomScene(bodies, bodies));
}

}  // namespace
}  // namespace btgpu
