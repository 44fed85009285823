// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "stage_times.h"

#include <LinearMath/btQuickprof.h>

#include <chrono>
#include <cstdlib>
#include <map>

namespace btgpu::tool {
namespace {

using Clock = std::chrono::steady_clock;

// The stages of a phase by their numbers, and what stock calls the same part, if it has it.
struct PhaseOf {
  const char* name;
  int firstStage, lastStage;
  const char *zone, *secondZone = nullptr;
};
constexpr PhaseOf kPhases[] = {
    {"Forces", 10, 14, "predictUnconstraintMotion"},
    {"Predictive contacts", 15, 19, "createPredictiveContacts"},
    // Stock's tree finds most pairs while the bounds are updated.
    {"Bounds and pairs", 20, 39, "updateAabbs", "calculateOverlappingPairs"},
    {"Contacts", 40, 51, "dispatchAllCollisionPairs"},
    {"Islands", 55, 59, "calculateSimulationIslands"},
    {"Solver", 60, 79, "solveConstraints"},
    {"Motion", 80, 89, "integrateTransforms"},
    {"Sleeping", 90, 94, "updateActivationState"},
    {"Contacts for the host", 95, 99, nullptr},
};

// Bullet calls plain functions, so there is one recorder at a time.
class ZoneRecorder {
 public:
  ZoneRecorder() : m_enter(btGetCurrentEnterProfileZoneFunc()), m_leave(btGetCurrentLeaveProfileZoneFunc()) {
    s_current = this;
    btSetCustomEnterProfileZoneFunc([](const char* name) { s_current->m_open.push_back({name, Clock::now()}); });
    btSetCustomLeaveProfileZoneFunc([] { s_current->leave(); });
  }
  ~ZoneRecorder() {
    btSetCustomEnterProfileZoneFunc(m_enter);
    btSetCustomLeaveProfileZoneFunc(m_leave);
    s_current = nullptr;
  }
  ZoneRecorder(const ZoneRecorder&) = delete;
  ZoneRecorder& operator=(const ZoneRecorder&) = delete;

  double milliseconds(const std::string& zone) const {
    const auto it = m_milliseconds.find(zone);
    return it == m_milliseconds.end() ? 0 : it->second;
  }

 private:
  struct Open {
    const char* name;
    Clock::time_point since;
  };

  void leave() {
    if (m_open.empty()) return;
    const Open zone = m_open.back();
    m_open.pop_back();
    m_milliseconds[zone.name] += std::chrono::duration<double, std::milli>(Clock::now() - zone.since).count();
  }

  static ZoneRecorder* s_current;
  btEnterProfileZoneFunc* m_enter;
  btLeaveProfileZoneFunc* m_leave;
  std::vector<Open> m_open;
  std::map<std::string, double> m_milliseconds;
};
ZoneRecorder* ZoneRecorder::s_current = nullptr;

double timeOf(const std::vector<btGpuStageTime>& stages, const PhaseOf& phase) {
  double sum = 0;
  for (const btGpuStageTime& t : stages) {
    const int number = std::atoi(t.m_stage.c_str());
    // 52 prepares rows, which stock does in its solver.
    const bool prepares = number >= 52 && number < 55 && phase.firstStage == 60;
    if (prepares || (number >= phase.firstStage && number <= phase.lastStage)) sum += t.m_milliseconds;
  }
  return sum;
}

double timeOf(const ZoneRecorder& zones, const PhaseOf& phase) {
  double sum = 0;
  for (const char* zone : {phase.zone, phase.secondZone}) sum += zone ? zones.milliseconds(zone) : 0;
  return sum;
}

}  // namespace

StageTimes measureStages(const Builder& build, const btGpuSettings& settings, btScalar timeStep, int steps) {
  StageTimes times;
  times.steps = steps;
  btGpuSettings timed = settings;
  timed.m_profile = true;
  timed.m_keepContacts = false;
  TestWorld<btGpuDynamicsWorld> gpu(build, timed);
  for (int step = 0; step < steps; ++step) gpu.world().stepSimulation(timeStep, 0);
  times.stages = gpu.world().takeProfile();

  TestWorld<btDiscreteDynamicsWorld> stock(build);
  const ZoneRecorder zones;
  for (int step = 0; step < steps; ++step) stock.world().stepSimulation(timeStep, 0);
  for (const PhaseOf& phase : kPhases) {
    const double ours = timeOf(times.stages, phase) / steps, theirs = timeOf(zones, phase) / steps;
    if (ours + theirs > 0) times.phases.push_back({phase.name, ours, theirs});
  }
  return times;
}

}  // namespace btgpu::tool
