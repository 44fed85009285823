// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/10_apply_forces.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <functional>
#include <limits>

#include "gpu_engine/stages/10_apply_forces_reference.h"
#include "tests/support/bullet_convert.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

// As the contract (10_apply_forces_reference.cpp), for what is compared with Bullet itself.
constexpr float kPowTolerance = 16 * 1.2e-7f;
constexpr float kGyroTolerance = 8 * 2 * 1.2e-7f;

float sizeOf(float4 v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

void expectNear(float4 actual, float4 expected, float tolerance, const char* what, size_t i) {
  EXPECT_LE(sizeOf(actual - expected), tolerance)
      << what << " of body " << i << ": (" << actual.x << ", " << actual.y << ", " << actual.z << ") instead of ("
      << expected.x << ", " << expected.y << ", " << expected.z << ")";
  EXPECT_FLOAT_EQ(actual.w, expected.w) << "w of " << what << " of body " << i;
}

class ApplyForcesTest : public DeviceTest {
 protected:
  static std::vector<BodyStep> reference(const WorldInput& in, const StepParams& params) {
    return applyForcesReference(params, in.infos.values, in.poses.values, in.velocities.values, in.forces.values,
                                in.masses.values, in.dampings.values);
  }

  std::vector<BodyStep> device(const WorldInput& in, const StepSettings& settings = {}) {
    constexpr size_t kSpare = 3;
    Capacities room;
    room.bodies = in.bodyCount + kSpare;
    StageBench bench(queue(), in, settings, room);
    bench.poison(bench.world().steps);
    bench.run<ApplyForces>();
    auto steps = bench.read(bench.world().steps, in.bodyCount + kSpare);
    for (size_t k = in.bodyCount; k < steps.size(); ++k)
      EXPECT_TRUE(StageBench::isPoison(steps[k])) << "written at " << k;
    steps.resize(in.bodyCount);
    return steps;
  }

  void expectAsReference(const WorldInput& in, const StepSettings& settings = {}) {
    const auto steps = device(in, settings);
    const StepParams params = makeStepParams(settings, false);
    Contract contract("10_apply_forces");
    checkAppliedForces(contract, params, in.masses.values, steps, reference(in, params));
    EXPECT_TRUE(contract.ok()) << contract.text();
  }
};

// A brick that spins and is pushed, so that nothing in its record is zero.
uint addSpinningBrick(WorldBuilder& b, float4 position, float mass = 2) {
  const uint i = b.add(b.box({0.3f, 0.6f, 1.1f, 0}), position, mass, turnAbout({1, 2, 3, 0}, 0.7f));
  b.velocity(i) = {{1, -2, 3, 0}, {4, 5, -6, 0}};
  b.forces(i) = {{10, 20, -30, 0}, {3, -2, 1, 0}};
  return i;
}

// Random forces, damping and flags for every body of a random world.
void addRandomMotion(std::mt19937& random, WorldBuilder& b) {
  for (uint i = 0; i < b.bodyCount(); ++i) {
    b.forces(i) = {uniform3(random, -20, 20), uniform3(random, -5, 5)};
    if (random() % 2) b.damping(i).linear = uniform(random, 0, 1);
    if (random() % 2) b.damping(i).angular = uniform(random, 0, 1);
    if (!(b.info(i).flags & BODY_RIGID)) continue;
    b.info(i).flags |=
        random() & (BODY_ADDITIONAL_DAMPING | BODY_GYRO_EXPLICIT | BODY_GYRO_IMPLICIT_WORLD | BODY_GYRO_IMPLICIT_BODY);
  }
}

TEST_F(ApplyForcesTest, KindsOfBodiesSmall) {
  WorldBuilder b;
  const uint dynamic = addSpinningBrick(b, {1, 2, 3, 0});
  const uint fixed = addSpinningBrick(b, {4, 0, 0, 0}, 0);
  const uint kinematic = addSpinningBrick(b, {5, 0, 0, 0}, 0);
  b.info(kinematic).flags = BODY_PRESENT | BODY_RIGID | BODY_KINEMATIC;
  const uint heavyKinematic = addSpinningBrick(b, {6, 0, 0, 0});
  b.info(heavyKinematic).flags = BODY_PRESENT | BODY_RIGID | BODY_KINEMATIC | BODY_INTEGRATED;
  const uint object = b.addObject(b.sphere(1), {7, 0, 0, 0});
  b.velocity(object) = {{1, 1, 1, 0}, {1, 1, 1, 0}};
  const uint notIntegrated = addSpinningBrick(b, {8, 0, 0, 0});
  b.info(notIntegrated).flags &= ~BODY_INTEGRATED;
  const uint free = b.addFree();
  for (uint i = 0; i < b.bodyCount(); ++i) b.damping(i).linear = b.damping(i).angular = 0.5f;
  const WorldInput in = b.finish();
  expectAsReference(in);

  const auto steps = device(in);
  EXPECT_EQ(steps[dynamic].angularVelocity.w, 1);
  EXPECT_EQ(steps[dynamic].linearVelocity.w, 0.5f);
  EXPECT_LT(sizeOf(steps[dynamic].linearVelocity), sizeOf(in.velocities.values[dynamic].linear));
  for (const uint i : {fixed, object, free}) {
    EXPECT_TRUE(sameBits(steps[i].linearVelocity, float4{})) << i;
    EXPECT_TRUE(sameBits(steps[i].angularVelocity, float4{})) << i;
    EXPECT_TRUE(sameBits(steps[i].predictedPosition, in.poses.values[i].position)) << i;
  }
  for (const uint i : {fixed, object, free, kinematic}) {
    EXPECT_EQ(steps[i].angularVelocity.w, 0) << i;
    EXPECT_EQ(steps[i].linearVelocity.w, 0) << i;
    for (const float4 v : {steps[i].externalLinear, steps[i].externalAngular, steps[i].inverseInertia0,
                           steps[i].inverseInertia1, steps[i].inverseInertia2}) {
      EXPECT_TRUE(sameBits(v, float4{})) << i;
    }
  }
  // Kinematic bodies keep their velocity, undamped; one that was left with mass is moved by the solver as
  // well.
  for (const uint i : {kinematic, heavyKinematic, notIntegrated}) {
    EXPECT_EQ(sizeOf(steps[i].linearVelocity), sizeOf(in.velocities.values[i].linear)) << i;
    EXPECT_EQ(sizeOf(steps[i].angularVelocity), sizeOf(in.velocities.values[i].angular)) << i;
  }
  EXPECT_EQ(steps[heavyKinematic].angularVelocity.w, 1);
  EXPECT_EQ(steps[heavyKinematic].linearVelocity.w, 0.5f);
}

TEST_F(ApplyForcesTest, QuarantinedBodiesSpreadNothingSmall) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  WorldBuilder b;
  for (int k = 0; k < 4; ++k) addSpinningBrick(b, {static_cast<float>(k), 0, 0, 0});
  for (const uint i : {0u, 1u, 2u}) b.info(i).flags |= BODY_QUARANTINED | BODY_GYRO_EXPLICIT;
  b.velocity(0).linear.x = nan;
  b.velocity(1).angular.y = infinite;
  b.forces(2).torque.z = nan;
  const WorldInput in = b.finish();
  const auto steps = device(in);
  for (const uint i : {0u, 1u, 2u}) {
    EXPECT_TRUE(sameBits(steps[i].linearVelocity, float4{})) << i;
    EXPECT_TRUE(sameBits(steps[i].angularVelocity, float4{})) << i;
    EXPECT_TRUE(sameBits(steps[i].externalLinear, float4{})) << i;
    EXPECT_TRUE(sameBits(steps[i].externalAngular, float4{})) << i;
  }
  expectAsReference(in);
}

