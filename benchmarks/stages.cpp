// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Google Benchmark of the stages of a step: their time on the device by events, in steps of a whole world, one
// benchmark a scene, size and stage; and the share of what the device could do at most (roof.h, stage_work.h).
//   btgpu_stages [--bodies=1000,4000] [--scenes=stack,convex_pile,mixed] [Google Benchmark's own options]
#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <deque>
#include <map>
#include <sstream>

#include "compat/btGpuDynamicsWorld.h"
#include "samples/scenes/scene.h"
#include "stage_work.h"
#include "tests/support/world_of.h"

namespace {

using namespace btgpu;
using GpuWorld = btgpu::test::WorldOf<btGpuDynamicsWorld>;

constexpr int kWarmUp = 60, kSteps = 30;  // programs are built, things fall; then each step is a sample

// What the steps of one world took.
struct SteppedScene {
  std::string name;
  StepSize size;
  std::vector<std::string> stages;                     // in the order of the step
  std::map<std::string, std::vector<double>> seconds;  // by stage, one value a step
};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

StepSize::Shapes shapesOf(const scenes::Objects& objects) {
  bool boxes = false, hulls = false, others = false;
  for (const btRigidBody* body : objects.bodies()) {
    if (body->isStaticObject()) continue;
    const int type = body->getCollisionShape()->getShapeType();
    boxes |= type == BOX_SHAPE_PROXYTYPE;
    hulls |= type == CONVEX_HULL_SHAPE_PROXYTYPE;
    others |= type != BOX_SHAPE_PROXYTYPE && type != CONVEX_HULL_SHAPE_PROXYTYPE;
  }
  if (others || (boxes && hulls)) return StepSize::Shapes::Several;
  return boxes ? StepSize::Shapes::Boxes : StepSize::Shapes::Convex;
}

SteppedScene stepScene(const scenes::Scene& scene, int bodies) {
  btGpuSettings settings;
  settings.m_profile = true;
  settings.m_hostQueries = false;
  GpuWorld run(settings);
  scene.build(run.objects, scene.benchmark.sizeFor(bodies));
  for (btRigidBody* body : run.objects.bodies()) {
    if (!body->isStaticObject()) body->setActivationState(DISABLE_DEACTIVATION);
  }
  run.run(kWarmUp, scene.timeStep);
  run.world.takeProfile();
  SteppedScene stepped;
  for (int step = 0; step < kSteps; ++step) {
    run.run(1, scene.timeStep);
    for (const btGpuStageTime& t : run.world.takeProfile()) {
      if (stepped.seconds.count(t.m_stage) == 0) stepped.stages.push_back(t.m_stage);
      stepped.seconds[t.m_stage].push_back(t.m_milliseconds * 1e-3);
    }
  }
  const btGpuStatistics s = run.world.statistics();
  if (s.m_stockSteps > 0) throw std::runtime_error(scene.name + ": some steps ran on the CPU");
  stepped.name = fmt::format("{}/{}", scene.name, run.world.getNumCollisionObjects());
  stepped.size = {double(run.world.getNumCollisionObjects()),
                  double(s.m_pairs),
                  double(s.m_contactManifolds),
                  double(s.m_contactPoints),
                  double(run.world.getSolverInfo().m_numIterations),
                  shapesOf(run.objects)};
  return stepped;
}

void addStage(const SteppedScene& scene, const std::string& stage, const Roof& roof) {
  const std::vector<double>& seconds = scene.seconds.at(stage);
  benchmark::RegisterBenchmark((scene.name + "/" + stage).c_str(),
                               [&scene, &seconds, stage, roof](benchmark::State& state) {
                                 size_t i = 0;
                                 double sum = 0;
                                 for (auto _ : state) {
                                   state.SetIterationTime(seconds[i]);
                                   sum += seconds[i++];
                                 }
                                 reportRoof(state, roof, workOf(stage, scene.size), sum / double(i));
                               })
      ->UseManualTime()
      ->Iterations(static_cast<benchmark::IterationCount>(seconds.size()))
      ->Unit(benchmark::kMicrosecond);
}

// Takes "--name=value" out of the arguments.
std::string takeOption(int& count, char** arguments, const std::string& name, const std::string& otherwise) {
  const std::string start = "--" + name + "=";
  for (int i = 1; i < count; ++i) {
    if (std::strncmp(arguments[i], start.c_str(), start.size()) != 0) continue;
    const std::string value = arguments[i] + start.size();
    for (int k = i; k + 1 < count; ++k) arguments[k] = arguments[k + 1];
    --count;
    return value;
  }
  return otherwise;
}

std::deque<SteppedScene> stepScenes(const std::string& names, const std::string& bodies) {
  std::deque<SteppedScene> stepped;  // the benchmarks keep references
  for (const std::string& name : split(names)) {
    const scenes::Scene* scene = scenes::find(name);
    if (!scene || !scene->benchmark.sizeFor) throw std::runtime_error("no scene of many sizes named " + name);
    for (const std::string& count : split(bodies)) stepped.push_back(stepScene(*scene, std::stoi(count)));
  }
  return stepped;
}

}  // namespace

int main(int count, char** arguments) {
  const std::string names = takeOption(count, arguments, "scenes", "stack,convex_pile,mixed");
  const std::string bodies = takeOption(count, arguments, "bodies", "1000,4000");
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 2;
  try {
    const auto device = ComputeDevice::open("");
    Queue queue(device, true);
    const Roof roof = measureRoof(queue);
    describeRoof(*device, roof);
    const std::deque<SteppedScene> scenes = stepScenes(names, bodies);
    for (const SteppedScene& scene : scenes) {
      for (const std::string& stage : scene.stages) addStage(scene, stage, roof);
    }
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& e) {
    fmt::print(stderr, "stages: {}\n", e.what());
    return 1;
  }
  return 0;
}
