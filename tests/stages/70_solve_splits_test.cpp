// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stages 67 and 70 of the solver with split masses.
#include "gpu_engine/stages/70_solve_splits.h"

#include <algorithm>
#include <cmath>

#include "gpu_engine/stages/52_prepare_joints.h"
#include "gpu_engine/stages/60_split_bodies.h"
#include "gpu_engine/stages/65_prepare_contacts.h"
#include "gpu_engine/stages/67_split_masses.h"
#include "gpu_engine/stages/67_split_masses_reference.h"
#include "gpu_engine/stages/70_solve_velocities.h"
#include "gpu_engine/stages/70_solve_velocities_reference.h"
#include "kernels/lib/vec.h"
#include "tests/support/contact_scene.h"
#include "tests/support/device_test.h"
#include "tests/support/joint_scene.h"

namespace btgpu {
namespace {

constexpr double kRounding = 1.0 / 16777216;

class SolveSplitsTest : public DeviceTest {
 protected:
  struct Solved {
    std::vector<SolverBody> bodies;  // whole ones
    std::vector<Manifold> manifolds;
    std::vector<float> jointImpulses;
    std::vector<SolverMass> masses;  // of whole bodies
  };

  void addJoints(StageBench& bench, const ContactScene& scene, const JointScene& joints,
                 const std::vector<uint>& asleep) {
    if (joints.joints.empty()) return;
    WorldInput input = scene.builder.finish();
    for (auto* changed : {&input.infos.changed, &input.born}) changed->clear();
    input = joints.addTo(input);
    bench.world().upload(queue(), input);
    queue().finish();
    bench.run<PrepareJoints>();
    std::vector<uint> solved(joints.joints.size(), 1);
    for (const uint j : asleep) solved[j] = 0;
    bench.write(bench.world().jointSolved, solved);
  }

  SplitMassesState readSplit(StageBench& bench, size_t copies) {
    DeviceWorld& w = bench.world();
    return {bench.read(w.rows),
            bench.read(w.tangent2),
            bench.read(w.torsion),
            bench.read(w.jointEffects),
            bench.read(w.split.jointRows),
            bench.read(w.split.copies, std::min(copies, w.split.copies.size())),
            bench.read(w.split.copyMasses, std::min(copies, w.split.copyMasses.size()))};
  }
  SolveReference readSolve(StageBench& bench, const ContactScene& scene, const std::vector<uint>& copyFirst) {
    DeviceWorld& w = bench.world();
    return {bench.read(w.split.copies, copyFirst.back()),
            bench.read(w.rows),
            bench.read(w.tangent2),
            bench.read(w.torsion),
            bench.read(w.manifolds, scene.manifolds.size()),
            {bench.read(w.split.joints), bench.read(w.split.jointRows), bench.read(w.jointEffects),
             bench.read(w.jointSolved), w.jointColours.order, bench.read(w.jointImpulses)},
            copyFirst};
  }

  // Runs both stages and holds each against its reference.
  Solved solve(const ContactScene& scene, const JointScene& joints = {}, const std::vector<uint>& asleep = {}) {
    const auto bench = benchForContacts(queue(), scene);
    DeviceWorld& w = bench->world();
    addJoints(*bench, scene, joints, asleep);
    writeConstraints(*bench, scene, scene.manifolds.size() + BTGPU_LANES);
    bench->run<SplitBodies>();
    bench->run<PrepareContacts>();
    const std::vector<uint> copyFirst = bench->read(w.split.copyFirst, w.bodyCount + 1);
    const WorldInput input = scene.builder.finish();
    const SplitMassesInput in{bench->params(),
                              readSlots(*bench),
                              copyFirst,
                              bench->read(w.manifolds, scene.manifolds.size()),
                              bench->read(w.steps, w.bodyCount),
                              input.masses.values,
                              bench->read(w.solverMasses, w.bodyCount),
                              joints.joints,
                              bench->read(w.split.joints),
                              joints.rows};
    const SplitMassesState whole = readSplit(*bench, 0);
    bench->run<SplitMasses>();
    Contract masses("67_split_masses");
    checkSplitMasses(masses, in, whole, readSplit(*bench, copyFirst.back()), splitMassesReference(in, whole));
    EXPECT_TRUE(masses.ok()) << masses.text();

    const SolveReference before = readSolve(*bench, scene, copyFirst);
    bench->run<SolveSplits>(scene.settings, scene.torsionRows);
    const SolveReference device = readSolve(*bench, scene, copyFirst);
    Contract solved("70_solve_splits");
    checkSolvedVelocities(solved, in.params, scene.settings.iterations, in.slots,
                          bench->read(w.split.copyMasses, copyFirst.back()), before, device);
    EXPECT_TRUE(solved.ok()) << solved.text();
    const Solved s{bench->read(w.solverBodies, w.bodyCount), device.manifolds, device.joints.impulses, in.solverMasses};
    for (size_t i = 0; i < s.bodies.size(); ++i) {
      const SolverBody expected = copyFirst[i] < copyFirst[i + 1] ? device.bodies[copyFirst[i]] : SolverBody{};
      EXPECT_TRUE(sameBits(s.bodies[i], expected)) << "body " << i;
    }
    return s;
  }

