// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A scene stepped on the device, with a hash over all bits of all steps. Used by the test in its own process,
// and by hash_run, which the test starts in others.
#pragma once

#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "compat/btGpuDynamicsWorld.h"
#include "compat/world_state.h"
#include "tests/support/world_hash.h"
#include "tests/support/world_of.h"

namespace btgpu::test {

struct RunPlan {
  std::string scene = "stack";
  scenes::Size size{6, 6, 6};
  int steps = 300;
  int pairCapacity = 0;    // room to start with; 0: the default
  int changedBody = -1;    // this body starts one ulp higher
  bool emptyStep = false;  // the world steps once before it gets its bodies
};

struct RunOutcome {
  std::uint64_t hash = 0;
  unsigned long long deviceSteps = 0, stockSteps = 0, repeatedSteps = 0;
  unsigned colours = 0;  // most of a step
  int asleep = 0;        // bodies at the end
  int programsBuilt = 0, programsLoaded = 0;
};

// A world of a plan, stepped as its owner likes.
class HashedRun {
 public:
  explicit HashedRun(const RunPlan& plan) : m_run(settingsOf(plan)) {
    const scenes::Scene* scene = scenes::find(plan.scene);
    if (!scene) throw std::runtime_error("no scene " + plan.scene);
    if (plan.emptyStep) m_run.run(1);
    scene->build(m_run.objects, plan.size);
    if (plan.changedBody >= 0) raise(*m_run.objects.bodies().at(static_cast<size_t>(plan.changedBody)));
  }

  void step(int count = 1) {
    for (int i = 0; i < count; ++i) {
      m_run.run(1);
      m_hash.add(m_run.world);
      m_colours = btMax(m_colours, m_run.world.statistics().m_colours);
    }
  }

  RunOutcome outcome() const {
    RunOutcome o;
    o.hash = m_hash.value();
    const btGpuStatistics s = m_run.world.statistics();
    o.deviceSteps = s.m_deviceSteps;
    o.stockSteps = s.m_stockSteps;
    o.repeatedSteps = s.m_repeatedSteps;
    o.colours = m_colours;
    for (const btRigidBody* b : m_run.objects.bodies()) o.asleep += b->getActivationState() == ISLAND_SLEEPING;
    const auto state = findState(&m_run.world);
    if (state->engine) {
      o.programsBuilt = state->engine->info().programsBuilt;
      o.programsLoaded = state->engine->info().programsLoaded;
    }
    return o;
  }

  btGpuDynamicsWorld& world() { return m_run.world; }
  const scenes::Objects& objects() const { return m_run.objects; }

 private:
  static btGpuSettings settingsOf(const RunPlan& plan) {
    btGpuSettings settings;
    settings.m_pairCapacity = plan.pairCapacity;
    return settings;
  }
  static void raise(btRigidBody& body) {
    btTransform t = body.getWorldTransform();
    t.getOrigin().setY(std::nextafter(t.getOrigin().y(), btScalar(1e30)));
    body.setWorldTransform(t);
    body.setInterpolationWorldTransform(t);
  }

  WorldOf<btGpuDynamicsWorld> m_run;
  WorldHash m_hash;
  unsigned m_colours = 0;
};

}  // namespace btgpu::test