TEST_F(ApplyForcesTest, InertiaWithoutMassSmall) {
  // setMassProps(0, inertia) on a kinematic body: it turns in the solver, and the gyroscopic flags are not
  // looked at.
  WorldBuilder b;
  const uint i = addSpinningBrick(b, {});
  b.info(i).flags = BODY_PRESENT | BODY_RIGID | BODY_KINEMATIC | BODY_GYRO_IMPLICIT_BODY;
  b.mass(i).inverseInertiaLocal.w = 0;
  const WorldInput in = b.finish();
  expectAsReference(in);
  const auto steps = device(in);
  EXPECT_EQ(steps[i].angularVelocity.w, 1);
  EXPECT_EQ(steps[i].linearVelocity.w, 0);
  EXPECT_EQ(sizeOf(steps[i].externalLinear), 0);
  EXPECT_GT(sizeOf(steps[i].externalAngular), 0);
}

TEST_F(ApplyForcesTest, GyroscopicFlagsSmall) {
  WorldBuilder b;
  const uint flags[] = {0, BODY_GYRO_EXPLICIT, BODY_GYRO_IMPLICIT_WORLD, BODY_GYRO_IMPLICIT_BODY,
                        BODY_GYRO_EXPLICIT | BODY_GYRO_IMPLICIT_WORLD | BODY_GYRO_IMPLICIT_BODY};
  for (const uint f : flags) {
    const uint i = addSpinningBrick(b, {});
    b.info(i).flags |= f;
    b.forces(i) = {};
  }
  const WorldInput in = b.finish();
  expectAsReference(in);
  auto steps = device(in);
  EXPECT_TRUE(sameBits(steps[0].externalAngular, float4{}));
  // The two implicit forms solve the same equation in different axes.
  const float scale = sizeOf(steps[2].angularVelocity);
  EXPECT_GT(sizeOf(steps[2].externalAngular), 0.05f * scale);
  expectNear(steps[2].externalAngular, steps[3].externalAngular, 2 * kGyroTolerance * scale, "implicit", 2);

  // The explicit torque is limited; a limit of half its size halves the change.
  StepSettings limited;
  limited.maxGyroscopicForce = 1;
  const auto limitedSteps = device(in, limited);
  limited.maxGyroscopicForce = 0.5f;
  const auto halfSteps = device(in, limited);
  expectNear(halfSteps[1].externalAngular * 2, limitedSteps[1].externalAngular, kGyroTolerance * scale, "limited", 1);
  EXPECT_LT(sizeOf(limitedSteps[1].externalAngular), 0.5f * sizeOf(steps[1].externalAngular));
  for (float limit = 1; limit < 100; limit *= 1.3f) {
    limited.maxGyroscopicForce = limit;
    expectAsReference(in, limited);
  }
}

