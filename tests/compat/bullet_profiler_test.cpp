// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// An application's own profiler behind Bullet's functions: what it is told of stock, and of btgpu.
#include <LinearMath/btQuickprof.h>
#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "tests/support/subprocess.h"
#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

// What the application's functions were told.
struct Told {
  std::vector<std::string> open;
  std::map<std::string, int> paths;  // how often each was entered
  int enters = 0, leaves = 0, tooManyLeaves = 0, otherThreads = 0;
  std::thread::id thread = std::this_thread::get_id();
};
Told* told = nullptr;

void enter(const char* name) {
  if (std::this_thread::get_id() != told->thread) ++told->otherThreads;
  ++told->enters;
  told->open.push_back(name);
  std::string path;
  for (const auto& zone : told->open) path += (path.empty() ? "" : "/") + zone;
  ++told->paths[path];
}
void leave() {
  ++told->leaves;
  if (told->open.empty()) {
    ++told->tooManyLeaves;
  } else {
    told->open.pop_back();
  }
}

// The application's profiler, for as long as it lives.
class Profiler {
 public:
  explicit Profiler(Told& to)
      : m_enter(btGetCurrentEnterProfileZoneFunc()), m_leave(btGetCurrentLeaveProfileZoneFunc()) {
    told = &to;
    btSetCustomEnterProfileZoneFunc(enter);
    btSetCustomLeaveProfileZoneFunc(leave);
  }
  ~Profiler() {
    btSetCustomEnterProfileZoneFunc(m_enter);
    btSetCustomLeaveProfileZoneFunc(m_leave);
    told = nullptr;
  }
  Profiler(const Profiler&) = delete;
  Profiler& operator=(const Profiler&) = delete;

 private:
  btEnterProfileZoneFunc* m_enter;
  btLeaveProfileZoneFunc* m_leave;
};

constexpr int kSteps = 10;

template <typename World>
void stepProfiled(World& run, Told& to) {
  scenes::find("stack")->build(run.objects, {2, 3, 2});
  const Profiler profiler(to);
  run.run(kSteps);
}

void expectBalanced(const Told& t) {
  EXPECT_GT(t.enters, 0);
  EXPECT_EQ(t.enters, t.leaves);
  EXPECT_EQ(t.tooManyLeaves, 0);
  EXPECT_EQ(t.otherThreads, 0);
  EXPECT_TRUE(t.open.empty());
}

// Without what an engine does for a profile, and what happens between steps.
std::map<std::string, int> stepsOf(const Told& t) {
  std::map<std::string, int> paths;
  for (const auto& [path, times] : t.paths) {
    const bool ofProfile = path.find("/collectTimes") != std::string::npos;
    if (path.rfind("stepSimulation", 0) == 0 && !ofProfile) paths[path] = times;
  }
  return paths;
}

int count(const Told& t, const std::string& path) {
  const auto it = t.paths.find(path);
  return it == t.paths.end() ? 0 : it->second;
}

TEST(BulletProfiler, StockAsTheOracle) {
  StockWorld run;
  Told t;
  stepProfiled(run, t);
  expectBalanced(t);
  EXPECT_EQ(count(t, "internalSingleStepSimulation"), kSteps);
  EXPECT_EQ(count(t, "internalSingleStepSimulation/solveConstraints"), kSteps);
}

TEST(BulletProfiler, DeviceSteps) {
  GpuWorld run;
  Told t;
  stepProfiled(run, t);
  expectAllOnDevice(run.world);
  expectBalanced(t);
  const std::string step = "stepSimulation/internalSingleStepSimulation";
  EXPECT_EQ(count(t, "stepSimulation"), kSteps);
  EXPECT_EQ(count(t, step), kSteps);
  EXPECT_EQ(count(t, "stepSimulation/synchronizeMotionStates"), kSteps);
  EXPECT_EQ(count(t, step + "/updateActions"), kSteps) << "Bullet's own, inside ours";
  EXPECT_EQ(count(t, step + "/readWorld"), kSteps);
  EXPECT_EQ(count(t, step + "/beginStep/launch/70_solve_velocities"), kSteps) << "the engine's, inside ours";
  EXPECT_EQ(count(t, step + "/finishStep/wait"), kSteps);
  for (const auto& [path, times] : t.paths) EXPECT_EQ(path.rfind("stepSimulation", 0), 0u) << path;
}

