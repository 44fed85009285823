// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Profiles of whole worlds: what is in them, and that they change nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "compat/world_state.h"
#include "tests/support/scoped_environment.h"
#include "tests/support/subprocess.h"
#include "tests/support/test_world.h"
#include "tests/support/world_hash.h"

namespace btgpu::test {
namespace {

using nlohmann::json;
constexpr int kSteps = 20;

std::unique_ptr<GpuWorld> worldOf(const btGpuSettings& settings, const std::string& scene = "stack") {
  auto run = std::make_unique<GpuWorld>(settings);
  scenes::find(scene)->build(run->objects, {3, 3, 3});
  return run;
}

btGpuSettings profiledTo(const std::string& file) {
  btGpuSettings settings;
  settings.m_profileFile = file;
  return settings;
}

std::vector<json> eventsOf(const json& trace, const std::string& category) {
  std::vector<json> events;
  for (const auto& e : trace.at("traceEvents")) {
    if (e.value("cat", "") == category) events.push_back(e);
  }
  return events;
}

std::map<std::string, int> namesOf(const std::vector<json>& events) {
  std::map<std::string, int> names;
  for (const auto& e : events) ++names[e["name"].get<std::string>()];
  return names;
}

double startOf(const json& e) { return e["ts"].get<double>(); }
double endOf(const json& e) { return startOf(e) + e["dur"].get<double>(); }
constexpr double kPrinted = 2e-3;  // microseconds: start and duration are each printed to the nanosecond

// Each pair of zones of a thread lies one inside the other or apart.
void expectNested(std::vector<json> events) {
  std::map<int, std::vector<json>> threads;
  for (const auto& e : events) threads[e["tid"].get<int>()].push_back(e);
  for (auto& [thread, zones] : threads) {
    std::stable_sort(zones.begin(), zones.end(), [](const json& a, const json& b) {
      return startOf(a) != startOf(b) ? startOf(a) < startOf(b) : endOf(a) > endOf(b);
    });
    std::vector<const json*> open;
    for (const json& zone : zones) {
      while (!open.empty() && endOf(*open.back()) <= startOf(zone) + kPrinted) open.pop_back();
      if (!open.empty()) {
        EXPECT_LE(endOf(zone), endOf(*open.back()) + kPrinted) << zone["name"] << " in " << (*open.back())["name"];
      }
      open.push_back(&zone);
    }
  }
}

json traceOf(const std::string& scene, int steps = kSteps) {
  const TemporaryFolder folder;
  const std::string path = folder.file("trace.json");
  {
    const auto run = worldOf(profiledTo(path), scene);
    run->run(steps);
    EXPECT_EQ(run->world.statistics().m_stockSteps, 0u) << "no step may be stock's";
  }
  return json::parse(readFile(path));
}

TEST(ProfiledWorld, ZonesAreThereAndNest) {
  const json trace = traceOf("ragdoll");
  const auto host = eventsOf(trace, "host");
  const auto names = namesOf(host);
  for (const char* each : {"stepSimulation",
                           "saveKinematicState",
                           "applyGravity",
                           "internalSingleStepSimulation",
                           "readWorld",
                           "convertJoints",
                           "beginStep",
                           "upload",
                           "launch",
                           "70_solve_velocities",
                           "hostBroadphase",
                           "updateAabbs",
                           "calculateOverlappingPairs",
                           "finishStep",
                           "wait",
                           "download",
                           "writeBackContacts",
                           "writeBackJoints",
                           "writeBackBodies",
                           "updateActions",
                           "synchronizeMotionStates",
                           "clearForces"}) {
    EXPECT_TRUE(names.count(each) && names.at(each) >= kSteps) << each;
  }
  EXPECT_EQ(names.at("stepSimulation"), kSteps);
  EXPECT_EQ(names.at("createEngine"), 1);
  // The first step meets the objects, the others know them.
  for (const char* each : {"findObjects", "readShapes", "readBodies"}) EXPECT_GE(names.at(each), 1) << each;
  EXPECT_GE(names.at("readKnown"), kSteps - 2);
  EXPECT_EQ(trace["otherData"]["steps"], kSteps);
  expectNested(host);
  // Everything is inside a stepSimulation.
  std::vector<json> outer;
  std::copy_if(host.begin(), host.end(), std::back_inserter(outer),
               [](const json& e) { return e["name"] == "stepSimulation"; });
  for (const auto& e : host) {
    EXPECT_TRUE(std::any_of(outer.begin(), outer.end(), [&](const json& o) {
      return startOf(o) <= startOf(e) + kPrinted && endOf(e) <= endOf(o) + kPrinted;
    })) << e;
  }
}

// All stages that the host launched ran on the device, inside the steps that launched them as far as the clocks agree.
TEST(ProfiledWorld, DeviceSlicesOfEachStageOnTheHostsAxis) {
  const json trace = traceOf("mixed");
  const auto host = eventsOf(trace, "host"), device = eventsOf(trace, "device");
  std::set<std::string> launched, ran;
  double firstStep = 1e30, lastStep = 0;
  for (const auto& e : host) {
    const std::string name = e["name"];
    if (std::isdigit(static_cast<unsigned char>(name[0]))) launched.insert(name);
    if (name != "stepSimulation") continue;
    firstStep = std::min(firstStep, startOf(e));
    lastStep = std::max(lastStep, endOf(e));
  }
  for (const auto& e : device) ran.insert(e["args"]["stage"].get<std::string>());
  EXPECT_EQ(launched, ran);
  EXPECT_GE(ran.size(), 14u);
  EXPECT_EQ(trace["otherData"]["lostLaunches"], 0);
  const double accuracy = trace["otherData"]["deviceClockAccuracyUs"].get<double>() + kPrinted;
  EXPECT_LT(accuracy, 5000.0);
  double before = 0;
  for (const auto& e : device) {
    const double queued = e["args"]["queuedUs"], submitted = e["args"]["submittedUs"];
    EXPECT_LE(queued, submitted + kPrinted);
    EXPECT_LE(submitted, startOf(e) + kPrinted);
    EXPECT_GE(startOf(e), firstStep - accuracy);
    EXPECT_LE(endOf(e), lastStep + accuracy);
    EXPECT_GE(startOf(e), before - kPrinted) << "one queue, in order";
    before = endOf(e);
  }
}

// The last launch of a step has ended when the host's wait for it has.
TEST(ProfiledWorld, WaitsCoverTheLaunchesWaitedFor) {
  const json trace = traceOf("stack");
  const double accuracy = trace["otherData"]["deviceClockAccuracyUs"].get<double>() + kPrinted;
  std::vector<json> begins, waits;
  for (const auto& e : eventsOf(trace, "host")) {
    if (e["name"] == "launch") begins.push_back(e);
    if (e["name"] == "wait") waits.push_back(e);
  }
  const auto device = eventsOf(trace, "device");
  ASSERT_GE(waits.size(), size_t{kSteps});
  int solved = 0;
  for (const auto& e : device) {
    if (e["args"]["stage"] != "70_solve_velocities") continue;
    ++solved;
    const bool inside = std::any_of(begins.begin(), begins.end(), [&](const json& begin) {
      const auto wait =
          std::find_if(waits.begin(), waits.end(), [&](const json& w) { return startOf(w) > startOf(begin); });
      return wait != waits.end() && startOf(begin) - accuracy <= startOf(e) && endOf(e) <= endOf(*wait) + accuracy;
    });
    EXPECT_TRUE(inside) << e;
  }
  EXPECT_GE(solved, kSteps);
}

std::uint64_t hashOf(const btGpuSettings& settings, int substeps = 1) {
  const auto run = worldOf(settings, "mixed");
  WorldHash hash;
  for (int i = 0; i < 60; ++i) {
    run->world.stepSimulation(btScalar(substeps / 60.0), substeps, btScalar(1.0 / 60));
    hash.add(run->world);
  }
  EXPECT_EQ(run->world.statistics().m_stockSteps, 0u);
  return hash.value();
}

TEST(ProfiledWorld, SameBits) {
  const TemporaryFolder folder;
  EXPECT_EQ(hashOf({}), hashOf(profiledTo(folder.file("one.json"))));
  EXPECT_EQ(hashOf({}, 3), hashOf(profiledTo(folder.file("three.json")), 3)) << "the device runs ahead";
}

TEST(ProfiledWorld, NothingIsRecordedUnlessAskedFor) {
  const auto run = worldOf({});
  run->run(2);
  const auto state = findState(&run->world);
  EXPECT_EQ(state->zones.profile(), nullptr);
  EXPECT_EQ(state->zones.wanted(), nullptr);
  EXPECT_TRUE(run->world.takeProfile().empty());
}

TEST(ProfiledWorld, EnvironmentVariableAndTable) {
  const TemporaryFolder folder;
  const std::string path = folder.file("table.csv");
  {
    const ScopedVariable variable("BTGPU_PROFILE", path);
    const auto run = worldOf({});
    run->run(kSteps);
  }
  const std::string table = readFile(path);
  EXPECT_EQ(table.rfind("row,path,name,depth,calls,totalMs,msPerStep,selfMs,share\n", 0), 0u) << table;
  EXPECT_NE(table.find("\nhost,stepSimulation,stepSimulation,0,20,"), std::string::npos) << table;
  EXPECT_NE(table.find("\nhost,stepSimulation/internalSingleStepSimulation/beginStep/launch,launch,3,20,"),
            std::string::npos)
      << table;
  EXPECT_NE(table.find("\ndevice,70_solve_velocities/"), std::string::npos) << table;
}

TEST(ProfiledWorld, StockStepsShowBulletsOwnZones) {
  const TemporaryFolder folder;
  const std::string path = folder.file("trace.json");
  {
    btGpuSettings settings = profiledTo(path);
    settings.m_stockOnly = true;
    worldOf(settings)->run(kSteps);
  }
  const auto names = namesOf(eventsOf(json::parse(readFile(path)), "host"));
  for (const char* zone : {"stockStep", "solveConstraints", "integrateTransforms", "calculateSimulationIslands"}) {
    EXPECT_TRUE(names.count(zone) && names.at(zone) == kSteps) << zone;
  }
}

TEST(ProfiledWorld, WorldsOnThreadsShareAFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("trace.json");
  const auto runOne = [&] { worldOf(profiledTo(path))->run(kSteps); };
  {
    const auto keep = worldOf(profiledTo(path));
    std::thread a(runOne), b(runOne);
    a.join();
    b.join();
  }
  const json trace = json::parse(readFile(path));
  const auto host = eventsOf(trace, "host");
  EXPECT_EQ(namesOf(host).at("stepSimulation"), 2 * kSteps);
  expectNested(host);
  std::set<int> rows;
  for (const auto& e : eventsOf(trace, "device")) rows.insert(e["tid"].get<int>());
  EXPECT_EQ(rows.size(), 2u) << "a row a queue";
}

TEST(ProfiledWorld, SettingsMayChangeBetweenAndInsideSteps) {
  const TemporaryFolder folder;
  const std::string first = folder.file("first.json"), second = folder.file("second.json");
  const auto run = worldOf({});
  run->run(2);
  btGpuDynamicsWorld::configure(&run->world, profiledTo(first));
  run->run(3);
  run->world.setInternalTickCallback(
      [](btDynamicsWorld* world, btScalar) {
        auto* settings = static_cast<btGpuSettings*>(world->getWorldUserInfo());
        btGpuDynamicsWorld::configure(static_cast<btGpuDynamicsWorld*>(world), *settings);
      },
      nullptr);
  btGpuSettings next = profiledTo(second);
  run->world.setWorldUserInfo(&next);
  run->run(4);
  run->world.setInternalTickCallback(nullptr);
  btGpuDynamicsWorld::configure(&run->world, {});
  run->run(5);
  const auto zonesIn = [](const std::string& path) { return namesOf(eventsOf(json::parse(readFile(path)), "host")); };
  EXPECT_EQ(zonesIn(first).at("readWorld"), 4);
  EXPECT_EQ(zonesIn(second).at("readWorld"), 3);
  EXPECT_EQ(zonesIn(second).at("stepSimulation"), 3);
  expectAllOnDevice(run->world);
}

TEST(ProfiledWorld, IsWrittenAtExitWithoutTheWorldsEnd) {
  const TemporaryFolder folder;
  const std::string path = folder.file("trace.json");
  const Finished run = runProgram({BTGPU_PROFILE_APP}, {{"BTGPU_PROFILE=" + path}});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const json trace = json::parse(readFile(path));
  EXPECT_EQ(namesOf(eventsOf(trace, "host")).at("stepSimulation"), 5);
  EXPECT_FALSE(eventsOf(trace, "device").empty());
}

TEST(ProfiledWorld, IsValidEvenIfTheProcessJustEnds) {
  const TemporaryFolder folder;
  const std::string path = folder.file("trace.json");
  const Finished run = runProgram({BTGPU_PROFILE_APP, "quick_exit"}, {{"BTGPU_PROFILE=" + path}});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_TRUE(json::parse(readFile(path)).at("traceEvents").is_array());
}

}  // namespace
}  // namespace btgpu::test
