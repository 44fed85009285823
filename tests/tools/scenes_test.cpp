// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The built-in scenes themselves, on stock alone: how many bodies a size gives, and that a scene is the same each time.
// Whether btgpu steps the big ones as stock does: parity/big_*.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/world_of.h"

namespace btgpu::test {
namespace {

using World = WorldOf<btDiscreteDynamicsWorld>;

long bodies(const scenes::Scene& scene, scenes::Size size, bool moving) {
  World run;
  scene.build(run.objects, size);
  long count = 0;
  for (const btRigidBody* body : run.objects.bodies()) count += !moving || !body->isStaticObject();
  return count;
}

TEST(Scenes, BigOnesHaveTheBodiesOfTheirDescription) {
  const auto moving = [](const char* name, scenes::Size size) { return bodies(*scenes::find(name), size, true); };
  EXPECT_EQ(moving("large_pyramid", {100, 1, 1}), 5050);
  EXPECT_EQ(moving("many_pyramids", {14, 10, 14}), 10780);
  EXPECT_EQ(moving("convex_pile", {16, 20, 16}), 5120);
  EXPECT_EQ(moving("rocks", {21, 24, 21}), 10584);
  EXPECT_EQ(moving("ring", {24, 5, 2}), 24 * 5 * 2);
  EXPECT_EQ(moving("columns", {3, 10, 5}), 3 * 10 * 5);
  EXPECT_EQ(moving("city", {3, 16, 5}), 4 * 3 * 16 * 5);
  EXPECT_EQ(moving("pour", {5, 4, 3}), 5 * 4 * 3);
  EXPECT_EQ(moving("junkyard", {5, 4, 3}), 5 * 4 * 3);
  EXPECT_EQ(moving("washer", {5, 4, 3}), 1 + 5 * 4 * 3);  // with the drum
  EXPECT_EQ(moving("joint_grid", {100, 1, 100}), 10000 - 100);
}

TEST(Scenes, BenchmarkSizesOfTheBigOnes) {
  const auto product = [](const char* name) {
    const scenes::Size size = scenes::find(name)->benchmark.size;
    return static_cast<long>(size.x) * size.y * size.z;
  };
  EXPECT_EQ(product("large_pyramid"), 100);  // boxes at the base
  EXPECT_EQ(product("many_pyramids"), 196 * 10);
  EXPECT_EQ(product("convex_pile"), 5120);
  EXPECT_EQ(product("rocks"), 10584);
  EXPECT_EQ(product("ring"), 110000);
  EXPECT_EQ(product("columns"), 100000);
  EXPECT_EQ(product("city"), 250000);  // of four
  EXPECT_EQ(product("pour"), 100000);
  EXPECT_EQ(product("junkyard"), 3136);
  EXPECT_EQ(product("washer"), 8000);
  EXPECT_EQ(product("joint_grid"), 10000);
}

TEST(Scenes, SizesForSoManyBodies) {
  for (const auto* list : {&scenes::all(), &scenes::big()}) {
    for (const scenes::Scene& scene : *list) {
      if (!scene.benchmark.sizeFor) continue;
      SCOPED_TRACE(scene.name);
      for (const int wanted : {100, 1000, 5000}) {
        const long count = bodies(scene, scene.benchmark.sizeFor(wanted), false);
        EXPECT_GT(count, wanted / 2) << wanted;
        EXPECT_LT(count, 2 * wanted) << wanted;
      }
    }
  }
}

// Bodies that don't turn, or weigh nothing, say nothing about their shape.
TEST(Scenes, OfShapesHaveBodiesThatTurn) {
  for (const scenes::Scene& scene : scenes::ofShapes()) {
    World run;
    scene.build(run.objects, scene.size);
    int moving = 0;
    for (const btRigidBody* body : run.objects.bodies()) {
      if (body->getInvMass() == btScalar(0)) continue;
      ++moving;
      EXPECT_GT(body->getInvInertiaDiagLocal().length(), btScalar(0)) << scene.name;
    }
    EXPECT_EQ(moving, scene.size.x * scene.size.y * scene.size.z) << scene.name;
  }
}

TEST(Scenes, TheSameObjectsEachTime) {
  for (const scenes::Scene& scene : scenes::big()) {
    World a, b;
    for (World* run : {&a, &b}) scene.build(run->objects, scene.size);
    ASSERT_EQ(a.objects.bodies().size(), b.objects.bodies().size()) << scene.name;
    for (size_t i = 0; i < a.objects.bodies().size(); ++i) {
      const btRigidBody &one = *a.objects.bodies()[i], &other = *b.objects.bodies()[i];
      EXPECT_EQ(one.getWorldTransform().getOrigin(), other.getWorldTransform().getOrigin()) << scene.name << i;
      EXPECT_EQ(one.getInvInertiaDiagLocal(), other.getInvInertiaDiagLocal()) << scene.name << i;
    }
  }
}

TEST(Scenes, AreFoundByTheirNamesWithAndWithoutUnderscores) {
  for (const auto* list : {&scenes::all(), &scenes::big(), &scenes::ofShapes()}) {
    for (const scenes::Scene& scene : *list) EXPECT_EQ(scenes::find(scene.name), &scene);
  }
  for (const std::string& shape : scenes::shapeNames()) {
    for (const std::string& ground : scenes::groundNames()) {
      EXPECT_NE(scenes::find("rain_" + shape + "_on_" + ground), nullptr);
      EXPECT_NE(scenes::find("roll_" + shape + "_on_" + ground), nullptr);
    }
  }
  EXPECT_EQ(scenes::find("convexpile"), scenes::find("convex_pile"));
  EXPECT_EQ(scenes::find("no_such"), nullptr);
  EXPECT_EQ(scenes::find(""), nullptr);
}

long joints(const scenes::Scene& scene) {
  World run;
  scene.build(run.objects, scene.benchmark.size);
  return run.world.getNumConstraints();
}

TEST(Scenes, ClassicOnesAreAsLargeAsInBulletsBenchmark) {
  const auto moving = [](const std::string& name) {
    return bodies(*scenes::find(name), scenes::find(name)->benchmark.size, true);
  };
  EXPECT_EQ(moving("bench1"), 8 * 47 * 8);       // 3,000 falling
  EXPECT_EQ(moving("bench2"), 650 + 144 + 192);  // 1,000 stacked: pyramid, wall, tower
  EXPECT_EQ(moving("bench3"), 136 * 11);
  EXPECT_EQ(joints(*scenes::find("bench3")), 136 * 10);
  EXPECT_EQ(moving("bench4"), 1024);
  for (const char* name : {"bench5", "bench6", "bench7"}) EXPECT_EQ(moving(name), 1000) << name;
}

TEST(Scenes, JointsOfTheMachines) {
  EXPECT_EQ(joints(*scenes::find("joint_grid")), 19701);
  EXPECT_EQ(joints(*scenes::find("ragdolls")), 136 * 10);
  EXPECT_EQ(joints(*scenes::find("bridge")), 24 * 101);
  EXPECT_EQ(joints(*scenes::find("crane")), 32 * 13);
  EXPECT_EQ(joints(*scenes::find("hexapod")), 16 * 16 * 12);
}

TEST(Scenes, AllRaysOfTheClassicOneAreCast) {
  World run;
  scenes::find("bench7")->build(run.objects, {10, 10, 10});
  for (int i = 0; i < 3; ++i) {
    run.world.stepSimulation(btScalar(1.0 / 60), 0);
    ASSERT_EQ(run.objects.seen().size(), 500u);
    for (const btScalar fraction : run.objects.seen()) EXPECT_LT(fraction, btScalar(1));  // the ground has a rim
  }
}

TEST(Scenes, CharactersWalkUpTheirStairs) {
  World run;
  const scenes::Scene& scene = *scenes::find("character");
  scene.build(run.objects, {8, 8, 1});
  const auto ghost = [&run]() -> const btCollisionObject& {
    for (int i = 0; i < run.world.getNumCollisionObjects(); ++i) {
      const btCollisionObject* object = run.world.getCollisionObjectArray()[i];
      if (object->getInternalType() == btCollisionObject::CO_GHOST_OBJECT) return *object;
    }
    throw std::logic_error("no character");
  };
  double highest = 0;
  for (int i = 0; i < scene.steps; ++i) {
    run.world.stepSimulation(btScalar(1.0 / 60), 0);
    highest = std::max(highest, double(ghost().getWorldTransform().getOrigin().y()));
  }
  // Its middle is half its height, 0.85, over where it stands, at most a jump of 4 m/s, 0.8 m, higher.
  EXPECT_GT(highest, 8 * 0.2 + 0.85);
  EXPECT_LT(highest, 8 * 0.2 + 0.85 + 0.8 + 0.3);  // on a crate
}

// However the time is cut into steps: a drum that turns by 25 degrees a second at a radius of 20.
TEST(Scenes, TheWashersDrumTurnsAtConstantSpeed) {
  for (const int substeps : {1, 2}) {
    World run;
    scenes::find("washer")->build(run.objects, {20, 20, 1});
    const btRigidBody& drum = *run.objects.bodies().front();
    ASSERT_TRUE(drum.isKinematicObject());
    for (int i = 0; i < 60; ++i) run.world.stepSimulation(btScalar(1.0 / 60), substeps, btScalar(1.0 / 60 / substeps));
    // The drum's radius is that of the grid, 1.2 x 20 / sqrt(2), and a seventh more.
    const double speed = 25 * std::sqrt(20 / (1.2 * 20 / std::sqrt(2.0) * 8 / 7));
    const btVector3 x = drum.getWorldTransform().getBasis().getColumn(0);
    const double degree = 0.017453292519943295;
    // Poses are floats; a substep may be left over or be one more, as Bullet's clock rounds.
    EXPECT_NEAR(std::atan2(double(x.y()), double(x.x())) / degree, speed, 1e-3 + speed / 60) << substeps;
    EXPECT_NEAR(double(drum.getAngularVelocity().z()) / degree, speed, 1e-5 * speed) << substeps;
  }
}

// No two bodies start inside each other: what falls then is the scene, not an explosion.
TEST(Scenes, BigOnesStartApart) {
  for (const scenes::Scene& scene : scenes::big()) {
    World run;
    scene.build(run.objects, scene.size);
    run.world.performDiscreteCollisionDetection();
    double deepest = 0;
    for (int i = 0; i < run.dispatcher.getNumManifolds(); ++i) {
      const btPersistentManifold& m = *run.dispatcher.getManifoldByIndexInternal(i);
      for (int k = 0; k < m.getNumContacts(); ++k) deepest = btMin(deepest, double(m.getContactPoint(k).getDistance()));
    }
    EXPECT_GT(deepest, -0.01) << scene.name;
  }
}

}  // namespace
}  // namespace btgpu::test
