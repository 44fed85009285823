// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/20_update_aabbs.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <btBulletCollisionCommon.h>

#include <limits>
#include <memory>

#include "gpu_engine/stages/20_update_aabbs_reference.h"
#include "kernels/lib/bounds.h"
#include "tests/support/bullet_convert.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

// As the contract (20_update_aabbs_reference.cpp), for what is compared with Bullet itself.
constexpr float kTolerance = 1e-6f;

struct Stage20Input {
  WorldInput world;
  std::vector<BodyStep> steps;
  std::vector<Aabb> oldAabbs;
};

const Aabb kNone = {{1, 1, 1, 0}, {-1, -1, -1, 0}};  // as DeviceWorld marks bodies without an old AABB

class UpdateAabbsTest : public DeviceTest {
 protected:
  static Stage20Input inputOf(const WorldBuilder& b) {
    Stage20Input in{b.finish(), {}, {}};
    for (const BodyPose& p : in.world.poses.values) {
      BodyStep s{};
      s.predictedPosition = p.position;
      s.predictedOrientation = p.orientation;
      in.steps.push_back(s);
    }
    in.oldAabbs.assign(in.world.bodyCount, kNone);
    return in;
  }

  static UpdatedAabbs reference(const Stage20Input& in, const StepSettings& settings) {
    return updateAabbsReference(makeStepParams(settings, false), in.world.infos.values, in.world.shapes.values,
                                in.world.hulls.vertices, in.world.poses.values, in.steps, in.world.activations.values,
                                in.oldAabbs, in.world.hostAabbs);
  }

  UpdatedAabbs device(const Stage20Input& in, const StepSettings& settings) {
    constexpr size_t kSpare = 3;
    const size_t n = in.world.bodyCount;
    Capacities room;
    room.bodies = n + kSpare;
    StageBench bench(queue(), in.world, settings, room);
    DeviceWorld& w = bench.world();
    bench.write(w.steps, in.steps);
    bench.write(w.oldAabbs, in.oldAabbs);
    bench.poison(w.aabbs);
    bench.poison(w.stepActivations);
    bench.run<UpdateAabbs>();
    UpdatedAabbs out{bench.read(w.aabbs, n + kSpare), bench.read(w.stepActivations, n + kSpare),
                     bench.counters().outOfBounds};
    for (size_t k = n; k < n + kSpare; ++k) {
      EXPECT_TRUE(StageBench::isPoison(out.aabbs[k]) && StageBench::isPoison(out.activations[k])) << "written at " << k;
    }
    out.aabbs.resize(n);
    out.activations.resize(n);
    // A step may be repeated, so what it started from must be untouched.
    EXPECT_TRUE(n == 0 || std::memcmp(bench.read(w.oldAabbs, n).data(), in.oldAabbs.data(), n * sizeof(Aabb)) == 0);
    return out;
  }

  UpdatedAabbs expectAsReference(const Stage20Input& in, const StepSettings& settings = {}) {
    const UpdatedAabbs actual = device(in, settings), expected = reference(in, settings);
    Contract contract("20_update_aabbs");
    checkUpdatedAabbs(contract, actual, expected);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return actual;
  }
};

// A shape that only the host knows comes with its AABB: taken as it is, whatever the body does. Others of the same
// world are as ever.
TEST_F(UpdateAabbsTest, HostShapesBringTheirAabbSmall) {
  WorldBuilder b;
  const int ball = b.sphere(1), foreign = b.sphere(1);
  b.shape(foreign).type = SHAPE_HOST;
  for (int i = 0; i < 6; ++i) b.add(i % 2 ? foreign : ball, {float(3 * i), 0, 0, 0}, i < 4 ? 1.0f : 0.0f);
  b.activation(3).state = STATE_SLEEPING;
  Stage20Input in = inputOf(b);
  in.world.hostAabbs.resize(6);
  for (uint i = 1; i < 6; i += 2)
    in.world.hostAabbs[i] = {{-1.0f * float(i), -2, -3, 0}, {4, 5e7f, 6.0f * float(i), 0}};
  for (const bool forceAll : {true, false}) {
    StepSettings settings;
    settings.forceUpdateAllAabbs = forceAll;
    const UpdatedAabbs actual = device(in, settings), expected = reference(in, settings);
    for (uint i = 0; i < 6; ++i) {
      EXPECT_EQ(actual.activations[i].state, in.world.activations.values[i].state);
      if (i % 2) {
        EXPECT_TRUE(sameBits(actual.aabbs[i], in.world.hostAabbs[i])) << i;
        EXPECT_TRUE(sameBits(expected.aabbs[i], in.world.hostAabbs[i])) << i;
      } else {
        EXPECT_FLOAT_EQ(actual.aabbs[i].lower.x, expected.aabbs[i].lower.x) << i;
      }
    }
  }
}

