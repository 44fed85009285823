// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Worlds for tests that run the same calls on stock Bullet and on btgpu.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "compat/btGpuDynamicsWorld.h"
#include "samples/scenes/scene.h"

namespace btgpu::test {

// A world with its parts; bodies are added through `objects`, which takes them out again at the end.
template <typename World>
struct WorldOf {
  WorldOf() : dispatcher(&configuration), world(&dispatcher, &broadphase, &solver, &configuration), objects(world) {}
  explicit WorldOf(const btGpuSettings& settings)
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

using StockWorld = WorldOf<btDiscreteDynamicsWorld>;
using GpuWorld = WorldOf<btGpuDynamicsWorld>;

// Stock must never be compared with stock.
inline void expectAllOnDevice(const btGpuDynamicsWorld& world) {
  EXPECT_GT(world.statistics().m_deviceSteps, 0u) << "no step ran on a device";
  EXPECT_EQ(world.statistics().m_stockSteps, 0u);
  for (const auto& f : world.fallbackReport()) ADD_FAILURE() << "on the CPU: " << f.m_what << ": " << f.m_reason;
}

inline double length(const btVector3& v) { return double(v.length()); }

}  // namespace btgpu::test
