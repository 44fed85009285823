// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "compare.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "compat/world_state.h"
#include "report/picture.h"
#include "splitting_check.h"

namespace btgpu::tool {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kStageSteps = 120;  // of the run in which the stages are timed

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Steps after which the distance to the converged solution is measured: each costs a hundred ordinary steps.
bool measureConverged(int step, int steps, int bodies) {
  const int samples = bodies < 300 ? 20 : 3;
  const int every = std::max(1, steps / (samples + 1));
  return step > 0 && step % every == 0;
}

void addScalars(XXH3_state_t& state, const btVector3& v) { XXH3_64bits_update(&state, &v, 3 * sizeof(btScalar)); }

// A value that JSON can hold: it has no NaN and no infinity.
nlohmann::json number(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr); }

nlohmann::json figuresJson(const RunStatistics& run, double msPerStep) {
  const WorldFigures& f = run.end;
  return {{"msPerStep", msPerStep},
          {"kineticEnergy", number(f.kineticEnergy)},
          {"meanHeight", number(f.meanHeight)},
          {"potentialEnergy", number(f.potentialEnergy)},
          {"momentum", number(f.momentum)},
          {"sleeping", f.sleeping},
          {"belowGround", f.belowGround},
          {"restingEnergy", number(run.restingEnergy)},
          {"penetration99", number(run.depth99())}};
}

// Checks that ask how near a step is to what Bullet's own rows want, and motion to what comes of them: the fast mode has
// rows of its own.
bool isOfBulletsRows(const std::string& check) {
  return check == "solver.single_velocity" || check == "solver.residual" || check == "solver.distance_to_converged" ||
         check == "free.position";
}

void drawEnds(const btDiscreteDynamicsWorld& gpu, const btDiscreteDynamicsWorld& stock, ReportData& report) {
  constexpr int kWidth = 960, kHeight = 640;
  const Camera camera = cameraFor({&gpu, &stock}, kWidth, kHeight);
  report.gpuEnd = drawWorld(gpu, camera, kWidth, kHeight);
  report.stockEnd = drawWorld(stock, camera, kWidth, kHeight);
}

}  // namespace

long undeclaredFallbacks(const std::vector<btGpuFallback>& fallbacks, const std::vector<std::string>& shares) {
  const auto declared = [&shares](const std::string& what) {
    return std::any_of(shares.begin(), shares.end(), [&](const std::string& s) { return s == "*" || s == what; });
  };
  return std::count_if(fallbacks.begin(), fallbacks.end(),
                       [&](const btGpuFallback& f) { return f.m_wholeStep || !declared(f.m_what); });
}

bool CompareResult::pass() const {
  return compared && std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.pass(); });
}

std::uint64_t hashBodies(const btCollisionWorld& world) {
  XXH3_state_t* state = XXH3_createState();
  XXH3_64bits_reset(state);
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    const btCollisionObject* o = world.getCollisionObjectArray()[i];
    for (int row = 0; row < 3; ++row) addScalars(*state, o->getWorldTransform().getBasis()[row]);
    addScalars(*state, o->getWorldTransform().getOrigin());
    if (const btRigidBody* body = btRigidBody::upcast(o)) {
      addScalars(*state, body->getLinearVelocity());
      addScalars(*state, body->getAngularVelocity());
    }
  }
  const std::uint64_t hash = XXH3_64bits_digest(state);
  XXH3_freeState(state);
  return hash;
}

CompareResult compare(const std::string& name, const Builder& build, const scenes::Expectations& expectations,
                      const CompareOptions& options) {
  const int steps = options.steps;
  btGpuSettings settings;
  settings.m_device = options.device;
  settings.m_solver = options.solver;
  settings.m_hostStages = options.hostStages;
  settings.m_profile = options.profile;
  settings.m_smallWorld = 0;
  settings.m_keepContacts = true;
  TestWorld<btGpuDynamicsWorld> gpu(build, settings);
  const btScalar dt = static_cast<btScalar>(options.timeStep);
  OneStepComparison oneStep(build, expectations, dt);
  FreeRunComparison freeRun(build, expectations, steps);
  std::optional<SplittingCheck> splitting;
  if (options.solver == btGpuSolver::MassSplitting) splitting.emplace(build, options.device);

  CompareResult result;
  result.scene = name;
  result.bodies = gpu.world().getNumCollisionObjects();
  result.steps = steps;
  const auto state = findState(&gpu.world());
  for (int step = 0; step < steps; ++step) {
    oneStep.beforeStep(gpu.world());
    const bool converged = measureConverged(step, steps, result.bodies);
    std::optional<StepStart> start;
    const auto gpuStart = Clock::now();
    const auto stepGpu = [&] { gpu.world().stepSimulation(dt, 0); };
    if (splitting && converged && state->engine) {
      start = recordStep(gpu.world(), stepGpu);
    } else {
      stepGpu();
    }
    const double gpuTime = millisecondsSince(gpuStart);
    const double stockTime = freeRun.stepStock(dt);
    if (step > 0) {
      result.gpuMsPerStep += gpuTime / (steps - 1);
      result.cpuMsPerStep += stockTime / (steps - 1);
    }
    // Once a step ran on the stock path there is nothing left to compare.
    if (gpu.world().statistics().m_stockSteps > 0) break;
    oneStep.afterStep(gpu.world(), state->reader.input(), state->results, converged);
    if (start) splitting->compare(*start, state->results);
    freeRun.afterStep(step, gpu.world(), state->results);
    if (options.report) {
      oneStep.addTo(result.report.series);
      freeRun.addTo(result.report.series, gpu.world(), state->results);
      result.report.series.gpu.milliseconds.push_back(gpuTime);
      result.report.series.stock.milliseconds.push_back(stockTime);
    }
    if (options.progress) options.progress(step + 1);
  }

  const btGpuStatistics statistics = gpu.world().statistics();
  result.device = statistics.m_device;
  result.deviceSteps = static_cast<int>(statistics.m_deviceSteps);
  result.repeatedSteps = static_cast<int>(statistics.m_repeatedSteps);
  result.fallbacks = gpu.world().fallbackReport();
  result.profile = gpu.world().takeProfile();
  result.hash = hashBodies(gpu.world());
  result.compared = result.deviceSteps > 0;
  result.checks.push_back(makeCheck("device.missing_steps", steps - result.deviceSteps));
  result.checks.push_back(makeCheck(
      "device.fallbacks", static_cast<double>(undeclaredFallbacks(result.fallbacks, expectations.cpuShares))));
  if (result.deviceSteps == steps) {
    for (const auto& list : {freeRun.checks(), oneStep.checks()}) {
      std::copy_if(list.begin(), list.end(), std::back_inserter(result.checks),
                   [&](const Check& c) { return options.solver != btGpuSolver::Fast || !isOfBulletsRows(c.name); });
    }
    if (splitting) {
      liftLimitsOfIterations(result.checks);
      const std::vector<Check> more = splitting->checks();
      result.checks.insert(result.checks.end(), more.begin(), more.end());
    }
    result.gpu = freeRun.gpu();
    result.stock = freeRun.stock();
  }
  if (options.report) {
    result.report.timeStep = options.timeStep;
    drawEnds(gpu.world(), freeRun.stockWorld(), result.report);
    if (result.compared) result.report.stages = measureStages(build, settings, dt, std::min(steps, kStageSteps));
  }
  return result;
}