TEST_F(UpdateAabbsTest, OneOfEachShapeSmall) {
  WorldBuilder b;
  const uint ball = b.add(b.sphere(0.5f), {1, 2, 3, 0});
  const uint brick = b.add(b.box({0.5f, 1, 2, 0}), {-4, 0, 0, 0}, 1, turnAbout({0, 0, 1, 0}, 0.78539816f));
  const uint ground = b.add(b.plane({0, 1, 0, 0}, 7), {100, 200, 300, 0}, 0);
  const uint drum = b.add(b.cylinder(0, 0.5f, 1, 0.1f), {0, 0, 0, 0}, 1, turnAbout({0, 1, 0, 0}, 0.5f));
  const uint hat = b.add(b.cone(1, 0.5f, 1, 0.1f), {0, 0, 0, 0}, 1, turnAbout({0, 0, 1, 0}, 1.5707963f));
  b.add(b.cone(2, 0.5f, -1, 0.1f), {0, 0, 0, 0}, 1, turnAbout({1, 2, 3, 0}, 0.7f));
  b.add(b.spheres({{0, 0, 0, 0.5f}, {1, 2, 0, 0}}, 0.1f), {5, 0, 0, 0}, 1, turnAbout({1, 2, 3, 0}, 0.7f));
  const uint free = b.addFree();
  const auto out = expectAsReference(inputOf(b));
  EXPECT_FLOAT_EQ(out.aabbs[ball].lower.x, 0.48f);
  EXPECT_FLOAT_EQ(out.aabbs[ball].upper.z, 3.52f);
  EXPECT_FLOAT_EQ(out.aabbs[brick].upper.y, 1.5f * std::sqrt(0.5f) + 0.02f);
  EXPECT_FLOAT_EQ(out.aabbs[brick].upper.z, 2.02f);
  EXPECT_EQ(out.aabbs[ground].lower.y, -1e18f);
  EXPECT_EQ(out.aabbs[ground].upper.x, 1e18f);
  EXPECT_FLOAT_EQ(out.aabbs[drum].upper.y, 0.62f);
  EXPECT_NEAR(out.aabbs[hat].lower.x, -1.22f, 1e-6f) << "the tip, and the margin twice, as in stock";
  EXPECT_NEAR(out.aabbs[hat].upper.x, 1.22f, 1e-6f) << "the base";
  EXPECT_NEAR(out.aabbs[hat].upper.y, 0.72f, 1e-6f);
  for (const Aabb& other : out.aabbs) EXPECT_FALSE(overlapAabb(out.aabbs[free], other));
}

