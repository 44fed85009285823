// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bench_worlds.h"

#include <fmt/format.h>

#include "bullet3/bullet3_peer.h"
#include "bullet3_scene.h"
#include "compat/engine_loader.h"
#include "compat/world_state.h"
#include "free_run.h"

namespace btgpu::tool {
namespace {

EndFigures endOf(const btDiscreteDynamicsWorld& world) {
  const WorldFigures figures = measureWorld(world, 0);
  return {figures.meanHeight, figures.kineticEnergy};
}

class GpuWorld : public BenchWorld {
 public:
  GpuWorld(const Builder& build, const btGpuSettings& settings, btScalar timeStep)
      : m_world(build, settings), m_timeStep(timeStep) {}

  void step() override { m_world.world().stepSimulation(m_timeStep, 0); }
  StepSplit split() const override {
    const btGpuStatistics s = m_world.world().statistics();
    return {s.m_deviceMs, s.m_translateMs};
  }
  StepCounts counts() override {
    const btGpuStatistics s = m_world.world().statistics();
    StepCounts counts{s.m_launches, s.m_waits, s.m_contactManifolds, s.m_contactPoints, s.m_colours, {}};
    if (const auto engine = info()) counts.deviceBytes = static_cast<long>(engine->worldMemory);
    return counts;
  }
  std::optional<EndFigures> end() const override { return endOf(m_world.world()); }
  int bodies() const override { return m_world.world().getNumCollisionObjects(); }
  std::string driver() const override {
    const auto engine = info();
    return engine ? fmt::format("{}, {}, driver {}, {} shape", engine->platform, engine->version, engine->driver,
                                engine->kernelShape)
                  : std::string();
  }
  std::string device() const override {
    const btGpuStatistics s = m_world.world().statistics();
    return s.m_deviceSteps == 0 && s.m_smallSteps > 0 ? "stock's path: a small world" : s.m_device;
  }
  std::string failure() const override {
    const auto fallbacks = m_world.world().fallbackReport();
    if (m_world.world().statistics().m_stockSteps == m_world.world().statistics().m_smallSteps) return {};
    return fallbacks.empty() ? "some steps ran on the CPU"
                             : fmt::format("some steps ran on the CPU: {} ({})", fallbacks.front().m_what,
                                           fallbacks.front().m_reason);
  }

  btGpuDynamicsWorld& world() { return m_world.world(); }

 private:
  std::optional<EngineInfo> info() const {
    const auto state = findState(&m_world.world());
    return state && state->engine ? std::optional<EngineInfo>(state->engine->info()) : std::nullopt;
  }

  TestWorld<btGpuDynamicsWorld> m_world;
  btScalar m_timeStep;
};

class CpuWorld : public BenchWorld {
 public:
  CpuWorld(const Builder& build, btScalar timeStep) : m_world(build), m_timeStep(timeStep) {}

  void step() override { m_world.world().stepSimulation(m_timeStep, 0); }
  // Manifolds without points are pairs whose AABBs overlap: the solver does not get them.
  StepCounts counts() override {
    StepCounts counts;
    long manifolds = 0, contacts = 0;
    for (int i = 0; i < m_world.dispatcher().getNumManifolds(); ++i) {
      const int points = m_world.dispatcher().getManifoldByIndexInternal(i)->getNumContacts();
      manifolds += points > 0;
      contacts += points;
    }
    counts.manifolds = manifolds;
    counts.contacts = contacts;
    return counts;
  }
  std::optional<EndFigures> end() const override { return endOf(m_world.world()); }
  int bodies() const override { return m_world.world().getNumCollisionObjects(); }
  std::string device() const override { return "one thread"; }

 private:
  TestWorld<btDiscreteDynamicsWorld> m_world;
  btScalar m_timeStep;
};

}  // namespace

std::unique_ptr<BenchWorld> makeGpuWorld(const Builder& build, const btGpuSettings& settings, btScalar timeStep) {
  return std::make_unique<GpuWorld>(build, settings, timeStep);
}

std::vector<btGpuStageTime> takeProfile(BenchWorld& gpuWorld) {
  return dynamic_cast<GpuWorld&>(gpuWorld).world().takeProfile();
}

std::unique_ptr<BenchWorld> makeCpuWorld(const Builder& build, btScalar timeStep) {
  return std::make_unique<CpuWorld>(build, timeStep);
}

std::unique_ptr<BenchWorld> makeBullet3World(const Builder& build, const std::string& device, btScalar timeStep) {
  const Bullet3Scene scene = [&] {
    TestWorld<btDiscreteDynamicsWorld> world(build);
    return convertToBullet3(world.world(), timeStep);
  }();
  EngineSettings settings;
  settings.device = device;
  std::string error;
  const auto engine = createEngine(settings, error);
  if (!engine) throw std::runtime_error(error);
  return makeBullet3World(scene, engine->info().platform, engine->info().device);
}

Builder withoutSleeping(const Builder& build) {
  return [build](btDiscreteDynamicsWorld& world) {
    auto contents = build(world);
    for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
      btCollisionObject* object = world.getCollisionObjectArray()[i];
      if (!object->isStaticObject()) object->forceActivationState(DISABLE_DEACTIVATION);
    }
    return contents;
  };
}

Builder withMotionStates(const Builder& build) {
  struct Contents : SceneContents {
    std::unique_ptr<SceneContents> scene;
    std::vector<std::unique_ptr<btDefaultMotionState>> states;
    ~Contents() override { scene.reset(); }  // the bodies go before their motion states
  };
  return [build](btDiscreteDynamicsWorld& world) {
    auto contents = std::make_unique<Contents>();
    contents->scene = build(world);
    for (int i = 0; i < world.getNonStaticRigidBodies().size(); ++i) {
      btRigidBody& body = *world.getNonStaticRigidBodies()[i];
      contents->states.push_back(std::make_unique<btDefaultMotionState>(body.getWorldTransform()));
      body.setMotionState(contents->states.back().get());
    }
    return contents;
  };
}

}  // namespace btgpu::tool
