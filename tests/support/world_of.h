// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A world with all its parts, for tests and for the programs that they start. Without GoogleTest.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <string>

#include "samples/scenes/scene.h"

namespace btgpu::test {

// A world with its parts; bodies are added through `objects`, which takes them out again at the end.
template <typename World>
struct WorldOf {
  WorldOf() : dispatcher(&configuration), world(&dispatcher, &broadphase, &solver, &configuration), objects(world) {}
  template <typename Settings>
  explicit WorldOf(const Settings& settings)
      : dispatcher(&configuration),
        world(&dispatcher, &broadphase, &solver, &configuration, settings),
        objects(world) {}

  void run(int steps, double timeStep = 1.0 / 60.0) {
    for (int i = 0; i < steps; ++i) world.stepSimulation(static_cast<btScalar>(timeStep), 0);
  }

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  World world;
  scenes::Objects objects;
};

// What Bullet's serializer makes of a world: a .bullet file's content.
inline std::string serialized(const btDynamicsWorld& world) {
  btDefaultSerializer serializer;
  const_cast<btDynamicsWorld&>(world).serialize(&serializer);
  return {reinterpret_cast<const char*>(serializer.getBufferPointer()),
          static_cast<size_t>(serializer.getCurrentBufferSize())};
}

}  // namespace btgpu::test
