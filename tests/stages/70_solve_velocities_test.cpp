// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/70_solve_velocities.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gpu_engine/stages/52_prepare_joints.h"
#include "gpu_engine/stages/65_prepare_contacts.h"
#include "gpu_engine/stages/70_solve_velocities_reference.h"
#include "gpu_engine/stages/80_integrate_poses.h"
#include "kernels/lib/vec.h"
#include "kernels/shared/team.h"
#include "tests/support/bullet_contacts.h"
#include "tests/support/contact_scene.h"
#include "tests/support/device_test.h"
#include "tests/support/joint_scene.h"

namespace btgpu {
namespace {

constexpr double kRounding = 1.0 / 16777216;

// The largest difference of two results in each kind of value, and the largest value.
struct Difference {
  double linear = 0, angular = 0, push = 0, turn = 0, impulse = 0;

  // What is no number counts as infinite.
  static void take(double& largest, double v) {
    largest = std::isnan(v) ? std::numeric_limits<double>::infinity() : std::max(largest, v);
  }
  static void take(double& largest, float4 v) { take(largest, double(length3(v))); }
  void takeBody(const SolverBody& v) {
    take(linear, v.deltaLinear);
    take(angular, v.deltaAngular);
    take(push, v.pushLinear);
    take(turn, v.turnAngular);
  }
  void takeImpulse(float v) { take(impulse, std::fabs(double(v))); }
  void takeImpulses(const ContactPoint& a, const ContactPoint& b) {
    takeImpulse(a.localPointB.w - b.localPointB.w);
    takeImpulse(a.normalWorldOnB.w - b.normalWorldOnB.w);
    takeImpulse(a.lateralFrictionDir1.w - b.lateralFrictionDir1.w);
  }
};

Difference sizeOf(const SolveReference& a) {
  Difference size;
  for (const SolverBody& b : a.bodies) size.takeBody(b);
  for (const Manifold& m : a.manifolds) {
    for (int k = 0; k < m.pointCount; ++k) size.takeImpulses(m.points[k], {});
  }
  for (const float impulse : a.joints.impulses) size.takeImpulse(impulse);
  return size;
}

class SolveVelocitiesTest : public DeviceTest {
 protected:
  SolveReference read(StageBench& bench, const ContactScene& scene) {
    DeviceWorld& world = bench.world();
    return {bench.read(world.solverBodies, world.bodyCount),
            bench.read(world.rows),
            bench.read(world.tangent2),
            bench.read(world.torsion),
            bench.read(world.manifolds, scene.manifolds.size()),
            {bench.read(world.joints), bench.read(world.jointRows), bench.read(world.jointEffects),
             bench.read(world.jointSolved), world.jointColours.order, bench.read(world.jointImpulses)}};
  }

  struct Solved {
    SolveReference before, device;  // before: as stage 65 left it
    std::vector<SlotHeader> slots;
    std::vector<SolverMass> masses;
    StepParams params;
  };
  // `asleep`: joints of islands that are not solved, by index.
  // In a launch a colour, and again in resident groups where there are such: bit by bit the same.
  Solved solve(const ContactScene& scene, const JointScene& joints = {}, const std::vector<uint>& asleep = {}) {
    const Solved s = solveIn(0, scene, joints, asleep);
    if (device().shape() == KernelShape::Gpu) expectSame(solveIn(1, scene, joints, asleep).device, s.device);
    return s;
  }
  Solved solveIn(uint residentGroups, const ContactScene& scene, const JointScene& joints,
                 const std::vector<uint>& asleep) {
    const auto bench = benchForContacts(queue(), scene);
    bench->run<PrepareContacts>();
    if (!joints.joints.empty()) {
      WorldInput input = scene.builder.finish();
      for (auto* changed : {&input.infos.changed, &input.born}) changed->clear();
      input = joints.addTo(input);
      bench->world().upload(queue(), input);
      queue().finish();
      bench->run<PrepareJoints>();
      std::vector<uint> solved(joints.joints.size(), 1);
      for (const uint j : asleep) solved[j] = 0;
      bench->write(bench->world().jointSolved, solved);
    }
    Solved s;
    s.before = read(*bench, scene);
    bench->world().capacities.residentGroups = residentGroups;
    bench->run<SolveVelocities>(scene.settings, scene.torsionRows);
    EXPECT_EQ(bench->counters().overflow, 0u);
    s.device = read(*bench, scene);
    s.slots = readSlots(*bench);
    s.masses = bench->read(bench->world().solverMasses, bench->world().bodyCount);
    s.params = bench->params();
    return s;
  }