TEST_F(ApplyForcesTest, AdditionalDampingSmall) {
  struct Case {
    float linear, angular;  // speeds
    float linearDamping, angularDamping;
  };
  // Above and below the thresholds (0.1, 0.2), and above, within and below the brake's range.
  const Case cases[] = {{1, 1, 0.2f, 0.2f},         {0.05f, 1, 0.2f, 0.2f},      {0.05f, 0.05f, 0.2f, 0.2f},
                        {0.15f, 0.15f, 0.3f, 0.3f}, {0.003f, 0.15f, 0.3f, 0.1f}, {0.15f, 0.003f, 0.1f, 0.3f},
                        {0, 0, 0.5f, 0.5f},         {0.09f, 0.09f, 0, 0},        {2, 3, 1, 1},
                        {0.09f, 0.15f, 0, 0},       {0.09f, 0.25f, 0, 0},        {0.11f, 0.09f, 0, 0}};
  WorldBuilder b;
  for (const Case& c : cases) {
    const uint i = b.add(b.sphere(1), {});
    b.info(i).flags |= BODY_ADDITIONAL_DAMPING;
    b.velocity(i) = {{0, c.linear, 0, 0}, {0, 0, c.angular, 0}};
    b.damping(i).additionalAngularThresholdSqr = 0.04f;
    b.damping(i).linear = c.linearDamping;
    b.damping(i).angular = c.angularDamping;
  }
  const WorldInput in = b.finish();
  expectAsReference(in);
  const auto steps = device(in);
  EXPECT_GT(sizeOf(steps[3].linearVelocity), 0.1f);  // braked by 0.005
  EXPECT_EQ(sizeOf(steps[4].linearVelocity), 0);     // stopped
  EXPECT_EQ(sizeOf(steps[5].angularVelocity), 0);
  EXPECT_NEAR(sizeOf(steps[7].linearVelocity), 0.09f * 0.005f, 1e-9f);  // the factor alone
  EXPECT_EQ(sizeOf(steps[8].linearVelocity), 0);                        // pow(0, timeStep)
}

TEST_F(ApplyForcesTest, FactorsAreInTheForcesAlreadySmall) {
  // BodyForces come with the factors applied, and the velocity is not masked by them.
  WorldBuilder b;
  const uint plain = addSpinningBrick(b, {}), masked = addSpinningBrick(b, {});
  b.mass(masked).linearFactor = {0, 1, 0, 0};
  b.mass(masked).angularFactor = {1, 0, 0, 0};
  const auto steps = device(b.finish());
  EXPECT_TRUE(sameBits(steps[plain], steps[masked]));
}

TEST_F(ApplyForcesTest, SpinFromNoneToBeyondTheLimitSmall) {
  WorldBuilder b;
  for (const float rate : {0.0f, 1e-5f, 3e-4f, 4e-4f, 9e-4f, 1.1e-3f, 0.5f, 20.0f, 47.0f, 47.2f, 100.0f, 1e4f}) {
    const uint i = b.add(b.sphere(1), {}, 1, turnAbout({1, 1, 0, 0}, 1));
    b.velocity(i).angular = {0.6f * rate, 0, -0.8f * rate, 0};
  }
  expectAsReference(b.finish());
  StepSettings slow;
  slow.timeStep = 100;  // the slowest ones turn by an angle worth a sine's second term
  expectAsReference(b.finish(), slow);
}

