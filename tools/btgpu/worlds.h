// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A world with everything that belongs to it, stock or btgpu, and the scene inside.
#pragma once

#include <functional>
#include <memory>

#include "compat/btGpuDynamicsWorld.h"
#include "samples/scenes/scene.h"

namespace btgpu::tool {

// Puts objects into a world; owns them until it is destroyed. Called once for each world of a comparison.
struct SceneContents {
  virtual ~SceneContents() = default;
};
using Builder = std::function<std::unique_ptr<SceneContents>(btDiscreteDynamicsWorld&)>;

Builder builderOf(const scenes::Scene& scene, scenes::Size size);

template <typename World>
class TestWorld {
 public:
  template <typename... Args>
  explicit TestWorld(const Builder& build, Args&&... args)
      : m_dispatcher(&m_configuration),
        m_world(std::make_unique<World>(&m_dispatcher, &m_broadphase, &m_solver, &m_configuration,
                                        std::forward<Args>(args)...)),
        m_contents(build(*m_world)) {}
  ~TestWorld() {
    m_contents.reset();
    m_world.reset();
  }
  TestWorld(const TestWorld&) = delete;
  TestWorld& operator=(const TestWorld&) = delete;

  World& world() { return *m_world; }
  const World& world() const { return *m_world; }
  btCollisionDispatcher& dispatcher() { return m_dispatcher; }
  btDbvtBroadphase& broadphase() { return m_broadphase; }

 private:
  btDefaultCollisionConfiguration m_configuration;
  btCollisionDispatcher m_dispatcher;
  btDbvtBroadphase m_broadphase;
  btSequentialImpulseConstraintSolver m_solver;
  std::unique_ptr<World> m_world;
  std::unique_ptr<SceneContents> m_contents;
};

}  // namespace btgpu::tool