  static void expectSame(const SolveReference& a, const SolveReference& b) {
    for (size_t i = 0; i < a.bodies.size(); ++i) ASSERT_TRUE(sameBits(a.bodies[i], b.bodies[i])) << i;
    for (size_t m = 0; m < a.manifolds.size(); ++m) ASSERT_TRUE(sameBits(a.manifolds[m], b.manifolds[m])) << m;
    EXPECT_EQ(a.joints.impulses, b.joints.impulses);
  }

  Solved expectAsReference(const ContactScene& scene, const JointScene& joints = {},
                           const std::vector<uint>& asleep = {}) {
    const Solved s = solve(scene, joints, asleep);
    Contract contract("70_solve_velocities");
    checkSolvedVelocities(contract, s.params, scene.settings.iterations, s.slots, s.masses, s.before, s.device);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return s;
  }
};

// ---- by hand

// A unit sphere on the ground, as in the test of stage 65.
ContactScene sphereOnGround(float4 velocity) {
  ContactScene scene;
  const int shape = scene.builder.sphere(1);
  scene.builder.add(shape, {0, 1, 0, 0}, 2);
  scene.builder.add(shape, {0, -1, 0, 0}, 0);
  scene.builder.velocity(0).linear = velocity;
  scene.addPoint(scene.addManifold(0, 1), {0, 1, 0, 0}, 0, {0, -1, 0, 0}, {0, 1, 0, 0});
  return scene;
}

TEST_F(SolveVelocitiesTest, StopsSmall) {
  const Solved s = expectAsReference(sphereOnGround({0, -3, 0, 0}));
  EXPECT_FLOAT_EQ(s.device.bodies[0].deltaLinear.y, 3);
  EXPECT_FLOAT_EQ(s.device.manifolds[0].points[0].localPointB.w, 6);
  EXPECT_TRUE(sameBits(s.device.bodies[1], SolverBody{})) << "the ground";
}

TEST_F(SolveVelocitiesTest, DoesNotPullSmall) {
  const Solved s = expectAsReference(sphereOnGround({1, 3, 0, 0}));
  EXPECT_EQ(length3(s.device.bodies[0].deltaLinear), 0);
  EXPECT_EQ(s.device.manifolds[0].points[0].localPointB.w, 0);
}

// Friction of half the normal impulse, and a sphere that is brought to rolling: 2/7 of the slip is taken off.
TEST_F(SolveVelocitiesTest, FrictionSmall) {
  const Solved sliding = expectAsReference(sphereOnGround({100, -3, 0, 0}));
  EXPECT_FLOAT_EQ(sliding.device.bodies[0].deltaLinear.x, -1.5f);
  EXPECT_FLOAT_EQ(std::fabs(sliding.device.manifolds[0].points[0].normalWorldOnB.w), 3);
  const Solved rolling = expectAsReference(sphereOnGround({0.7f, -3, 0, 0}));
  EXPECT_FLOAT_EQ(rolling.device.bodies[0].deltaLinear.x, -0.2f);
}

TEST_F(SolveVelocitiesTest, NoIterationsSmall) {
  ContactScene scene = sphereOnGround({0, -3, 0, 0});
  scene.settings.iterations = 0;
  scene.manifolds[0].points[0].localPointB.w = 2;
  const Solved warm = expectAsReference(scene);
  EXPECT_FLOAT_EQ(warm.device.bodies[0].deltaLinear.y, 0.85f) << "warm starting alone";
  EXPECT_FLOAT_EQ(warm.device.manifolds[0].points[0].localPointB.w, 1.7f);
  scene.settings.warmStarting = false;
  const Solved cold = expectAsReference(scene);
  EXPECT_EQ(cold.device.bodies[0].deltaLinear.y, 0);
  EXPECT_EQ(cold.device.manifolds[0].points[0].localPointB.w, 2) << "Bullet leaves it as it was";
}

TEST_F(SolveVelocitiesTest, SplitImpulseSmall) {
  ContactScene scene = sphereOnGround({0, 0, 0, 0});
  scene.manifolds[0].points[0].localPointA.w = -0.1f;
  const Solved split = expectAsReference(scene);
  EXPECT_EQ(split.device.bodies[0].deltaLinear.y, 0);
  EXPECT_FLOAT_EQ(split.device.bodies[0].pushLinear.y, 0.1f * 0.2f * 60);
  scene.settings.splitImpulse = false;
  const Solved together = expectAsReference(scene);
  EXPECT_FLOAT_EQ(together.device.bodies[0].deltaLinear.y, 0.1f * 0.2f * 60);
  EXPECT_EQ(together.device.bodies[0].pushLinear.y, 0);
}

// Bullet's limit of torsional friction: the coefficient times the impulse, but no more than the coefficient
// itself.
TEST_F(SolveVelocitiesTest, TorsionSmall) {
  for (const float speed : {-0.25f, -3.0f}) {
    ContactScene scene = sphereOnGround({0, speed, 0, 0});
    scene.torsionRows = true;
    scene.builder.velocity(0).angular = {0, 50, 0, 0};
    scene.manifolds[0].points[0].combined = {0, 0, 0.01f, 0.125f};
    const Solved s = expectAsReference(scene);
    const float impulse = 0.125f * std::min(1.0f, -speed * 2), inertia = 0.4f * 2;
    EXPECT_FLOAT_EQ(s.device.bodies[0].deltaAngular.y, -impulse / inertia) << "at " << speed;
  }
}

TEST_F(SolveVelocitiesTest, NothingAfterOverflowSmall) {
  const ContactScene scene = sphereOnGround({0, -3, 0, 0});
  const auto bench = benchForContacts(queue(), scene);
  bench->run<PrepareContacts>();
  StepCounters counters = bench->counters();
  counters.overflow = OVERFLOW_SLOTS;
  bench->setCounters(counters);
  bench->run<SolveVelocities>(scene.settings, false);
  EXPECT_TRUE(sameBits(read(*bench, scene).bodies[0], SolverBody{}));
}

// ---- random

// All combinations of what changes the way that rows are visited.
void setVariant(ContactScene& scene, uint bits) {
  scene.settings.warmStarting = bits & 1;
  scene.settings.splitImpulse = bits & 2;
  scene.settings.interleaveContactAndFriction = bits & 4;
  scene.settings.twoFrictionDirections = bits & 8;
  scene.torsionRows = bits & 16;
}
constexpr uint kVariants = 32;

TEST_F(SolveVelocitiesTest, RandomSmall) {
  std::mt19937 random(1);
  for (const uint bits : {9u, 31u}) {
    ContactScene scene = randomContacts(random, {12, 14});
    setVariant(scene, bits);
    scene.settings.iterations = 2;
    expectAsReference(scene);
  }
}

TEST_F(SolveVelocitiesTest, Random) {
  std::mt19937 random(2);
  for (uint bits = 0; bits < kVariants; ++bits) {
    SCOPED_TRACE(bits);
    ContactScene scene = randomContacts(random, {150, 200});
    setVariant(scene, bits);
    for (const int iterations : {0, 1, 10}) {
      scene.settings.iterations = iterations;
      expectAsReference(scene);
    }
  }
}

// ---- joints

// Two spheres of 2 and 4 mass units that come apart with 3 and are held together by one row.
TEST_F(SolveVelocitiesTest, JointSmall) {
  ContactScene scene;
  const int shape = scene.builder.sphere(1);
  scene.builder.add(shape, {}, 2);
  scene.builder.add(shape, {3, 0, 0, 0}, 4);
  scene.builder.velocity(1).linear = {3, 0, 0, 0};
  JointScene joints;
  joints.add(0, 1);
  joints.addRow({1, 0, 0, 0}, {}, {-1, 0, 0, 0}, {});
  const Solved s = expectAsReference(scene, joints);
  EXPECT_FLOAT_EQ(s.device.bodies[0].deltaLinear.x, 2);
  EXPECT_FLOAT_EQ(s.device.bodies[1].deltaLinear.x, -1);
  EXPECT_FLOAT_EQ(s.device.joints.impulses[0], 4);
  joints.rows[0].angularB.w = 1;  // the upper limit
  EXPECT_FLOAT_EQ(expectAsReference(scene, joints).device.joints.impulses[0], 1);
  EXPECT_EQ(expectAsReference(scene, joints, {0}).device.joints.impulses[0], 0) << "of an island asleep";
  joints.rows[0].linearB.w = 2;  // and a lower one above it: Bullet looks at the lower one first
  EXPECT_FLOAT_EQ(expectAsReference(scene, joints).device.joints.impulses[0], 1);
}

// A joint with iterations of its own gets them, beyond the world's or fewer; contacts get the world's.
TEST_F(SolveVelocitiesTest, JointIterationsSmall) {
  for (const int own : {1, 3, 10, 25}) {
    std::mt19937 random(6);
    ContactScene scene = randomContacts(random, {10, 12});
    JointScene joints = randomJoints(random, std::vector<bool>(3, true), 4);
    for (Joint& j : joints.joints) j.iterations = own;
    scene.settings.iterations = 5;
    expectAsReference(scene, joints);
  }
}

TEST_F(SolveVelocitiesTest, JointsWithContacts) {
  std::mt19937 random(7);
  for (const uint bits : {0u, 3u, 7u, 31u}) {
    SCOPED_TRACE(bits);
    ContactScene scene = randomContacts(random, {150, 200});
    setVariant(scene, bits);
    std::vector<bool> moves;
    for (uint i = 0; i < scene.builder.bodyCount(); ++i) {
      moves.push_back(scene.builder.mass(i).inverseInertiaLocal.w != 0);
    }
    const JointScene joints = randomJoints(random, moves, 130);
    expectAsReference(scene, joints, {0, 5, 77});
  }
}

// Several blocks of several colours, lanes without a joint, joints of different numbers of rows side by side.
TEST_F(SolveVelocitiesTest, JointsSideBySideSmall) {
  std::mt19937 random(17);
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  for (uint i = 0; i < 60; ++i) {
    const uint body = scene.builder.add(shape, uniform3(random, -9, 9), 1);
    scene.builder.velocity(body) = {uniform3(random, -3, 3), uniform3(random, -3, 3)};
  }
  const JointScene joints = randomJoints(random, std::vector<bool>(60, true), 50);
  expectAsReference(scene, joints, {3, 20});
}

// Limits and motors come into play and leave it: from step to step joints have other numbers of rows, or none.
TEST_F(SolveVelocitiesTest, JointRowsComeAndGo) {
  std::mt19937 random(18);
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  for (uint i = 0; i < 40; ++i) {
    const uint body = scene.builder.add(shape, uniform3(random, -9, 9), 1);
    scene.builder.velocity(body) = {uniform3(random, -3, 3), uniform3(random, -3, 3)};
  }
  const auto bench = benchForContacts(queue(), scene);
  WorldInput input = scene.builder.finish();
  for (auto* changed : {&input.infos.changed, &input.born}) changed->clear();
  for (const uint most : {2u, 6u, 0u, 1u, 6u}) {
    SCOPED_TRACE(most);
    JointScene joints;
    for (uint i = 0; i + 1 < 40; ++i) {
      joints.add(i, i + 1);
      for (uint r = most > 0 ? random() % (most + 1) : 0; r > 0; --r) joints.addRandomRow(random);
    }
    bench->run<PrepareContacts>();
    const WorldInput withJoints = joints.addTo(input);  // read until the queue has come so far
    bench->world().upload(queue(), withJoints);
    queue().finish();
    bench->run<PrepareJoints>();
    bench->write(bench->world().jointSolved, std::vector<uint>(joints.joints.size(), 1));
    const SolveReference before = read(*bench, scene);
    bench->run<SolveVelocities>(scene.settings, scene.torsionRows);
    Contract contract("70_solve_velocities");
    checkSolvedVelocities(contract, bench->params(), scene.settings.iterations, readSlots(*bench),
                          bench->read(bench->world().solverMasses, bench->world().bodyCount), before,
                          read(*bench, scene));
    EXPECT_TRUE(contract.ok()) << contract.text();
  }
}

// A hub with 70 joints: what finds no colour is solved one after the other.
TEST_F(SolveVelocitiesTest, JointHubSerial) {
  std::mt19937 random(8);
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  scene.builder.add(shape, {}, 16);
  JointScene joints;
  for (uint i = 1; i <= 70; ++i) {
    scene.builder.velocity(scene.builder.add(shape, uniform3(random, -3, 3), 1)).linear = uniform3(random, -3, 3);
    joints.add(0, i);
    for (int r = 0; r < 3; ++r) joints.addRandomRow(random);
  }
  expectAsReference(scene, joints);
}

// A joint of a body with itself: both halves act on the one body.
TEST_F(SolveVelocitiesTest, JointWithItselfSmall) {
  ContactScene scene;
  scene.builder.add(scene.builder.sphere(1), {}, 2);
  scene.builder.velocity(0) = {{1, 2, 3, 0}, {0, 1, 0, 0}};
  JointScene joints;
  joints.add(0, 0);
  joints.addRow({1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0.5f, 0, 0}, {0, 0, 1, 0}).linearA.w = 1;
  joints.addRow({0, 1, 0, 0}, {0, 1, 0, 0}, {0.5f, 0, 0, 0}, {1, 0, 0, 0}).linearA.w = 1;
  expectAsReference(scene, joints);
}

// A hub with more contacts than there are colours: the rest is solved one after the other.
TEST_F(SolveVelocitiesTest, SerialBatch) {
  std::mt19937 random(3);
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  const uint hub = scene.builder.add(shape, {}, 16);
  for (uint i = 0; i < 90; ++i) {
    const uint other = scene.builder.add(shape, uniform3(random, -3, 3), 1);
    scene.builder.velocity(other).linear = uniform3(random, -3, 3);
    const float4 normal = rotate(randomTurn(random), {0, 1, 0, 0});
    scene.addPoint(scene.addManifold(hub, other), normal, -0.01f, normal * -0.5f, normal * 0.5f);
  }
  const auto bench = benchForContacts(queue(), scene);
  ASSERT_EQ(bench->counters().serialCount, 90u - COLOUR_LIMIT);
  expectAsReference(scene);
}

// Which colours get a launch of their own is a question of speed, and so is whether groups that wait for each other go
// through all of them in one: the result is the same, bit by bit. The largest colours have more constraints than a work
// group of the GPU shape has lanes. (On the CPU shape the members of the team may do other parts in each run.)
TEST_F(SolveVelocitiesTest, LaunchesDoNotMatter) {
  std::mt19937 random(9);
  for (const uint bits : {0u, 13u, 31u}) {
    ContactScene scene = randomContacts(random, {900, 2400});
    setVariant(scene, bits);
    const auto solved = [&](uint launches, uint groups) {
      const auto bench = benchForContacts(queue(), scene);
      bench->run<PrepareContacts>();
      StepCounters counters = bench->counters();
      counters.largeColours = bench->world().capacities.colourLaunches = launches;
      bench->setCounters(counters);
      bench->world().capacities.residentGroups = groups;
      bench->run<SolveVelocities>(scene.settings, scene.torsionRows);
      EXPECT_GT(counters.colourCount, 5u);
      const auto first = bench->read(bench->world().slotFirst);
      EXPECT_GT(first[1] - first[0], 256u);
      EXPECT_EQ(bench->read(bench->world().solverTeam), std::vector<uint>(TEAM_SIZE, 0));
      // A device that can't run several groups at once says so.
      EXPECT_EQ(bench->counters().overflow & ~(groups > 1 ? OVERFLOW_ABSENT : 0u), 0u);
      const bool absent = bench->counters().overflow;
      return absent ? SolveReference() : read(*bench, scene);
    };
    const SolveReference expected = solved(0, 0);
    for (const uint launches : {0u, 1u, 5u, uint{COLOUR_LIMIT}}) {
      for (const uint groups : {0u, 1u, 2u}) {
        const SolveReference actual = solved(launches, groups);
        if (!actual.bodies.empty()) expectSame(actual, expected);
      }
    }
  }
}

// Groups that can't all run at once: nothing happens, and the host is told. (16,000 do not fit any device.)
TEST_F(SolveVelocitiesTest, AbsentGroupsAreReported) {
  if (device().shape() != KernelShape::Gpu) return;  // the CPU shape has teams, which wait for nobody
  std::mt19937 random(11);
  const ContactScene scene = randomContacts(random, {30, 60});
  const auto bench = benchForContacts(queue(), scene);
  bench->run<PrepareContacts>();
  const SolveReference before = read(*bench, scene);
  bench->world().capacities.residentGroups = 16000;
  bench->run<SolveVelocities>(scene.settings, scene.torsionRows);
  EXPECT_EQ(bench->counters().overflow, OVERFLOW_ABSENT);
  expectSame(read(*bench, scene), before);
  EXPECT_EQ(bench->read(bench->world().solverTeam), std::vector<uint>(TEAM_SIZE, 0));
}

// ---- convergence

// A heap of spheres on a grid, each pressed upon its lower neighbours by gravity. Without friction and bounce
// the solver minimises a convex energy over impulses >= 0, one impulse after the other.
ContactScene heap(std::mt19937& random) {
  constexpr int kSide = 5;
  ContactScene scene;
  scene.settings.warmStarting = scene.settings.splitImpulse = false;
  const int shape = scene.builder.sphere(0.5f);
  const auto indexOf = [](int x, int y, int z) { return static_cast<uint>((y * kSide + z) * kSide + x); };
  for (int y = 0; y < kSide; ++y) {
    for (int z = 0; z < kSide; ++z) {
      for (int x = 0; x < kSide; ++x) {
        const float4 at = {static_cast<float>(x), static_cast<float>(y) + 0.5f, static_cast<float>(z), 0};
        const uint body = scene.builder.add(shape, at, uniform(random, 0.5f, 2));
        scene.builder.forces(body).force = {0, -10 / scene.builder.mass(body).inverseInertiaLocal.w, 0, 0};
        scene.builder.velocity(body).linear = uniform3(random, -0.2f, 0.2f);
      }
    }
  }
  const uint ground = scene.builder.add(shape, {0, -10, 0, 0}, 0);
  const auto touch = [&](uint a, uint b, float4 normal) {
    ContactPoint& p = scene.addPoint(scene.addManifold(a, b), normal, 0, normal * -0.5f, normal * 0.5f);
    p.combined = {0, 0, 0, 0};
  };
  for (int y = 0; y < kSide; ++y) {
    for (int z = 0; z < kSide; ++z) {
      for (int x = 0; x < kSide; ++x) {
        const uint body = indexOf(x, y, z);
        touch(body, y == 0 ? ground : indexOf(x, y - 1, z), {0, 1, 0, 0});
        if (x > 0) touch(body, indexOf(x - 1, y, z), {1, 0, 0, 0});
        if (z > 0) touch(body, indexOf(x, y, z - 1), {0, 0, 1, 0});
      }
    }
  }
  return scene;
}

// How far the impulses are from solving the rows: by what velocity they would still be corrected.
double residualOf(const std::vector<SlotHeader>& slots, const SolveReference& state) {
  double sum = 0;
  for (size_t slot = 0; slot < slots.size(); ++slot) {
    if (slots[slot].manifold == NO_INDEX) continue;
    const auto at = [&](size_t f) { return state.rows[rowIndex(slot, SLOT_FIELDS, f)]; };
    const float4 n = {at(ROW_NORMAL), at(ROW_NORMAL + 1), at(ROW_NORMAL + 2), 0};
    const auto linear = [&](uint body) { return body == NO_INDEX ? float4{} : state.bodies[body].deltaLinear; };
    // The contacts are central: no spin comes in.
    const double velocity = dot3(n, linear(slots[slot].bodyA)) - dot3(n, linear(slots[slot].bodyB));
    const double jac = at(ROW_NORMAL_JAC), impulse = at(ROW_NORMAL_IMPULSE);
    const double wanted = std::max(0.0, impulse + at(ROW_NORMAL_RHS) - velocity * jac);
    sum += (wanted - impulse) * (wanted - impulse) / (jac * jac);
  }
  return std::sqrt(sum);
}

TEST_F(SolveVelocitiesTest, ResidualFalls) {
  std::mt19937 random(5);
  ContactScene scene = heap(random);
  double last = std::numeric_limits<double>::infinity();
  std::vector<double> residuals;
  for (const int iterations : {0, 1, 3, 10, 30, 100, 300}) {
    scene.settings.iterations = iterations;
    const Solved s = expectAsReference(scene);
    residuals.push_back(residualOf(s.slots, s.device));
    EXPECT_LT(residuals.back(), last) << "after " << iterations;
    last = residuals.back();
  }
  // The slowest mode of a stack of n bodies loses about (pi / 2n)^2 a sweep, so 300 sweeps over five layers
  // leave nothing but rounding: some hundred contacts with velocities of about 1.
  EXPECT_LT(residuals.back(), 1e-5 * residuals.front());
}

// ---- Bullet

// Single manifolds, where the order of the rows is Bullet's: stages 65, 70 and 80 against solveGroup.
class SolveAsBullet : public SolveVelocitiesTest {
 protected:
  struct Result {
    SolveReference solved;
    std::vector<BodyPose> poses;
    std::vector<BodyVelocity> velocities;
  };