TEST_F(ApplyForcesTest, RandomSmall) {
  std::mt19937 random(1);
  WorldBuilder b;
  RandomWorld what;
  what.bodies = 40;
  b.addRandom(random, what);
  addRandomMotion(random, b);
  expectAsReference(b.finish());
}

TEST_F(ApplyForcesTest, RandomOfAllCounts) {
  std::mt19937 random(2);
  for (const uint count : {0u, 1u, 31u, 32u, 33u, 127u, 128u, 129u, 1000u}) {
    WorldBuilder b;
    RandomWorld what;
    what.bodies = count;
    what.planes = 0;
    b.addRandom(random, what);
    addRandomMotion(random, b);
    StepSettings settings;
    settings.timeStep = count % 2 ? 1.0f / 240 : 1.0f / 60;
    SCOPED_TRACE(count);
    expectAsReference(b.finish(), settings);
  }
}

// The reference itself against Bullet: damping, prediction and gyroscopic terms of a btRigidBody.
TEST(ApplyForcesReference, AgreesWithBullet) {
  std::mt19937 random(3);
  WorldBuilder b;
  RandomWorld what;
  what.bodies = 200;
  what.staticShare = what.kinematicShare = what.freeShare = 0;
  what.planes = 0;
  b.addRandom(random, what);
  addRandomMotion(random, b);
  const WorldInput in = b.finish();
  const StepParams params = makeStepParams({}, false);
  const auto steps = applyForcesReference(params, in.infos.values, in.poses.values, in.velocities.values,
                                          in.forces.values, in.masses.values, in.dampings.values);
  const auto distance = [](float4 a, const btVector3& e) { return (toBullet(a) - e).length(); };
  btSphereShape shape(1);
  for (uint i = 0; i < in.bodyCount; ++i) {
    const float4 inverse = in.masses.values[i].inverseInertiaLocal;
    btRigidBody::btRigidBodyConstructionInfo info(1 / inverse.w, nullptr, &shape,
                                                  {1 / inverse.x, 1 / inverse.y, 1 / inverse.z});
    info.m_startWorldTransform = toBullet(in.poses.values[i]);
    info.m_linearDamping = in.dampings.values[i].linear;
    info.m_angularDamping = in.dampings.values[i].angular;
    info.m_additionalDamping = in.infos.values[i].flags & BODY_ADDITIONAL_DAMPING;
    btRigidBody body(info);
    body.setLinearVelocity(toBullet(in.velocities.values[i].linear));
    body.setAngularVelocity(toBullet(in.velocities.values[i].angular));
    body.applyDamping(params.timeStep);
    btTransform predicted;
    body.predictIntegratedTransform(params.timeStep, predicted);
    btVector3 torqueImpulse = toBullet(in.forces.values[i].torque) * body.getInvInertiaTensorWorld() * params.timeStep;
    const uint flags = in.infos.values[i].flags;
    if (flags & BODY_GYRO_EXPLICIT) {
      torqueImpulse -= body.computeGyroscopicForceExplicit(params.maxGyroscopicForce) *
                       body.getInvInertiaTensorWorld() * params.timeStep;
    }
    if (flags & BODY_GYRO_IMPLICIT_WORLD) torqueImpulse += body.computeGyroscopicImpulseImplicit_World(params.timeStep);
    if (flags & BODY_GYRO_IMPLICIT_BODY) torqueImpulse += body.computeGyroscopicImpulseImplicit_Body(params.timeStep);

    const btScalar linear = body.getLinearVelocity().length(), angular = body.getAngularVelocity().length();
    EXPECT_LE(distance(steps[i].linearVelocity, body.getLinearVelocity()), kPowTolerance * linear) << i;
    EXPECT_LE(distance(steps[i].angularVelocity, body.getAngularVelocity()), kPowTolerance * angular) << i;
    EXPECT_LE(distance(steps[i].externalAngular, torqueImpulse), kGyroTolerance * (angular + torqueImpulse.length()))
        << i;
    EXPECT_LE(distance(steps[i].predictedPosition, predicted.getOrigin()), 4e-6f) << i;
    const btMatrix3x3 turn(btQuaternion(steps[i].predictedOrientation.x, steps[i].predictedOrientation.y,
                                        steps[i].predictedOrientation.z, steps[i].predictedOrientation.w));
    for (int row = 0; row < 3; ++row) EXPECT_LE((turn[row] - predicted.getBasis()[row]).length(), 4e-6f) << i;
  }
}

}  // namespace
}  // namespace btgpu
