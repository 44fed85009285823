// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stages 65 and 70 of the fast mode, each against its reference; BTGPU_SHAPE_CPU goes through the vector code, the
// other shape through the scalar one.
#include "gpu_engine/stages/70_solve_substeps.h"

#include "gpu_engine/stages/52_prepare_joints.h"
#include "gpu_engine/stages/65_prepare_soft_contacts.h"
#include "gpu_engine/stages/65_prepare_soft_contacts_reference.h"
#include "gpu_engine/stages/70_solve_substeps_reference.h"
#include "kernels/lib/vec.h"
#include "tests/support/contact_scene.h"
#include "tests/support/device_test.h"
#include "tests/support/joint_scene.h"

namespace btgpu {
namespace {

class SolveSubstepsTest : public DeviceTest {
 protected:
  struct Solved {
    PrepareSoftReference prepared;
    SubstepReference device;
  };

  static PrepareSoftReference readPrepared(StageBench& bench, const ContactScene& scene) {
    DeviceWorld& w = bench.world();
    PrepareSoftReference r;
    r.solverBodies = bench.read(w.solverBodies, w.bodyCount);
    r.solverMasses = bench.read(w.solverMasses, w.bodyCount);
    r.starts = bench.read(w.substepStarts, w.bodyCount);
    r.manifolds = bench.read(w.manifolds, scene.manifolds.size());
    r.rows = bench.read(w.softRows);
    r.rolls = bench.read(w.rolls);
    r.bouncing = bench.counters().bouncing;
    return r;
  }
  static SubstepReference readSolved(StageBench& bench, const ContactScene& scene, const std::vector<uint>& order) {
    DeviceWorld& w = bench.world();
    return {bench.read(w.solverBodies, w.bodyCount),
            bench.read(w.softRows),
            bench.read(w.rolls),
            bench.read(w.manifolds, scene.manifolds.size()),
            {bench.read(w.joints), bench.read(w.jointRows), bench.read(w.jointEffects), bench.read(w.jointSolved),
             order, bench.read(w.lastJointImpulses), bench.read(w.jointImpulses)}};
  }

