// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What belongs to a world of btgpu's but is not inside it: its class adds no member to its base, so its
// state lies in a table keyed by the world's address.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "../gpu_engine/engine.h"
#include "../translation/contact_writer.h"
#include "../translation/fallback_list.h"
#include "../translation/host_contacts.h"
#include "../translation/pair_filter.h"
#include "../translation/read_joints.h"
#include "../translation/read_queries.h"
#include "../translation/read_world.h"
#include "../translation/rest_watch.h"
#include "../translation/world_loops.h"
#include "btGpuDynamicsWorld.h"
#include "crosscheck.h"
#include "small_world.h"
#include "world_zones.h"

BTGPU_TRANSLATION_BEGIN

enum class Path { None, Device, Stock };

// Which substep of a stepSimulation is running. Bullet tells only the time of all of them (saveKinematicState), before
// the first one.
class SubstepCount {
 public:
  void startStepSimulation(double time) {
    m_time = time;
    m_toFollow = 0;
  }
  void startSubstep(double timeStep) {
    if (m_toFollow > 0) --m_toFollow;
    if (m_time > 0 && timeStep > 0) {
      // What is no multiple was not said by Bullet's stepSimulation.
      const double count = std::round(m_time / timeStep);
      if (count >= 1 && count < 1e6 && std::abs(m_time - count * timeStep) < 1e-3 * timeStep)
        m_toFollow = static_cast<int>(count) - 1;
    }
    m_time = 0;
  }
  void endStepSimulation() { startStepSimulation(0); }
  int toFollow() const { return m_toFollow; }

 private:
  double m_time = 0;   // 0: not known, or the first substep has begun
  int m_toFollow = 0;  // after the running one
};

// When an engine that was lost is tried again: after 8 steps, and each time it is lost again after twice as many.
class EngineRetry {
 public:
  void schedule() { m_left = m_interval = m_interval == 0 ? kFirst : std::min(2 * m_interval, kMost); }
  void forget() { m_left = m_interval = 0; }
  // Counts a step without an engine.
  bool due() { return m_left > 0 && --m_left == 0; }

 private:
  static constexpr int kFirst = 8, kMost = 1 << 14;
  int m_left = 0, m_interval = 0;  // steps; m_left 0: never
};

struct WorldState {
  btGpuSettings settings;
  WorldZones zones;                // before the engine, which sends some too
  const void* ownTable = nullptr;  // virtual table of btgpu's own class
  WorldReader reader;
  ContactWriter contacts;
  HostContacts hostContacts;
  PairFilter pairFilter;
  AabbUpdater aabbs;
  MotionStateWriter motionStates;
  JointReader joints;
  std::unique_ptr<Engine> engine;
  std::string engineError;  // why there is no engine
  SmallWorld small;
  EngineRetry engineRetry;  // when it is tried again, if not after configure() only
  StepResults results;      // of the last device step
  Path lastPath = Path::None;
  RestWatch rest;
  // Of the steps before the world came to rest.
  StepSettings restSettings;
  const char* restCallback = nullptr;
  ContactAddedCallback restAddedCallback = nullptr;
  bool inStepSimulation = false;  // of btgpu's own class
  SubstepCount substeps;
  std::shared_ptr<CrossCheck> crosscheck;          // null: not wanted
  bool crosscheckAsked = false;                    // it is known whether it is wanted
  bool aabbsCurrent = true, aabbsUpdated = false;  // the host's broadphase: of all steps so far; in this step
  bool contactsBehind = false;                     // the dispatcher's manifolds are those of an earlier substep

  // The next step reads the whole world anew.
  void forgetWorld() {
    reader.clear();
    contacts.forget();
    contactsBehind = false;
    rest.forget();
  }

  QueryReader queries{QueryKind::Rays};  // of batches, with what goes down and comes up
  std::vector<Ray> deviceRays;
  RayResults rayResults;
  QueryReader sweepQueries{QueryKind::Sweeps};
  std::vector<Sweep> deviceSweeps;
  SweepResults sweepResults;
  QueryReader pairQueries{QueryKind::Pairs};

  FallbackList fallbacks;
  btGpuStatistics statistics;
};

// While a stepSimulation runs, what RestWatch has found out holds until the application is called.
class StepSimulationScope {
 public:
  StepSimulationScope(WorldState& state, bool ownClass) : m_state(state), m_outer(state.inStepSimulation) {
    m_state.inStepSimulation = ownClass;
    m_state.rest.endConfirmation();
  }
  ~StepSimulationScope() {
    m_state.inStepSimulation = m_outer;
    m_state.rest.endConfirmation();
  }
  StepSimulationScope(const StepSimulationScope&) = delete;
  StepSimulationScope& operator=(const StepSimulationScope&) = delete;

 private:
  WorldState& m_state;
  bool m_outer;
};

// The state of a world, made if there is none: an address may be used again without a destructor having run.
std::shared_ptr<WorldState> findState(const btDiscreteDynamicsWorld* world);
std::shared_ptr<WorldState> replaceState(const btDiscreteDynamicsWorld* world, const btGpuSettings& settings);
void eraseState(const btDiscreteDynamicsWorld* world);

// The engine of a world, made when it is first asked for. Null if there is none to be had.
Engine* engineOf(WorldState& state);

BTGPU_TRANSLATION_END