// Of scaled shapes Bullet bounds what they are, not the box around them.
TEST_F(UpdateAabbsTest, FarthestPointsSmall) {
  WorldBuilder b;
  const float4 turn = turnAbout({0, 0, 1, 0}, 0.78539816f);
  const uint drum = b.add(b.scaled(b.cylinder(1, 0.5f, 1, 0.1f)), {0, 0, 0, 0}, 1, turn);
  const uint rod = b.add(b.scaled(b.hull({{-1, 0, 0, 0}, {1, 0, 0, 0}}, 0.1f)), {0, 0, 0, 0}, 1, turn);
  const uint pearls = b.add(b.scaled(b.spheres({{-1, 0, 0, 0.5f}, {2, 0, 0, 0}}, 0.1f)), {0, 0, 0, 0}, 1, turn);
  b.add(b.scaled(b.spheres({{0, 1, 0, 0.5f}, {1, 2, 0, 0}}, 0.1f, {1, 2, 3, 0})), {5, 0, 0, 0}, 1,
        turnAbout({1, 2, 3, 0}, 0.7f));
  const auto out = expectAsReference(inputOf(b));
  const float half = std::sqrt(0.5f);
  EXPECT_NEAR(out.aabbs[drum].upper.x, 1.5f * half + 0.12f, 1e-6f);
  EXPECT_NEAR(out.aabbs[drum].lower.y, -1.5f * half - 0.12f, 1e-6f);
  EXPECT_NEAR(out.aabbs[drum].upper.z, 0.62f, 1e-6f);
  EXPECT_NEAR(out.aabbs[rod].upper.x, half + 0.12f, 1e-6f);
  EXPECT_NEAR(out.aabbs[rod].upper.z, 0.12f, 1e-6f);
  EXPECT_NEAR(out.aabbs[pearls].lower.x, -half - 0.62f, 1e-6f);
  EXPECT_NEAR(out.aabbs[pearls].upper.y, 2 * half + 0.12f, 1e-6f);
  EXPECT_NEAR(out.aabbs[pearls].upper.z, 0.62f, 1e-6f);
}

TEST_F(UpdateAabbsTest, WhatTakesNoPartOverlapsNothingSmall) {
  WorldBuilder b;
  b.add(b.plane({0, 1, 0, 0}, 0), {}, 0);
  const uint quarantined = b.add(b.sphere(1), {});
  const uint broken = b.add(b.sphere(1), {std::numeric_limits<float>::quiet_NaN(), 0, 0, 0});
  for (const uint i : {quarantined, broken}) b.info(i).flags |= BODY_QUARANTINED;
  const uint shapeless = b.add(b.sphere(1), {});
  b.shape(b.info(shapeless).shapeIndex).type = SHAPE_NONE;
  const uint unshaped = b.add(b.sphere(1), {});
  b.info(unshaped).shapeIndex = -1;
  const uint free = b.addFree();
  Stage20Input in = inputOf(b);
  for (Aabb& old : in.oldAabbs) old = {{-1, -1, -1, 0}, {1, 1, 1, 0}};
  for (const bool all : {true, false}) {
    StepSettings settings;
    settings.forceUpdateAllAabbs = all;
    const auto out = expectAsReference(in, settings);
    for (const uint i : {quarantined, broken, shapeless, unshaped, free}) {
      for (const Aabb& other : out.aabbs) EXPECT_FALSE(overlapAabb(out.aabbs[i], other)) << i;
    }
  }
}

TEST_F(UpdateAabbsTest, ContinuousCoversThePredictedPoseSmall) {
  WorldBuilder b;
  const uint moving = b.add(b.sphere(1), {});
  const uint kinematic = b.addKinematic(b.sphere(1), {});
  const uint fixed = b.add(b.sphere(1), {}, 0);
  const uint object = b.addObject(b.sphere(1), {});
  const uint movable = b.addObject(b.sphere(1), {});  // moved by the application; has no velocity of its own
  b.info(movable).flags = BODY_PRESENT;
  const uint brick = b.add(b.box({1, 2, 3, 0}), {});
  Stage20Input in = inputOf(b);
  for (BodyStep& s : in.steps) {
    s.predictedPosition = {4, -5, 0, 0};
    s.predictedOrientation = turnAbout({1, 0, 0, 0}, 1.5707963f);
  }
  StepSettings settings;
  auto out = expectAsReference(in, settings);
  EXPECT_FLOAT_EQ(out.aabbs[moving].upper.x, 5.02f);
  EXPECT_FLOAT_EQ(out.aabbs[moving].lower.y, -6.02f);
  EXPECT_FLOAT_EQ(out.aabbs[moving].upper.y, 1.02f);
  EXPECT_FLOAT_EQ(out.aabbs[brick].lower.y, -8.02f);  // lies on its side at the end
  EXPECT_FLOAT_EQ(out.aabbs[brick].upper.z, 3.02f);
  for (const uint i : {kinematic, fixed, object, movable}) EXPECT_FLOAT_EQ(out.aabbs[i].upper.x, 1.02f) << i;

  settings.useContinuous = false;
  out = expectAsReference(in, settings);
  EXPECT_FLOAT_EQ(out.aabbs[moving].upper.x, 1.02f);
  settings.contactBreakingThreshold = 0.5f;
  EXPECT_FLOAT_EQ(expectAsReference(in, settings).aabbs[moving].upper.x, 1.5f);
}