  Solved expectAsReference(ContactScene scene, const JointScene& joints = {}) {
    scene.settings.solver = Solver::Fast;
    const auto bench = benchForContacts(queue(), scene);
    DeviceWorld& w = bench->world();
    w.reserveSubsteps(queue(), scene.torsionRows);
    bench->poison(w.softRows);
    bench->poison(w.substepStarts);
    const PrepareInput in = prepareInput(*bench, scene);
    PrepareSoftReference before;
    before.manifolds = bench->read(w.manifolds, scene.manifolds.size());
    before.rows = bench->read(w.softRows);
    before.rolls = bench->read(w.rolls);
    bench->run<PrepareSoftContacts>();
    Solved s;
    s.prepared = readPrepared(*bench, scene);
    Contract prepare("65_prepare_soft_contacts");
    checkPreparedSoftContacts(prepare, in, before, s.prepared);
    EXPECT_TRUE(prepare.ok()) << prepare.text();

    if (!joints.joints.empty()) {
      WorldInput input = scene.builder.finish();
      for (auto* changed : {&input.infos.changed, &input.born}) changed->clear();
      input = joints.addTo(input);
      for (size_t r = 0; r < joints.rows.size(); ++r) input.jointImpulses.push_back(0.1f * static_cast<float>(r % 7));
      w.upload(queue(), input);
      queue().finish();
      bench->run<PrepareJoints>();
      bench->write(w.jointSolved, std::vector<uint>(joints.joints.size(), 1));
    }
    const SubstepReference start = readSolved(*bench, scene, w.jointColours.order);
    bench->run<SolveSubsteps>(scene.settings);
    s.device = readSolved(*bench, scene, w.jointColours.order);
    Contract solve("70_solve_substeps");
    checkSolvedSubsteps(solve, bench->params(), in.steps, readSlots(*bench), s.prepared.solverMasses, start, s.device);
    EXPECT_TRUE(solve.ok()) << solve.text();
    return s;
  }
};

// A unit sphere of 2 mass units on the ground.
ContactScene sphereOnGround(float4 velocity, float distance = 0) {
  ContactScene scene;
  const int shape = scene.builder.sphere(1);
  scene.builder.add(shape, {0, 1, 0, 0}, 2);
  scene.builder.add(shape, {0, -1, 0, 0}, 0);
  scene.builder.velocity(0).linear = velocity;
  scene.addPoint(scene.addManifold(0, 1), {0, 1, 0, 0}, distance, {0, -1, 0, 0}, {0, 1, 0, 0});
  return scene;
}

TEST_F(SolveSubstepsTest, StopsSmall) {
  const Solved s = expectAsReference(sphereOnGround({0, -3, 0, 0}));
  EXPECT_FLOAT_EQ(s.device.bodies[0].deltaLinear.y, 3);
  EXPECT_FLOAT_EQ(s.device.manifolds[0].points[0].localPointB.w, 6) << "the impulse of the whole step";
  // The first soft pass settles for a / (1 + a) of that, a = omega h (2 zeta + omega h): omega at a quarter of the
  // substeps' rate, which the settings' 120 Hz against fixed bodies is above. What is left moves it, for at most a
  // substep of the step's four.
  const StepSettings settings;
  const float omegaH = 2 * 3.14159265f / 4, a = omegaH * (2 * settings.contactDampingRatio + omegaH);
  EXPECT_NEAR(s.device.bodies[0].pushLinear.y, 0, 3 / (1 + a) / 4);
}

// It reaches the ground in the step, and does not go on.
TEST_F(SolveSubstepsTest, FallsOntoTheGroundSmall) {
  const float dt = 1.0f / 60.0f;
  const Solved s = expectAsReference(sphereOnGround({0, -3, 0, 0}, 0.02f));
  EXPECT_NEAR(s.device.bodies[0].pushLinear.y * dt, -0.02f, 1e-6f);
  EXPECT_NEAR(s.device.bodies[0].deltaLinear.y, 3, 1e-5f);
}

TEST_F(SolveSubstepsTest, DoesNotPullSmall) {
  const Solved s = expectAsReference(sphereOnGround({1, 3, 0, 0}));
  EXPECT_EQ(length3(s.device.bodies[0].deltaLinear), 0);
  EXPECT_EQ(s.device.manifolds[0].points[0].localPointB.w, 0);
  EXPECT_FLOAT_EQ(s.device.bodies[0].pushLinear.y, 3) << "it moves on as in parity mode";
}

// Restitution of a half, in a step without forces.
TEST_F(SolveSubstepsTest, BouncesSmall) {
  ContactScene scene = sphereOnGround({0, -3, 0, 0});
  scene.manifolds[0].points[0].combined.y = 0.5f;
  const Solved s = expectAsReference(scene);
  EXPECT_EQ(s.prepared.bouncing, 1u);
  EXPECT_NEAR(s.device.bodies[0].deltaLinear.y, 4.5f, 1e-5f);
}

void setVariant(ContactScene& scene, uint bits) {
  scene.settings.warmStarting = bits & 1;
  scene.settings.frictionDirectionCaching = bits & 2;
  scene.settings.velocityDependentFriction = !(bits & 4);
  scene.torsionRows = bits & 8;
}

TEST_F(SolveSubstepsTest, RandomSmall) {
  std::mt19937 random(1);
  for (const uint bits : {1u, 15u}) {
    ContactScene scene = randomContacts(random, {12, 14});
    setVariant(scene, bits);
    scene.settings.substeps = 2;
    expectAsReference(scene);
  }
}

TEST_F(SolveSubstepsTest, Random) {
  std::mt19937 random(2);
  for (uint bits = 0; bits < 16; ++bits) {
    for (const int substeps : {1, 4}) {
      SCOPED_TRACE(bits);
      ContactScene scene = randomContacts(random, {150, 200, bits % 3 != 0});
      setVariant(scene, bits);
      scene.settings.substeps = substeps;
      expectAsReference(scene);
    }
  }
}

TEST_F(SolveSubstepsTest, JointsSmall) {
  std::mt19937 random(3);
  JointScene joints = randomJoints(random, std::vector<bool>(10, true), 6);
  for (Joint& j : joints.joints) {
    j.equalRows = random() % 64;
    j.boundRows = ~j.equalRows & (random() % 64);
  }
  expectAsReference(randomContacts(random, {10, 12, false}), joints);
}

// Two spheres of 2 and 4 mass units that come apart with 3 and are held together by one row.
TEST_F(SolveSubstepsTest, JointHoldsSmall) {
  ContactScene scene;
  const int shape = scene.builder.sphere(1);
  scene.builder.add(shape, {}, 2);
  scene.builder.add(shape, {3, 0, 0, 0}, 4);
  scene.builder.velocity(1).linear = {3, 0, 0, 0};
  JointScene joints;
  joints.add(0, 1).equalRows = 1;
  joints.addRow({1, 0, 0, 0}, {}, {-1, 0, 0, 0}, {});
  const Solved s = expectAsReference(scene, joints);
  EXPECT_NEAR(s.device.bodies[0].deltaLinear.x, 2, 1e-5f);
  EXPECT_NEAR(s.device.bodies[1].deltaLinear.x, -1, 1e-5f);
}

// A hub with more contacts than there are colours: the rest is solved one after the other.
TEST_F(SolveSubstepsTest, SerialBatch) {
  std::mt19937 random(4);
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  const uint hub = scene.builder.add(shape, {}, 16);
  for (uint i = 0; i < 90; ++i) {
    const uint other = scene.builder.add(shape, uniform3(random, -3, 3), 1);
    scene.builder.velocity(other).linear = uniform3(random, -3, 3);
    const float4 normal = rotate(randomTurn(random), {0, 1, 0, 0});
    scene.addPoint(scene.addManifold(hub, other), normal, -0.01f, normal * -0.5f, normal * 0.5f);
  }
  expectAsReference(scene);
}

}  // namespace
}  // namespace btgpu