  static ContactScene oneManifold(std::mt19937& random, uint bits) {
    ContactScene scene = randomContacts(random, {2, 1});
    setVariant(scene, bits);
    scene.torsionRows = true;  // Bullet has no setting for it
    // Without cached directions Bullet leaves the motion of a contact out, and so does who hands contacts to the
    // device.
    for (ContactPoint& p : scene.manifolds[0].points) {
      if (!scene.settings.frictionDirectionCaching) p.flags &= ~POINT_MOTION;
    }
    // Asleep, so that stage 80 writes the solver's result but moves nothing on; Bullet's solver does not
    // care.
    for (uint i = 0; i < 2; ++i) scene.builder.activation(i).state = STATE_SLEEPING;
    return scene;
  }

  Result device(const ContactScene& scene) {
    const auto bench = benchForContacts(queue(), scene);
    DeviceWorld& world = bench->world();
    bench->run<PrepareContacts>();
    bench->run<SolveVelocities>(scene.settings, scene.torsionRows);
    Result r;
    r.solved = read(*bench, scene);
    bench->write(world.stepActivations, scene.builder.finish().activations.values);
    bench->write(world.solved, std::vector<uint>(world.bodyCount, 1));
    bench->run<IntegratePoses>();
    r.poses = bench->read(world.poses, world.bodyCount);
    r.velocities = bench->read(world.velocities, world.bodyCount);
    return r;
  }