TEST_F(UpdateAabbsTest, SleepersKeepTheirAabbUnlessAllAreUpdatedSmall) {
  WorldBuilder b;
  const int states[] = {
      STATE_ACTIVE,    STATE_SLEEPING, STATE_WANTS_DEACTIVATION, STATE_DISABLE_DEACTIVATION, STATE_DISABLE_SIMULATION,
      STATE_FIXED_BASE};
  for (const int state : states) b.activation(b.add(b.sphere(1), {10, 0, 0, 0})).state = state;
  const uint newcomer = b.add(b.sphere(1), {10, 0, 0, 0});
  b.activation(newcomer).state = STATE_SLEEPING;
  Stage20Input in = inputOf(b);
  const Aabb old = {{-3, -2, -1, 0}, {1, 2, 3, 0}};
  for (uint i = 0; i < newcomer; ++i) in.oldAabbs[i] = old;

  StepSettings settings;
  settings.forceUpdateAllAabbs = false;
  auto out = expectAsReference(in, settings);
  for (const uint i : {1u, 4u, 5u}) EXPECT_TRUE(sameBits(out.aabbs[i], old)) << i;
  for (const uint i : {0u, 2u, 3u, newcomer}) EXPECT_FLOAT_EQ(out.aabbs[i].upper.x, 11.02f) << i;
  settings.forceUpdateAllAabbs = true;
  out = expectAsReference(in, settings);
  for (const Aabb& box : out.aabbs) EXPECT_FLOAT_EQ(box.upper.x, 11.02f);
}

TEST_F(UpdateAabbsTest, OutOfBoundsBodiesAreDisabledAndCountedSmall) {
  WorldBuilder b;
  // The diagonal of a cube with half extent e is e * sqrt(12); the limit is 1e6.
  const uint fits = b.add(b.box({2.88e5f, 2.88e5f, 2.88e5f, 0}), {});
  const uint tooLarge = b.add(b.box({2.89e5f, 2.89e5f, 2.89e5f, 0}), {});
  const uint tooFast = b.add(b.sphere(1), {});
  const uint infinite = b.add(b.sphere(1), {});
  const uint lost = b.add(b.sphere(1), {std::numeric_limits<float>::infinity(), 0, 0, 0});
  const uint stubborn = b.add(b.sphere(1e7f), {});
  b.activation(stubborn).state = STATE_DISABLE_DEACTIVATION;
  const uint disabled = b.add(b.sphere(1e7f), {});
  b.activation(disabled).state = STATE_DISABLE_SIMULATION;
  const uint fixed = b.add(b.sphere(1e7f), {}, 0);
  const uint kinematic = b.addKinematic(b.sphere(1e7f), {});
  b.activation(kinematic).state = STATE_ACTIVE;
  const uint sleeper = b.add(b.sphere(1e7f), {});
  b.activation(sleeper).state = STATE_SLEEPING;
  for (uint i = 0; i < b.bodyCount(); ++i) b.activation(i).deactivationTime = 1.5f;
  Stage20Input in = inputOf(b);
  in.steps[tooFast].predictedPosition = {2e6f, 0, 0, 0};
  in.steps[infinite].predictedPosition = {std::numeric_limits<float>::infinity(), 0, 0, 0};
  const Aabb old = {{-1, -1, -1, 0}, {1, 1, 1, 0}};
  in.oldAabbs[tooFast] = in.oldAabbs[lost] = in.oldAabbs[fixed] = in.oldAabbs[kinematic] = in.oldAabbs[sleeper] = old;

  for (const bool all : {true, false}) {
    StepSettings settings;
    settings.forceUpdateAllAabbs = all;
    const auto out = expectAsReference(in, settings);
    for (const uint i : {tooLarge, tooFast, infinite, lost, kinematic}) {
      EXPECT_EQ(out.activations[i].state, STATE_DISABLE_SIMULATION) << i;
    }
    EXPECT_EQ(out.activations[fits].state, STATE_ACTIVE);
    EXPECT_EQ(out.activations[stubborn].state, STATE_DISABLE_DEACTIVATION);
    EXPECT_EQ(out.activations[sleeper].state, all ? STATE_DISABLE_SIMULATION : STATE_SLEEPING);
    EXPECT_EQ(out.outOfBounds, all ? 6u : 5u);
    for (const BodyActivation& a : out.activations) EXPECT_EQ(a.deactivationTime, 1.5f);
    // The broadphase keeps what it had.
    for (const uint i : {tooFast, lost, kinematic, sleeper}) EXPECT_TRUE(sameBits(out.aabbs[i], old)) << i;
    EXPECT_FLOAT_EQ(out.aabbs[fixed].upper.x, all ? 1e7f : 1);
    EXPECT_FLOAT_EQ(out.aabbs[disabled].upper.x, 1e7f);
  }
}

