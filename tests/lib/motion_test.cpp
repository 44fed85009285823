// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kernels/lib/motion.h"

#include <functional>
#include <memory>

#include "tests/lib/bullet_values.h"

namespace btgpu {
namespace {

constexpr float kTimeStep = 1.0f / 60.0f;

// A rigid body of mass 2 with the given damping.
std::unique_ptr<btRigidBody> makeBody(const BodyDamping& d, bool additional, const float4& inertia) {
  btRigidBody::btRigidBodyConstructionInfo info(2.0f, nullptr, nullptr, toBullet(inertia));
  info.m_linearDamping = d.linear;
  info.m_angularDamping = d.angular;
  info.m_additionalDamping = additional;
  info.m_additionalDampingFactor = d.additionalFactor;
  info.m_additionalLinearDampingThresholdSqr = d.additionalLinearThresholdSqr;
  info.m_additionalAngularDampingThresholdSqr = d.additionalAngularThresholdSqr;
  return std::make_unique<btRigidBody>(info);
}

BodyDamping defaultDamping(float linear, float angular) {
  BodyDamping d{};
  d.linear = linear;
  d.angular = angular;
  d.additionalFactor = 0.005f;  // Bullet's defaults (btRigidBodyConstructionInfo)
  d.additionalLinearThresholdSqr = 0.01f;
  d.additionalAngularThresholdSqr = 0.01f;
  return d;
}

// The velocities after damping, against btRigidBody::applyDamping. Both sides do the same operations, but the
// compiler of the library may have contracted or reordered them: a few roundings of the speed.
void expectDampedAsStock(const BodyDamping& d, bool additional, float4 linear, float4 angular, float timeStep) {
  auto body = makeBody(d, additional, F4(1, 1, 1, 0));
  body->setLinearVelocity(toBullet(linear));
  body->setAngularVelocity(toBullet(angular));
  body->applyDamping(timeStep);
  const double linearTolerance = 6 * kRounding * length(toDouble(linear));
  const double angularTolerance = 6 * kRounding * length(toDouble(angular));
  DampingFactor linearFactor{0, 1}, angularFactor{0, 1};
  applyDamping(d, additional ? BODY_ADDITIONAL_DAMPING : 0u, timeStep, &linearFactor, &angularFactor, &linear,
               &angular);
  expectNear(linear, body->getLinearVelocity(), linearTolerance);
  expectNear(angular, body->getAngularVelocity(), angularTolerance);
}

TEST(Motion, Damping) {
  Random random(1);
  for (int n = 0; n < 3000; ++n) {
    const BodyDamping d = defaultDamping(random.uniform(0, 1), random.uniform(0, 1));
    expectDampedAsStock(d, false, random.vector(10), random.vector(10), random.magnitude(-3, 0));
  }
  expectDampedAsStock(defaultDamping(0, 0), false, F4(1, 2, 3, 0), F4(4, 5, 6, 0), kTimeStep);
  expectDampedAsStock(defaultDamping(1, 1), false, F4(1, 2, 3, 0), F4(4, 5, 6, 0), kTimeStep);
}

// Speeds around all thresholds: 0.1 (both below: the factor acts), the damping itself (the brake acts below),
// 0.005 (the brake stops the body).
TEST(Motion, AdditionalDamping) {
  Random random(2);
  for (int n = 0; n < 3000; ++n) {
    const BodyDamping d = defaultDamping(random.uniform(0, 0.5f), random.uniform(0, 0.5f));
    const float4 linear = random.direction() * random.magnitude(-4, 1);
    const float4 angular = random.direction() * random.magnitude(-4, 1);
    expectDampedAsStock(d, true, linear, angular, kTimeStep);
  }
}

// Bodies one after the other, in turn of the same and of other damping than the one before.
TEST(Motion, DampingFactorsAreThoseOfTheBody) {
  DampingFactor linearFactor{0, 1}, angularFactor{0, 1};
  const float dampings[] = {0.5f, 0.5f, 0, 0.25f, 0, 0, 0.25f, 1, 0.5f};
  for (size_t i = 0; i + 1 < std::size(dampings); ++i) {
    const BodyDamping d = defaultDamping(dampings[i], dampings[i + 1]);
    DampingFactor own{0, 1}, ownAngular{0, 1};
    float4 linear = F4(1, 2, 3, 0), angular = F4(4, 5, 6, 0), linearAlone = linear, angularAlone = angular;
    applyDamping(d, 0, kTimeStep, &linearFactor, &angularFactor, &linear, &angular);
    applyDamping(d, 0, kTimeStep, &own, &ownAngular, &linearAlone, &angularAlone);
    EXPECT_EQ(linear.x, linearAlone.x) << i;
    EXPECT_EQ(angular.x, angularAlone.x) << i;
  }
}

TEST(Motion, AdditionalDampingNeedsTheFlag) {
  const BodyDamping d = defaultDamping(0.5f, 0.5f);
  float4 linear = F4(0.001f, 0, 0, 0), angular = linear;
  DampingFactor linearFactor{0, 1}, angularFactor{0, 1};
  applyDamping(d, ~BODY_ADDITIONAL_DAMPING, kTimeStep, &linearFactor, &angularFactor, &linear, &angular);
  EXPECT_GT(linear.x, 0.0009f);
  applyDamping(d, BODY_ADDITIONAL_DAMPING, kTimeStep, &linearFactor, &angularFactor, &linear, &angular);
  EXPECT_EQ(linear.x, 0);
  EXPECT_EQ(angular.x, 0);
}

TEST(Motion, Brake) {
  expectNear(brake(F4(3, 4, 0, 0), 5), Double3{3, 4, 0}, 0);  // at the limit: not below it
  expectNear(brake(F4(3, 4, 0, 0), 5.001f), Double3{3 - 0.003, 4 - 0.004, 0}, 4 * kRounding * 4);
  expectNear(brake(F4(0, 0, 0.005f, 0), 1), Double3{0, 0, 0}, 0);
  expectNear(brake(F4(0, 0, 0.00501f, 0), 1), Double3{0, 0, 0.00001}, 4 * kRounding * 0.005);
  expectNear(brake(F4(0, 0, 0, 0), 1), Double3{0, 0, 0}, 0);
  expectNear(brake(F4(0, 0, 0, 0), 0), Double3{0, 0, 0}, 0);
}

// Bullet goes from the quaternion to the matrix, back, to the next quaternion and to its matrix. Each element
// of a matrix collects up to 20 roundings of values up to 2 on the way from quaternion to matrix (10), back
// (5), through the product and normalisation (10) and to the matrix again (10).
constexpr double kRotationTolerance = 35 * 2 * kRounding;

void expectIntegratedAsStock(const BodyPose& pose, float4 linear, float4 angular, float timeStep) {
  btTransform stock;
  btTransformUtil::integrateTransform(toBullet(pose), toBullet(linear), toBullet(angular), timeStep, stock);
  const BodyPose next = integratePose(pose, linear, angular, timeStep);
  expectNear(next.position, stock.getOrigin(), kRounding * (length(toDouble(pose.position)) + 1));
  EXPECT_EQ(next.position.w, 0);
  const float4 q = next.orientation;
  EXPECT_NEAR(std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w), 1, 4 * kRounding);
  const Matrix3 m = matrixFromQuaternion(q);
  expectNear(m.row0, stock.getBasis()[0], kRotationTolerance);
  expectNear(m.row1, stock.getBasis()[1], kRotationTolerance);
  expectNear(m.row2, stock.getBasis()[2], kRotationTolerance);
}

TEST(Motion, IntegratePose) {
  Random random(3);
  for (int n = 0; n < 5000; ++n) {
    expectIntegratedAsStock(random.pose(20), random.vector(20), random.direction() * random.magnitude(-6, 1.5f),
                            kTimeStep);
  }
}

TEST(Motion, IntegratePoseAtRest) {
  Random random(4);
  const BodyPose pose = random.pose(20);
  expectIntegratedAsStock(pose, F4(0, 0, 0, 0), F4(0, 0, 0, 0), kTimeStep);
  expectIntegratedAsStock(pose, F4(1, 0, 0, 0), F4(0, 0, 0, 0), 0.0f);
  const BodyPose same = integratePose(pose, F4(0, 0, 0, 0), F4(0, 0, 0, 0), kTimeStep);
  expectNear(same.position, toDouble(pose.position), 0);
  expectNear(same.orientation, toDouble(pose.orientation), 4 * kRounding);
}

// Around the rates where the formula changes: 0.001 rad per unit of time (series instead of the sine),
// sqrt(epsilon) (taken for no rotation), and pi / 4 a step (the clamp).
TEST(Motion, IntegratePoseAroundTheLimits) {
  Random random(5);
  const float clampRate = 0.78539816f / kTimeStep;
  for (const float rate : {3.4e-4f, 3.5e-4f, 0.00099f, 0.00101f, 0.999f * clampRate, 1.001f * clampRate, 2 * clampRate,
                           10 * clampRate, 1000 * clampRate}) {
    for (int n = 0; n < 200; ++n) {
      expectIntegratedAsStock(random.pose(1), random.vector(1), random.direction() * rate, kTimeStep);
    }
  }
}

// The series shows only where the rate is small and the step long: on either side of the rate where it ends.
TEST(Motion, IntegratePoseOverALongStep) {
  Random random(13);
  for (const float rate : {0.0005f, 0.00099f, 0.00101f}) {
    for (const float timeStep : {300.0f, 750.0f}) {
      for (int n = 0; n < 100; ++n) {
        expectIntegratedAsStock(random.pose(1), F4(0, 0, 0, 0), random.direction() * rate, timeStep);
      }
    }
  }
}

// Below the clamp the rotation is the exponential map: the exact turn by |w| dt about w.
TEST(Motion, IntegratePoseIsTheExponentialMap) {
  Random random(6);
  for (int n = 0; n < 2000; ++n) {
    const BodyPose pose = random.pose(1);
    const float4 axis = random.direction();
    const float rate = random.uniform(0.01f, 47.0f);  // 47 / 60 < pi / 4
    const BodyPose next = integratePose(pose, F4(0, 0, 0, 0), axis * rate, kTimeStep);
    const double half = 0.5 * length(toDouble(axis * rate)) * kTimeStep;
    const Double3 s = toDouble(axis) * (std::sin(half) / length(toDouble(axis)));
    const float4 turn = F4(float(s.x), float(s.y), float(s.z), float(std::cos(half)));
    const Double3 probe = {1, 2, 3};
    expectNear(turned(next.orientation, probe), turned(turn, turned(pose.orientation, probe)),
               length(probe) * kRotationTolerance);
  }
}

// Faster than pi / 4 a step the half angle's sine and cosine stay those of the clamp, while the axis keeps
// its full length, as in Bullet: (w / |w|) sin grows by the excess before it is normalised.
TEST(Motion, SpinIsClamped) {
  const BodyPose pose = {F4(0, 0, 0, 0), F4(0, 0, 0, 1)};
  const double clampRate = MAX_ROTATION_PER_STEP / kTimeStep;
  for (const double excess : {1.0, 1.5, 4.0, 100.0}) {
    const float4 w = F4(0, 0, float(clampRate * excess), 0);
    const float4 q = integratePose(pose, F4(0, 0, 0, 0), w, kTimeStep).orientation;
    const double half = std::atan2(excess * std::sin(MAX_ROTATION_PER_STEP / 2), std::cos(MAX_ROTATION_PER_STEP / 2));
    EXPECT_NEAR(q.z, std::sin(half), 10 * kRounding) << excess;
    EXPECT_NEAR(q.w, std::cos(half), 10 * kRounding) << excess;
  }
}

// A quaternion that came to nothing is not normalised.
TEST(Motion, DegenerateOrientationIsKept) {
  const BodyPose pose = {F4(0, 0, 0, 0), F4(0, 0, 0, 0)};
  const BodyPose next = integratePose(pose, F4(1, 0, 0, 0), F4(1, 0, 0, 0), kTimeStep);
  EXPECT_TRUE(isFinite4(next.orientation));
}

struct Spinning {
  std::unique_ptr<btRigidBody> body;
  BodyPose pose;
  float4 inertia, inverseInertia, w;