// On the stock path everything that stock tells is told, at the place that it has in stock.
TEST(BulletProfiler, StockStepsOfOurs) {
  btGpuSettings settings;
  settings.m_stockOnly = true;
  GpuWorld run(settings);
  StockWorld stock;
  Told ours, theirs;
  stepProfiled(run, ours);
  stepProfiled(stock, theirs);
  expectBalanced(ours);
  const std::string above = "stepSimulation/internalSingleStepSimulation/stockStep/";
  for (const auto& [path, times] : theirs.paths) EXPECT_EQ(count(ours, above + path), times) << path;
}

void switchOn(btDynamicsWorld*, btScalar) {
  btSetCustomEnterProfileZoneFunc(enter);
  btSetCustomLeaveProfileZoneFunc(leave);
}

// Bullet's own zones that are open when the functions change are not balanced in stock either; ours may not add to it.
TEST(BulletProfiler, SwitchedOnInTheMiddleOfAStep) {
  GpuWorld run;
  scenes::find("stack")->build(run.objects, {2, 2, 2});
  run.run(1);
  auto* enterBefore = btGetCurrentEnterProfileZoneFunc();
  auto* leaveBefore = btGetCurrentLeaveProfileZoneFunc();
  Told t;
  told = &t;
  run.world.setInternalTickCallback(switchOn, nullptr, true);
  run.run(1);
  run.world.setInternalTickCallback(nullptr, nullptr, true);
  run.run(3);
  btSetCustomEnterProfileZoneFunc(enterBefore);
  btSetCustomLeaveProfileZoneFunc(leaveBefore);
  told = nullptr;
  expectBalanced(t);
  EXPECT_EQ(count(t, "stepSimulation"), 3);
}

TEST(BulletProfiler, NobodyIsToldWithoutProfiler) {
  Told t;
  { const Profiler profiler(t); }
  GpuWorld run;
  scenes::find("stack")->build(run.objects, {2, 2, 2});
  run.run(3);
  EXPECT_EQ(t.enters, 0);
}

// Both at once: the file has Bullet's own zones, and the application is told of everything once.
TEST(BulletProfiler, WithAProfileFile) {
  const TemporaryFolder folder;
  btGpuSettings settings;
  settings.m_profileFile = folder.file("table.csv");
  Told plain, both, later;
  {
    GpuWorld run;
    stepProfiled(run, plain);
  }
  {
    const Profiler profiler(both);
    GpuWorld run(settings);
    scenes::find("stack")->build(run.objects, {2, 3, 2});
    run.run(kSteps);
  }
  {
    GpuWorld run(settings);  // the profiler comes after the file
    stepProfiled(run, later);
  }
  expectBalanced(both);
  expectBalanced(later);
  EXPECT_EQ(stepsOf(both), stepsOf(plain));
  EXPECT_EQ(stepsOf(later), stepsOf(plain));
  const std::string table = readFile(settings.m_profileFile);
  EXPECT_NE(table.find("\nhost,stepSimulation/internalSingleStepSimulation/updateActions,updateActions,2,10,"),
            std::string::npos)
      << table;
}

// An application whose profiler passes on to the one before it, over the life of several profiled worlds.
btEnterProfileZoneFunc* chainedEnter = nullptr;
btLeaveProfileZoneFunc* chainedLeave = nullptr;

TEST(BulletProfiler, ChainsNeverBecomeRings) {
  const TemporaryFolder folder;
  btGpuSettings settings;
  settings.m_profileFile = folder.file("trace.json");
  auto* enterBefore = btGetCurrentEnterProfileZoneFunc();
  auto* leaveBefore = btGetCurrentLeaveProfileZoneFunc();
  Told t;
  told = &t;
  {
    GpuWorld run(settings);
    chainedEnter = btGetCurrentEnterProfileZoneFunc();
    chainedLeave = btGetCurrentLeaveProfileZoneFunc();
    btSetCustomEnterProfileZoneFunc([](const char* name) { enter(name), chainedEnter(name); });
    btSetCustomLeaveProfileZoneFunc([] { leave(), chainedLeave(); });
    scenes::find("stack")->build(run.objects, {2, 2, 2});
    run.run(2);
  }
  for (int i = 0; i < 2; ++i) {
    GpuWorld run(settings);
    scenes::find("stack")->build(run.objects, {2, 2, 2});
    run.run(2);
  }
  btSetCustomEnterProfileZoneFunc(enterBefore);
  btSetCustomLeaveProfileZoneFunc(leaveBefore);
  told = nullptr;
  expectBalanced(t);
  EXPECT_EQ(count(t, "stepSimulation"), 6);
}

}  // namespace
}  // namespace btgpu::test