// Against Bullet's shapes themselves; the reference's tolerance holds for both.
TEST_F(UpdateAabbsTest, CapsulesAndHullsAsBulletSmall) {
  std::mt19937 random(4);
  WorldBuilder b;
  std::vector<std::unique_ptr<btConvexShape>> shapes;
  for (int n = 0; n < 24; ++n) {
    const float radius = uniform(random, 0.1f, 1), half = uniform(random, 0.1f, 2);
    const float4 at = uniform3(random, -5, 5);
    const float4 turn = randomTurn(random);
    if (n % 4 == 0) shapes.push_back(std::make_unique<btCapsuleShapeX>(radius, 2 * half));
    if (n % 4 == 1) shapes.push_back(std::make_unique<btCapsuleShape>(radius, 2 * half));
    if (n % 4 == 2) shapes.push_back(std::make_unique<btCapsuleShapeZ>(radius, 2 * half));
    if (n % 4 < 3) {
      b.add(b.capsule(n % 4, radius, half), at, 1, turn);
      continue;
    }
    auto hull = std::make_unique<btConvexHullShape>();
    std::vector<float4> points;
    for (int k = 0; k < 10; ++k) {
      points.push_back(uniform3(random, -radius, half));  // not about its origin
      hull->addPoint(toBullet(points.back()));
    }
    b.add(b.hull(points, hull->getMargin()), at, 1, turn);
    shapes.push_back(std::move(hull));
  }
  const Stage20Input in = inputOf(b);
  StepSettings settings;
  settings.useContinuous = false;
  const auto out = expectAsReference(in, settings);
  for (uint i = 0; i < in.world.bodyCount; ++i) {
    btVector3 lower, upper;
    shapes[i]->getAabb(toBullet(in.world.poses.values[i]), lower, upper);
    const btVector3 grown(0.02f, 0.02f, 0.02f);
    const float scale = static_cast<float>(upper.length() + lower.length());
    EXPECT_LE((toBullet(out.aabbs[i].lower) - (lower - grown)).length(), 2 * kTolerance * scale) << i;
    EXPECT_LE((toBullet(out.aabbs[i].upper) - (upper + grown)).length(), 2 * kTolerance * scale) << i;
  }
}

void addRandomStates(std::mt19937& random, Stage20Input& in) {
  for (uint i = 0; i < in.world.bodyCount; ++i) {
    in.world.activations.values[i].state = static_cast<int>(random() % 7);
    in.steps[i].predictedPosition = in.steps[i].predictedPosition + uniform3(random, -1, 1);
    in.steps[i].predictedOrientation = randomTurn(random);
    if (random() % 3 == 0) continue;
    const float4 lower = uniform3(random, -5, 5);
    in.oldAabbs[i] = {lower, lower + uniform3(random, 0, 2)};
  }
}