  Matrix3 rotation() const { return matrixFromQuaternion(pose.orientation); }
  // Of Bullet's own matrices, so that only the formula under test differs.
  Matrix3 inverseInertiaWorld() const { return worldTensor(rotation(), inverseInertia); }
};

Spinning spin(const BodyPose& pose, float4 inertia, float4 w) {
  Spinning s;
  s.body = makeBody(defaultDamping(0, 0), false, inertia);
  s.body->setCenterOfMassTransform(toBullet(pose));
  s.body->setAngularVelocity(toBullet(w));
  s.pose = pose;
  s.inertia = inertia;
  s.inverseInertia = F4(1 / inertia.x, 1 / inertia.y, 1 / inertia.z, 0.5f);
  s.w = w;
  return s;
}

// Principal moments that a body of mass 2 can have, within a factor of about 10 of each other.
float4 randomInertia(Random& random) {
  const float4 parts = F4(random.uniform(0.1f, 1), random.uniform(0.1f, 1), random.uniform(0.1f, 1), 0);
  const float scale = random.magnitude(-1, 2);
  return F4(parts.y + parts.z, parts.x + parts.z, parts.x + parts.y, 0) * scale;
}

double ratio(float4 inertia) {
  return std::fmax(std::fmax(inertia.x, inertia.y), inertia.z) / std::fmin(std::fmin(inertia.x, inertia.y), inertia.z);
}

constexpr float kNoLimit = 1e18f;

float4 change(const Spinning& s, uint flags, float limit) {
  return gyroscopicChange(flags, s.rotation(), s.inverseInertia, s.inverseInertiaWorld(), s.w, kTimeStep, limit);
}

// The change comes from a few products of matrices, each good to about 10 roundings of the largest moment;
// what that is in the result grows with the ratio of the moments. Its own size is at most ratio |w|^2 dt.
double explicitTolerance(const Spinning& s) {
  const double w = length(toDouble(s.w));
  return 60 * kRounding * ratio(s.inertia) * ratio(s.inertia) * w * w * kTimeStep;
}

TEST(Gyroscopic, Explicit) {
  Random random(7);
  for (int n = 0; n < 2000; ++n) {
    const Spinning s = spin(random.pose(5), randomInertia(random), random.vector(20));
    for (const float limit : {kNoLimit, 1.0f}) {
      // btSequentialImpulseConstraintSolver::convertBodies: force times inverse inertia times the step,
      // subtracted.
      const btVector3 torque = s.body->computeGyroscopicForceExplicit(limit);
      const btVector3 stock = -(s.body->getInvInertiaTensorWorld() * torque * kTimeStep);
      expectNear(change(s, BODY_GYRO_EXPLICIT, limit), stock, explicitTolerance(s));
      const float4 own = gyroscopicTorqueExplicit(s.rotation(), s.inertia, s.w, limit);
      const double w = length(toDouble(s.w)), moment = std::fmax(s.inertia.x, std::fmax(s.inertia.y, s.inertia.z));
      expectNear(own, torque, 40 * kRounding * moment * w * w);
      EXPECT_LE(length3(own), limit * (1 + 1e-6f));
    }
  }
}

// Bullet's implicit variants solve a 3x3 system whose condition is about ratio * (1 + |w| dt); the right-hand
// side is good to 20 roundings of its parts. The body variant rotates the whole velocity to and fro besides
// and takes the difference: 30 roundings of |w| (by the matrix of a quaternion that Bullet first finds from
// the matrix).
double implicitTolerance(const Spinning& s) {
  const double w = length(toDouble(s.w)), r = ratio(s.inertia);
  return kRounding * (30 * w + 60 * r * r * (1 + w * kTimeStep) * w * w * kTimeStep);
}

TEST(Gyroscopic, ImplicitWorld) {
  Random random(8);
  for (int n = 0; n < 2000; ++n) {
    const Spinning s = spin(random.pose(5), randomInertia(random), random.vector(20));
    expectNear(change(s, BODY_GYRO_IMPLICIT_WORLD, kNoLimit), s.body->computeGyroscopicImpulseImplicit_World(kTimeStep),
               implicitTolerance(s));
  }
}

TEST(Gyroscopic, ImplicitBody) {
  Random random(9);
  for (int n = 0; n < 2000; ++n) {
    const Spinning s = spin(random.pose(5), randomInertia(random), random.vector(20));
    expectNear(change(s, BODY_GYRO_IMPLICIT_BODY, kNoLimit), s.body->computeGyroscopicImpulseImplicit_Body(kTimeStep),
               implicitTolerance(s));
  }
}

// The tolerance above must be far below what is tested, else the tests prove nothing.
TEST(Gyroscopic, ToleranceIsSmall) {
  Random random(8);
  int meaningful = 0;
  for (int n = 0; n < 500; ++n) {
    const Spinning s = spin(random.pose(5), randomInertia(random), random.vector(20));
    meaningful += length3(change(s, BODY_GYRO_IMPLICIT_BODY, kNoLimit)) > 100 * implicitTolerance(s);
  }
  EXPECT_GT(meaningful, 450);
}

// The flags add up, as they do in convertBodies; without a flag nothing changes.
TEST(Gyroscopic, FlagsAddUp) {
  Random random(10);
  const Spinning s = spin(random.pose(5), F4(1, 2, 2.5f, 0), random.vector(10));
  expectNear(change(s, 0, kNoLimit), Double3{0, 0, 0}, 0);
  expectNear(change(s, ~(BODY_GYRO_EXPLICIT | BODY_GYRO_IMPLICIT_WORLD | BODY_GYRO_IMPLICIT_BODY), kNoLimit),
             Double3{0, 0, 0}, 0);
  const float4 sum = change(s, BODY_GYRO_EXPLICIT, kNoLimit) + change(s, BODY_GYRO_IMPLICIT_WORLD, kNoLimit) +
                     change(s, BODY_GYRO_IMPLICIT_BODY, kNoLimit);
  const float4 all = change(s, BODY_GYRO_EXPLICIT | BODY_GYRO_IMPLICIT_WORLD | BODY_GYRO_IMPLICIT_BODY, kNoLimit);
  expectNear(all, toDouble(sum), 6 * kRounding * 10);
}

// A sphere has no gyroscopic term; one of the moments may be infinite (inverse zero, moment taken as zero).
TEST(Gyroscopic, SpecialInertias) {
  Random random(11);
  const Spinning ball = spin(random.pose(5), F4(2, 2, 2, 0), random.vector(10));
  for (const uint flag : {BODY_GYRO_EXPLICIT, BODY_GYRO_IMPLICIT_WORLD, BODY_GYRO_IMPLICIT_BODY}) {
    expectNear(change(ball, flag, kNoLimit), Double3{0, 0, 0}, implicitTolerance(ball));
  }
  expectNear(inverseOrZero(F4(0, 2, -4, 7)), Double3{0, 0.5, -0.25}, 0);
}

// Moments so small that their product is below epsilon: Bullet's solve33 multiplies by the determinant
// instead of its inverse, which makes nothing of the term; here it is nothing exactly.
TEST(Gyroscopic, TinyInertia) {
  Random random(12);
  const Spinning s = spin(random.pose(5), F4(1e-3f, 2e-3f, 2.5e-3f, 0), random.vector(10));
  const btVector3 stock = s.body->computeGyroscopicImpulseImplicit_World(kTimeStep);
  expectNear(change(s, BODY_GYRO_IMPLICIT_WORLD, kNoLimit), stock, 1e-12);
}

// btCollisionObject::isActive for each state.
TEST(BodyFlags, ActiveStates) {
  auto body = makeBody(defaultDamping(0, 0), false, F4(1, 1, 1, 0));
  for (const int state : {STATE_ACTIVE, STATE_SLEEPING, STATE_WANTS_DEACTIVATION, STATE_DISABLE_DEACTIVATION,
                          STATE_DISABLE_SIMULATION, STATE_FIXED_BASE}) {
    body->forceActivationState(state);
    EXPECT_EQ(isActiveState(state) != 0, body->isActive()) << state;
  }
  EXPECT_EQ(STATE_ACTIVE, ACTIVE_TAG);
  EXPECT_EQ(STATE_SLEEPING, ISLAND_SLEEPING);
  EXPECT_EQ(STATE_WANTS_DEACTIVATION, WANTS_DEACTIVATION);
  EXPECT_EQ(STATE_DISABLE_DEACTIVATION, DISABLE_DEACTIVATION);
  EXPECT_EQ(STATE_DISABLE_SIMULATION, DISABLE_SIMULATION);
  EXPECT_EQ(STATE_FIXED_BASE, FIXED_BASE_MULTI_BODY);
}

// btSequentialImpulseConstraintSolver::getOrInitSolverBody: rigid bodies with mass and kinematic ones.
TEST(BodyFlags, SolverBodies) {
  EXPECT_TRUE(solverHasVelocity(BODY_RIGID, 1));
  EXPECT_FALSE(solverHasVelocity(BODY_RIGID, 0));
  EXPECT_TRUE(solverHasVelocity(BODY_RIGID | BODY_KINEMATIC, 0));
  EXPECT_FALSE(solverHasVelocity(BODY_KINEMATIC, 0)) << "a plain collision object";
  EXPECT_FALSE(solverHasVelocity(BODY_STATIC, 1));
  EXPECT_FALSE(solverHasVelocity(BODY_RIGID | BODY_QUARANTINED, 1));
  EXPECT_TRUE(solverMoves(BODY_RIGID, F4(0, 0, 0, 1)));
  EXPECT_TRUE(solverMoves(BODY_RIGID | BODY_KINEMATIC, F4(0, 1, 0, 0)));
  EXPECT_FALSE(solverMoves(BODY_RIGID | BODY_KINEMATIC, F4(0, 0, 0, 0)));
  EXPECT_FALSE(solverMoves(BODY_RIGID, F4(1, 1, 1, 0)));
  EXPECT_TRUE(isStaticOrKinematic(BODY_STATIC));
  EXPECT_TRUE(isStaticOrKinematic(BODY_KINEMATIC | BODY_RIGID));
  EXPECT_FALSE(isStaticOrKinematic(BODY_RIGID | BODY_INTEGRATED));
}

}  // namespace
}  // namespace btgpu
