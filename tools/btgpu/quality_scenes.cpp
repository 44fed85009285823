// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <cmath>

#include "quality.h"

namespace btgpu::tool {
namespace {

constexpr double kTimeStep = 1.0 / 60.0;

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 vec(double x, double y, double z) { return {s(x), s(y), s(z)}; }

struct Contents : SceneContents {
  explicit Contents(btDiscreteDynamicsWorld& world) : objects(world) {}
  scenes::Objects objects;
};

Builder builderOf(const std::function<void(scenes::Objects&)>& fill, double damping) {
  return [fill, damping](btDiscreteDynamicsWorld& world) {
    world.setGravity(vec(0, -10, 0));
    auto contents = std::make_unique<Contents>(world);
    fill(contents->objects);
    for (btRigidBody* body : contents->objects.bodies()) {
      body->setSleepingThresholds(0, 0);
      body->setDamping(s(damping), s(damping));
    }
    return contents;
  };
}

QualityScene builtIn(const std::string& name, scenes::Size size, int steps) {
  const scenes::Scene& scene = *scenes::find(name);
  const std::string at =
      name + " " + std::to_string(size.x) + "," + std::to_string(size.y) + "," + std::to_string(size.z);
  return {at, scene.description, steps, scene.timeStep, tool::builderOf(scene, size)};
}

void addGround(scenes::Objects& o) { o.add(0, o.box(vec(50, 1, 50)), vec(0, -1, 0)); }

// Boxes of edge 1, each twice as heavy as the one below.
void buildHeavyOverLight(scenes::Objects& o) {
  addGround(o);
  btBoxShape* box = o.box(vec(0.5, 0.5, 0.5));
  for (int y = 0; y < 6; ++y) o.add(s(std::pow(2.0, y)), box, vec(0, 0.5 + y, 0));
}

// `links` balls in a row, held at one end, with a weight at the other: hanging, or let go level.
void addChain(scenes::Objects& o, int links, double weight, bool hanging) {
  btSphereShape* ball = o.sphere(s(0.2));
  const btVector3 along = hanging ? vec(0, -0.5, 0) : vec(0.5, 0, 0);
  btRigidBody* before = o.add(0, ball, vec(0, 0, 0));
  for (int i = 1; i <= links; ++i) {
    btRigidBody* link = o.add(s(i == links ? weight : 1), ball, along * s(i));
    o.joint<btPoint2PointConstraint>(true, *before, *link, along / 2, -along / 2);
    before = link;
  }
}

// Planks on hinges between two posts, with a weight on the middle.
void buildBridge(scenes::Objects& o) {
  constexpr int kPlanks = 20;
  btBoxShape* plank = o.box(vec(0.45, 0.1, 1));
  btRigidBody* before = o.add(0, plank, vec(0, 0, 0));
  for (int i = 1; i <= kPlanks + 1; ++i) {
    btRigidBody* next = o.add(i <= kPlanks ? 1 : 0, plank, vec(i, 0, 0));
    o.joint<btHingeConstraint>(true, *before, *next, vec(0.5, 0, 0), vec(-0.5, 0, 0), vec(0, 0, 1), vec(0, 0, 1));
    before = next;
  }
  o.add(s(10), o.box(vec(0.7, 0.7, 0.7)), vec(0.5 * (kPlanks + 1), 1, 0));
}

// A bob of 1 kg on a hinge, 1 m from it, let go level.
void buildPendulum(scenes::Objects& o) {
  btRigidBody* post = o.add(0, o.sphere(s(0.1)), vec(0, 0, 0));
  btRigidBody* bob = o.add(1, o.sphere(s(0.2)), vec(1, 0, 0));
  o.joint<btHingeConstraint>(true, *post, *bob, vec(0, 0, 0), vec(-1, 0, 0), vec(0, 0, 1), vec(0, 0, 1));
}

// A ball that should rise to its own height each time.
void buildBall(scenes::Objects& o) {
  addGround(o);
  o.bodies().front()->setRestitution(1);
  o.add(1, o.sphere(s(0.5)), vec(0, 3, 0))->setRestitution(1);
}

}  // namespace

std::vector<QualityScene> qualityScenes() {
  const auto own = [](const char* name, const char* description, int steps, const auto& fill, double damping = 0) {
    return QualityScene{name, description, steps, kTimeStep, builderOf(fill, damping)};
  };
  return {builtIn("stack", {8, 8, 8}, 600),
          builtIn("large_pyramid", {40, 1, 1}, 600),
          builtIn("columns", {4, 10, 4}, 600),
          builtIn("city", {2, 16, 2}, 600),
          own("heavy over light", "six boxes, each twice as heavy as the one below", 600, buildHeavyOverLight),
          builtIn("ragdoll", {3, 2, 3}, 400),
          own("chain", "30 links that hang, with a weight of ten", 600,
              [](scenes::Objects& o) { addChain(o, 30, 10, true); }),
          own("heavy chain", "10 links that hang, with a weight of a hundred", 600,
              [](scenes::Objects& o) { addChain(o, 10, 100, true); }),
          own("swinging chain", "30 links let go level, with a weight of ten", 600,
              [](scenes::Objects& o) { addChain(o, 30, 10, false); }),
          own("bridge", "20 hinged planks with a weight of ten, damped by 0.3", 600, buildBridge, 0.3),
          own("pendulum", "1 kg at 1 m, from level", 600, buildPendulum),
          own("ball", "restitution 1, from 3 m", 600, buildBall)};
}

}  // namespace btgpu::tool