  // Differences to Bullet, as velocities; what Bullet moves by push velocities is compared as pose.
  static void compare(const ContactScene& scene, const Result& result, BulletContacts& bullet, Difference& error) {
    const WorldInput in = scene.builder.finish();
    for (uint i = 0; i < in.bodyCount; ++i) {
      const btRigidBody* body = bullet.rigid(i);
      if (!body || (in.infos.values[i].flags & BODY_STATIC)) continue;
      const btVector3 &v = body->getLinearVelocity(), &w = body->getAngularVelocity();
      const btVector3& p = body->getWorldTransform().getOrigin();
      const btQuaternion q = body->getWorldTransform().getRotation();
      const BodyPose& pose = result.poses[i];
      error.take(error.linear, result.velocities[i].linear - float4{v.x(), v.y(), v.z(), 0});
      error.take(error.angular, result.velocities[i].angular - float4{w.x(), w.y(), w.z(), 0});
      error.take(error.push, (pose.position - float4{p.x(), p.y(), p.z(), 0}) / scene.settings.timeStep);
      // The vector part of the rotation from one to the other is half its angle.
      const float4 turn = quaternionProduct(pose.orientation, {-q.x(), -q.y(), -q.z(), q.w()});
      error.take(error.turn, turn * (2 / (scene.settings.timeStep * scene.settings.splitImpulseTurnErp)));
    }
    for (int k = 0; k < scene.manifolds[0].pointCount; ++k) {
      const btManifoldPoint& cp = bullet.point(0, k);
      const ContactPoint& p = result.solved.manifolds[0].points[k];
      error.takeImpulse(p.localPointB.w - cp.m_appliedImpulse);
      error.takeImpulse(p.normalWorldOnB.w - cp.m_appliedImpulseLateral1);
      error.takeImpulse(p.lateralFrictionDir1.w - cp.m_appliedImpulseLateral2);
    }
  }

