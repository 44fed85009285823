// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "convergence.h"

#include <cstring>
#include <numeric>

#include "bullet_file.h"
#include "compat/engine_loader.h"
#include "compat/world_state.h"
#include "translation/contacts.h"
#include "translation/convert.h"
#include "translation/oracle/residuals.h"

namespace btgpu::tool {
namespace {

constexpr int kConvergedIterations = 1000;

// What a step starts from.
struct StepStart {
  WorldInput input;
  StepSettings settings;
  std::vector<Manifold> cache;  // manifolds after the step before
  std::vector<BodyState> states;
  std::vector<JointState> joints;
};

// Passes everything on, and keeps what the step was begun with.
class RecordingEngine : public Engine {
 public:
  RecordingEngine(std::unique_ptr<Engine> engine, StepStart& start) : m_engine(std::move(engine)), m_start(start) {}
  Status beginStep(const WorldInput& input, const StepSettings& settings) noexcept override {
    m_start.input = input;
    m_start.settings = settings;
    m_engine->readManifolds(m_start.cache);
    return m_engine->beginStep(input, settings);
  }
  Status finishStep(StepResults& results) noexcept override { return m_engine->finishStep(results); }
  Status readManifolds(std::vector<Manifold>& manifolds) noexcept override {
    return m_engine->readManifolds(manifolds);
  }
  void reset() noexcept override { m_engine->reset(); }
  EngineInfo info() const noexcept override { return m_engine->info(); }
  std::vector<StageProfile> takeProfile() noexcept override { return m_engine->takeProfile(); }
  void setZoneSink(ZoneSink* sink) noexcept override { m_engine->setZoneSink(sink); }
  std::string lastError() const noexcept override { return m_engine->lastError(); }

 private:
  std::unique_ptr<Engine> m_engine;
  StepStart& m_start;
};

template <typename T>
void markAll(Tracked<T>& array) {
  array.changed.resize(array.values.size());
  std::iota(array.changed.begin(), array.changed.end(), 0u);
}

// So that an engine that knows nothing, or has gone on, starts from there.
void makeComplete(StepStart& start) {
  WorldInput& in = start.input;
  markAll(in.infos);
  markAll(in.poses);
  markAll(in.velocities);
  markAll(in.forces);
  markAll(in.masses);
  markAll(in.materials);
  markAll(in.dampings);
  markAll(in.activations);
  markAll(in.shapes);
  in.hulls.changed = true;
  in.born.clear();
  in.replaceManifolds = true;
  in.manifolds = start.cache;
  start.settings.keepContacts = true;
  start.settings.contacts = false;
  start.settings.substepsToFollow = 0;
}

StepStart runScene(const Builder& build, const ConvergenceOptions& options, ConvergenceResult& result) {
  btGpuSettings settings;
  settings.m_device = options.device;
  settings.m_solver = btGpuSolver::Parity;
  settings.m_smallWorld = 0;
  TestWorld<btGpuDynamicsWorld> gpu(build, settings);
  btGpuDynamicsWorld& world = gpu.world();
  const btScalar dt = static_cast<btScalar>(options.timeStep);
  for (int step = 0; step < options.steps; ++step) world.stepSimulation(dt, 0);
  const auto state = findState(&world);
  if (!state->engine || world.statistics().m_stockSteps > 0) {
    throw InputError("the scene does not run on the device; 'btgpu compare' says why");
  }
  StepStart start;
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    start.states.push_back(captureState(*world.getCollisionObjectArray()[i]));
  }
  start.joints = captureJoints(world);
  state->engine = std::make_unique<RecordingEngine>(std::move(state->engine), start);
  world.stepSimulation(dt, 0);
  result.device = world.statistics().m_device;
  result.bodies = world.getNumCollisionObjects();
  result.joints = static_cast<long>(start.input.joints.size());
  makeComplete(start);
  return start;
}

std::vector<Velocity> velocitiesOf(const StepResults& results) {
  std::vector<Velocity> velocities;
  for (const BodyVelocity& v : results.velocities) velocities.push_back({toBullet(v.linear), toBullet(v.angular)});
  return velocities;
}

struct Solved {
  std::vector<Manifold> manifolds;
  std::vector<Velocity> velocities;
};

// btgpu's solvers, each in an engine of its own.
class DeviceSolver {
 public:
  DeviceSolver(const StepStart& start, const std::string& device, Solver solver, GroupSplit split)
      : m_start(start), m_baseIterations(start.settings.iterations) {
    EngineSettings settings;
    settings.device = device;
    std::string error;
    m_engine = createEngine(settings, error);
    if (!m_engine) throw InputError(error);
    m_start.settings.solver = solver;
    m_start.settings.groupSplit = split;
  }
  Solved solve(int iterations) {
    m_start.settings.iterations = iterations;
    m_input = m_start.input;
    for (Joint& j : m_input.joints) {  // those that have no number of their own
      if (j.iterations == m_baseIterations) j.iterations = iterations;
    }
    if (m_engine->beginStep(m_input, m_start.settings) != Status::Ok || m_engine->finishStep(m_results) != Status::Ok) {
      throw InputError(m_engine->lastError());
    }
    return {m_results.manifolds, velocitiesOf(m_results)};
  }
  const StepResults& results() const { return m_results; }