TEST_F(UpdateAabbsTest, RandomSmall) {
  std::mt19937 random(1);
  WorldBuilder b;
  RandomWorld what;
  what.bodies = 40;
  b.addRandom(random, what);
  Stage20Input in = inputOf(b);
  addRandomStates(random, in);
  expectAsReference(in);
}

TEST_F(UpdateAabbsTest, RandomOfAllCounts) {
  std::mt19937 random(2);
  for (const uint count : {0u, 1u, 31u, 33u, 127u, 128u, 129u, 1000u}) {
    WorldBuilder b;
    RandomWorld what;
    what.bodies = count;
    what.planes = count % 2;
    b.addRandom(random, what);
    Stage20Input in = inputOf(b);
    addRandomStates(random, in);
    SCOPED_TRACE(count);
    StepSettings settings;
    settings.useContinuous = random() % 2;
    settings.forceUpdateAllAabbs = random() % 2;
    expectAsReference(in, settings);
  }
}

// The reference itself against btCollisionWorld::updateAabbs.
TEST(UpdateAabbsReference, AgreesWithBullet) {
  std::mt19937 random(3);
  WorldBuilder b;
  RandomWorld what;
  what.bodies = 200;
  what.freeShare = 0;
  b.addRandom(random, what);
  b.add(b.sphere(1e7f), {});
  const WorldInput in = b.finish();
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btCollisionWorld world(&dispatcher, &broadphase, &configuration);
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  std::vector<BodyStep> steps(in.bodyCount);
  for (uint i = 0; i < in.bodyCount; ++i) {
    const Shape& s = in.shapes.values[static_cast<size_t>(in.infos.values[i].shapeIndex)];
    shapes.push_back(bulletShapeOf(s));
    const float mass = in.infos.values[i].flags & BODY_INTEGRATED ? 1 : 0;
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, shapes.back().get()));
    int flags = bodies[i]->getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT;
    if (in.infos.values[i].flags & BODY_STATIC) flags |= btCollisionObject::CF_STATIC_OBJECT;
    if (in.infos.values[i].flags & BODY_KINEMATIC) flags |= btCollisionObject::CF_KINEMATIC_OBJECT;
    bodies[i]->setCollisionFlags(flags);
    bodies[i]->forceActivationState(in.activations.values[i].state);
    bodies[i]->setWorldTransform(toBullet(in.poses.values[i]));
    steps[i].predictedPosition = in.poses.values[i].position + uniform3(random, -1, 1);
    steps[i].predictedOrientation = randomTurn(random);
    bodies[i]->setInterpolationWorldTransform(toBullet({steps[i].predictedPosition, steps[i].predictedOrientation}));
    world.addCollisionObject(bodies[i].get());
  }
  for (const bool continuous : {true, false}) {
    world.getDispatchInfo().m_useContinuous = continuous;
    world.updateAabbs();
    StepSettings settings;
    settings.useContinuous = continuous;
    const auto out =
        updateAabbsReference(makeStepParams(settings, false), in.infos.values, in.shapes.values, in.hulls.vertices,
                             in.poses.values, steps, in.activations.values, std::vector<Aabb>(in.bodyCount, kNone));
    EXPECT_EQ(out.outOfBounds, 1u);
    for (uint i = 0; i < in.bodyCount; ++i) {
      const btBroadphaseProxy* proxy = bodies[i]->getBroadphaseHandle();
      EXPECT_EQ(out.activations[i].state, bodies[i]->getActivationState());
      if (out.activations[i].state == STATE_DISABLE_SIMULATION) continue;  // Bullet's is still the one of its creation
      const float scale = static_cast<float>(proxy->m_aabbMax.length() + proxy->m_aabbMin.length());
      EXPECT_LE((toBullet(out.aabbs[i].lower) - proxy->m_aabbMin).length(), 2 * kTolerance * scale) << i;
      EXPECT_LE((toBullet(out.aabbs[i].upper) - proxy->m_aabbMax).length(), 2 * kTolerance * scale) << i;
    }
  }
  for (auto& body : bodies) world.removeCollisionObject(body.get());
}

}  // namespace
}  // namespace btgpu