  // Each of the rows, at most six for each of four points, is off by some 40 roundings of the velocities that
  // go into it (see the test of stage 65), and is solved in every sweep.
  static constexpr double kTolerance = 6 * 4 * 40 * kRounding;

  void expectAsBullet(unsigned seed, int cases, uint variants) {
    std::mt19937 random(seed);
    for (uint bits = 0; bits < variants; ++bits) {
      SCOPED_TRACE(bits);
      for (int i = 0; i < cases; ++i) {
        const ContactScene scene = oneManifold(random, bits);
        const Result result = device(scene);
        BulletContacts bullet(scene);
        bullet.setup();
        bullet.solve();
        Difference error;
        compare(scene, result, bullet, error);
        expectSmall(error, sizeOf(result.solved), scene.settings);
        if (HasFailure()) return;
      }
    }
  }

  static void expectSmall(const Difference& error, const Difference& size, const StepSettings& settings) {
    const double speed = 6;  // before the step: three in each component
    const double relative = settings.iterations * kTolerance;
    EXPECT_LE(error.linear, relative * (speed + size.linear));
    EXPECT_LE(error.angular, relative * (speed + size.angular));
    EXPECT_LE(error.impulse, relative * (2 + size.impulse));
    // Poses are compared as velocities, but can't be told apart nearer than some roundings of a position of
    // seven and of a unit quaternion.
    const double pose = 8 * kRounding / settings.timeStep;
    EXPECT_LE(error.push, relative * size.push + 7 * pose);
    EXPECT_LE(error.turn, relative * size.turn + 2 * pose / settings.splitImpulseTurnErp);
  }
};

TEST_F(SolveAsBullet, SingleManifoldSmall) { expectAsBullet(1, 2, 2); }
TEST_F(SolveAsBullet, SingleManifold) { expectAsBullet(2, 20, 16); }

}  // namespace
}  // namespace btgpu