std::string toText(const CompareResult& r) {
  std::string text = fmt::format("{}: {} bodies, {} steps, {} on {}\n", r.scene, r.bodies, r.steps, r.deviceSteps,
                                 r.device.empty() ? "no device" : r.device);
  text += fmt::format("  {:<30} {:>12} {:>12}\n", "", "btgpu", "stock");
  const auto row = [&text](const char* what, double a, double b) {
    text += fmt::format("  {:<30} {:>12.5g} {:>12.5g}\n", what, a, b);
  };
  row("ms a step", r.gpuMsPerStep, r.cpuMsPerStep);
  row("mean height", r.gpu.end.meanHeight, r.stock.end.meanHeight);
  row("kinetic energy a body", r.gpu.end.kineticEnergy, r.stock.end.kineticEnergy);
  row("  mean of the last 60 steps", r.gpu.restingEnergy, r.stock.restingEnergy);
  row("penetration, 99th percentile", r.gpu.depth99(), r.stock.depth99());
  row("bodies below the ground", r.gpu.end.belowGround, r.stock.end.belowGround);
  row("sleeping bodies", r.gpu.end.sleeping, r.stock.end.sleeping);
  text += fmt::format("  {:<30} {:>12} {:>12}\n", "check", "value", "limit");
  for (const Check& c : r.checks) {
    text += fmt::format("  {:<30} {:>12.5g} {:>12.5g}  {}\n", c.name, c.value, c.limit, c.pass() ? "ok" : "FAILED");
  }
  if (!r.profile.empty()) text += fmt::format("  {:<30} {:>12} {:>12}\n", "stage", "ms a step", "launches");
  for (const auto& t : r.profile) {
    text += fmt::format("  {:<30} {:>12.4f} {:>12.1f}\n", t.m_stage, t.m_milliseconds / r.steps,
                        double(t.m_launches) / r.steps);
  }
  for (const auto& f : r.fallbacks)
    text += fmt::format("  {}: {} ({}), {} times\n", f.m_wholeStep ? "step on the CPU" : "on the CPU", f.m_what,
                        f.m_reason, f.m_count);
  text += !r.compared ? "not compared: no step ran on a device\n" : r.pass() ? "in agreement\n" : "NOT in agreement\n";
  return text;
}

std::string toJson(const CompareResult& r) {
  nlohmann::json checks = nlohmann::json::array(), fallbacks = nlohmann::json::array();
  for (const Check& c : r.checks) {
    checks.push_back({{"name", c.name}, {"value", number(c.value)}, {"limit", number(c.limit)}, {"pass", c.pass()}});
  }
  for (const auto& f : r.fallbacks)
    fallbacks.push_back(
        {{"what", f.m_what}, {"reason", f.m_reason}, {"count", f.m_count}, {"wholeStep", f.m_wholeStep}});
  const nlohmann::json json = {{"scene", r.scene},
                               {"bodies", r.bodies},
                               {"steps", r.steps},
                               {"deviceSteps", r.deviceSteps},
                               {"repeatedSteps", r.repeatedSteps},
                               {"device", r.device},
                               {"compared", r.compared},
                               {"pass", r.pass()},
                               {"hash", fmt::format("{:016x}", r.hash)},
                               {"checks", checks},
                               {"cpu", figuresJson(r.stock, r.cpuMsPerStep)},
                               {"gpu", figuresJson(r.gpu, r.gpuMsPerStep)},
                               {"fallbacks", fallbacks}};
  // A file's name may be no UTF-8.
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace btgpu::tool