 private:
  StepStart m_start;
  int m_baseIterations;
  std::unique_ptr<Engine> m_engine;
  WorldInput m_input;
  StepResults m_results;
};

// Stock's solver on btgpu's contacts.
class StockSolver {
 public:
  StockSolver(const Builder& build, const StepStart& start, const std::vector<Manifold>& contacts, size_t ofPairs,
              btScalar timeStep)
      : m_contents(build(m_oracle)), m_start(start), m_contacts(contacts), m_ofPairs(ofPairs), m_timeStep(timeStep) {
    std::vector<btCollisionObject*> bySlot;
    for (int i = 0; i < m_oracle.getNumCollisionObjects(); ++i) {
      bySlot.push_back(m_oracle.getCollisionObjectArray()[i]);
    }
    m_oracle.setObjects(bySlot);
    m_oracle.setState(start.states, start.cache);
    m_oracle.setJoints(start.joints);
    m_oracle.findContacts(timeStep);
    m_predicted = m_oracle.states();
  }

  Solved solve(int iterations, bool reversed) {
    m_oracle.restore(m_predicted);
    m_oracle.setJoints(m_start.joints);
    m_oracle.replaceContacts(m_contacts, m_ofPairs);
    const auto reverse = [&] {
      m_oracle.reverseContacts();
      m_oracle.reverseJoints();
    };
    if (reversed) reverse();
    m_oracle.solve(m_timeStep, iterations);
    if (reversed) reverse();
    return {readSolved(), m_oracle.velocities()};
  }
  const OracleWorld& world() const { return m_oracle; }

 private:
  std::vector<Manifold> readSolved() const {
    std::vector<Manifold> solved = m_contacts;
    for (size_t i = 0; i < solved.size(); ++i) {
      const btPersistentManifold* from = solved[i].pointCount > 0 ? m_oracle.replaced(i) : nullptr;
      if (!from || from->getNumContacts() != solved[i].pointCount) continue;
      for (int k = 0; k < solved[i].pointCount; ++k) solved[i].points[k] = readContactPoint(from->getContactPoint(k));
    }
    return solved;
  }

  OracleWorld m_oracle;
  std::unique_ptr<SceneContents> m_contents;
  const StepStart& m_start;
  const std::vector<Manifold>& m_contacts;
  size_t m_ofPairs;
  btScalar m_timeStep;
  std::vector<BodyState> m_predicted;
};

struct DeviceLine {
  const char* name;
  Solver solver;
  GroupSplit split;
};

const DeviceLine kDeviceLines[] = {{"parity", Solver::Parity, GroupSplit::Space},
                                   {"two_level, space", Solver::TwoLevel, GroupSplit::Space},
                                   {"two_level, index", Solver::TwoLevel, GroupSplit::Index},
                                   {"mass_splitting", Solver::MassSplitting, GroupSplit::Space}};

bool sameContacts(const std::vector<Manifold>& a, const std::vector<Manifold>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Manifold)) == 0);
}

}  // namespace

int solvesOf(const ConvergenceOptions& options) {
  return static_cast<int>((std::size(kDeviceLines) + 2) * options.iterations.size());
}

ConvergenceResult measureConvergence(const std::string& scene, const Builder& build,
                                     const ConvergenceOptions& options) {
  ConvergenceResult result;
  result.scene = scene;
  result.steps = options.steps;
  result.iterations = options.iterations;
  const StepStart start = runScene(build, options, result);
  const btScalar dt = static_cast<btScalar>(options.timeStep);

  DeviceSolver first(start, options.device, Solver::Parity, GroupSplit::Space);
  first.solve(1);
  const StepResults base = first.results();
  for (const Manifold& m : base.matchedManifolds) result.contacts += m.pointCount;
  StockSolver stock(build, start, base.matchedManifolds, base.counters.pairCount, dt);
  std::vector<Velocity> before;
  for (const BodyState& s : start.states) before.push_back({s.linear, s.angular});
  const std::vector<Velocity> exact = stock.solve(kConvergedIterations, false).velocities;

  int done = 0;
  const auto measure = [&](ConvergenceLine& line, const Solved& solved) {
    Residual residual = measureResidual(stock.world(), base.matchedManifolds, solved.manifolds, start.states, before,
                                        solved.velocities, dt);
    residual.add(measureJointResidual(start.input.joints, start.input.jointRows, base.jointSolved, solved.velocities));
    line.residual.push_back(residual.rms());
    line.distance.push_back(velocityDistance(stock.world(), solved.velocities, exact));
    if (options.progress) options.progress(++done);
  };
  for (const DeviceLine& device : kDeviceLines) {
    DeviceSolver solver(start, options.device, device.solver, device.split);
    ConvergenceLine line{device.name, {}, {}};
    for (const int iterations : options.iterations) {
      measure(line, solver.solve(iterations));
      if (!sameContacts(solver.results().matchedManifolds, base.matchedManifolds)) ++result.deviceDifferences;
    }
    result.lines.push_back(line);
  }
  for (const bool reversed : {false, true}) {
    ConvergenceLine line{reversed ? "stock, reversed" : "stock", {}, {}};
    for (const int iterations : options.iterations) measure(line, stock.solve(iterations, reversed));
    result.lines.push_back(line);
  }
  return result;
}

}  // namespace btgpu::tool