  // The solver over colours, with so many iterations.
  std::vector<SolverBody> gaussSeidel(ContactScene scene, int iterations) {
    scene.settings.iterations = iterations;
    const auto bench = benchForContacts(queue(), scene);
    bench->run<PrepareContacts>();
    bench->run<SolveVelocities>(scene.settings, scene.torsionRows);
    return bench->read(bench->world().solverBodies, bench->world().bodyCount);
  }
};

void setVariant(ContactScene& scene, uint bits) {
  scene.settings.warmStarting = bits & 1;
  scene.settings.splitImpulse = bits & 2;
  scene.settings.interleaveContactAndFriction = bits & 4;
  scene.settings.twoFrictionDirections = bits & 8;
  scene.torsionRows = bits & 16;
}
constexpr uint kVariants = 32;

std::vector<bool> movingBodies(ContactScene& scene) {
  std::vector<bool> moves;
  for (uint i = 0; i < scene.builder.bodyCount(); ++i) {
    moves.push_back(scene.builder.mass(i).inverseInertiaLocal.w != 0);
  }
  return moves;
}

TEST_F(SolveSplitsTest, RandomSmall) {
  std::mt19937 random(1);
  for (const uint bits : {9u, 31u}) {
    ContactScene scene = randomContacts(random, {12, 14});
    setVariant(scene, bits);
    scene.settings.iterations = 2;
    solve(scene, randomJoints(random, movingBodies(scene), 4));
  }
}

TEST_F(SolveSplitsTest, Random) {
  std::mt19937 random(2);
  for (uint bits = 0; bits < kVariants; ++bits) {
    SCOPED_TRACE(bits);
    ContactScene scene = randomContacts(random, {150, 200});
    setVariant(scene, bits);
    for (const int iterations : {0, 1, 10}) {
      scene.settings.iterations = iterations;
      solve(scene);
      if (HasFailure()) return;
    }
  }
}

TEST_F(SolveSplitsTest, JointsWithContacts) {
  std::mt19937 random(7);
  for (const uint bits : {0u, 3u, 7u, 31u}) {
    SCOPED_TRACE(bits);
    ContactScene scene = randomContacts(random, {150, 200});
    setVariant(scene, bits);
    scene.settings.iterations = 5;
    solve(scene, randomJoints(random, movingBodies(scene), 130), {0, 5, 77});
  }
}

// One constraint a body: nothing is split, and Jacobi is Gauss-Seidel. A sphere of 2 mass units at 3 downwards.
TEST_F(SolveSplitsTest, SingleContactSmall) {
  ContactScene scene;
  const int shape = scene.builder.sphere(1);
  scene.builder.add(shape, {0, 1, 0, 0}, 2);
  scene.builder.add(shape, {0, -1, 0, 0}, 0);
  scene.builder.velocity(0).linear = {0, -3, 0, 0};
  scene.addPoint(scene.addManifold(0, 1), {0, 1, 0, 0}, 0, {0, -1, 0, 0}, {0, 1, 0, 0});
  const Solved s = solve(scene);
  EXPECT_FLOAT_EQ(s.bodies[0].deltaLinear.y, 3);
  EXPECT_FLOAT_EQ(s.manifolds[0].points[0].localPointB.w, 6);
}

// By hand: a ball of mass 1 between two that stand still, without friction, one iteration. Its two copies weigh 1/2
// each. At the left, where it comes with 1, the copy and the ball of mass 1 there share 1 by their masses: the impulse
// is 1 / (2 + 1), the copy loses 2/3, of which the ball gets half.
TEST_F(SolveSplitsTest, HalvesSmall) {
  ContactScene scene;
  scene.settings.iterations = 1;
  const int shape = scene.builder.sphere(0.5f);
  for (int i = 0; i < 3; ++i) scene.builder.add(shape, {float(i), 0, 0, 0}, 1);
  scene.builder.velocity(1).linear = {-1, 0, 0, 0};
  for (uint i = 0; i < 2; ++i) {
    scene.addPoint(scene.addManifold(i, i + 1), {-1, 0, 0, 0}, 0, {0.5f, 0, 0, 0}, {-0.5f, 0, 0, 0}).combined.x = 0;
  }
  const Solved s = solve(scene);
  EXPECT_NEAR(s.manifolds[0].points[0].localPointB.w, 1.0f / 3, 4 * kRounding);
  EXPECT_NEAR(s.bodies[0].deltaLinear.x, -1.0f / 3, 4 * kRounding);
  EXPECT_NEAR(s.bodies[1].deltaLinear.x, 1.0f / 3, 4 * kRounding);
  EXPECT_EQ(s.bodies[2].deltaLinear.x, 0);
}

// A hub with hundreds of contacts has no need of a serial batch.
ContactScene starOf(std::mt19937& random, uint arms) {
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  const uint hub = scene.builder.add(shape, {}, 16);
  for (uint i = 0; i < arms; ++i) {
    const uint other = scene.builder.add(shape, uniform3(random, -3, 3), 1);
    scene.builder.velocity(other).linear = uniform3(random, -3, 3);
    const float4 normal = rotate(randomTurn(random), {0, 1, 0, 0});
    scene.addPoint(scene.addManifold(hub, other), normal, -0.01f, normal * -0.5f, normal * 0.5f);
  }
  return scene;
}

TEST_F(SolveSplitsTest, Hundreds) {
  std::mt19937 random(3);
  solve(starOf(random, 400));
}

// What is left of impulses that are equal and opposite: the roundings of the sums.
TEST_F(SolveSplitsTest, MomentumIsConserved) {
  std::mt19937 random(4);
  ContactScene scene = starOf(random, 150);
  for (uint i = 1; i < 100; ++i) {
    const float4 normal = rotate(randomTurn(random), {0, 1, 0, 0});
    scene.addPoint(scene.addManifold(i, i + 1 + random() % 20), normal, -0.01f, normal * -0.5f, normal * 0.5f);
  }
  scene.settings.iterations = 30;
  const Solved s = solve(scene);
  double sum[3] = {}, size = 0;
  for (size_t i = 0; i < s.bodies.size(); ++i) {
    const double mass = 1 / double(s.masses[i].row0.w);
    const float4 v = s.bodies[i].deltaLinear;
    sum[0] += mass * v.x;
    sum[1] += mass * v.y;
    sum[2] += mass * v.z;
    size += mass * double(length3(v));
  }
  ASSERT_GT(size, 10);
  // Each of 30 iterations rounds the hub's sum of 150 copies and each row's change: about 150 roundings of the largest.
  for (const double s3 : sum) EXPECT_LT(std::fabs(s3), 30 * 150 * kRounding * size);
}

// A column of balls on the ground: without friction there is one solution, which both solvers come to. A chain of n has
// the condition number (2 n / pi)^2; Jacobi needs 2 n^2 times that for each digit, with two copies a body.
TEST_F(SolveSplitsTest, ConvergesToGaussSeidel) {
  constexpr uint kBalls = 6;
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  scene.builder.add(shape, {0, -0.5f, 0, 0}, 0);
  for (uint i = 1; i <= kBalls; ++i) {
    scene.builder.add(shape, {0, float(i) - 0.5f, 0, 0}, i % 2 ? 1.0f : 4.0f);
    scene.builder.velocity(i).linear = {0, i % 3 ? -1.0f : -3.0f, 0, 0};
    scene.addPoint(scene.addManifold(i, i - 1), {0, 1, 0, 0}, 0, {0, -0.5f, 0, 0}, {0, 0.5f, 0, 0}).combined.x = 0;
  }
  scene.settings.warmStarting = scene.settings.splitImpulse = false;
  scene.settings.iterations = 2000;
  const Solved jacobi = solve(scene);
  const std::vector<SolverBody> exact = gaussSeidel(scene, 2000), ten = gaussSeidel(scene, 10);
  scene.settings.iterations = 10;
  const Solved tenOfJacobi = solve(scene);
  const auto distance = [&](const std::vector<SolverBody>& bodies) {
    double most = 0;
    for (uint i = 0; i <= kBalls; ++i) {
      most = std::max(most, double(length3(bodies[i].deltaLinear - exact[i].deltaLinear)));
    }
    return most;
  };
  // A fixed point is off by the rounding of a row, of velocities up to 4, times the condition number.
  EXPECT_LT(distance(jacobi.bodies), 4 * kRounding * 4 * std::pow(2 * kBalls / 3.14, 2));
  EXPECT_GT(distance(tenOfJacobi.bodies), distance(ten)) << "the paper's finding";
}

TEST_F(SolveSplitsTest, SameBitsTwice) {
  std::mt19937 random(5);
  ContactScene scene = randomContacts(random, {500, 1500});
  setVariant(scene, 31);
  const Solved first = solve(scene), second = solve(scene);
  for (size_t i = 0; i < first.bodies.size(); ++i) ASSERT_TRUE(sameBits(first.bodies[i], second.bodies[i])) << i;
  for (size_t m = 0; m < first.manifolds.size(); ++m) {
    ASSERT_TRUE(sameBits(first.manifolds[m], second.manifolds[m])) << m;
  }
}

}  // namespace
}  // namespace btgpu
