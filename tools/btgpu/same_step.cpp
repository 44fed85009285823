// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "same_step.h"

#include <numeric>

#include "bullet_file.h"
#include "compat/engine_loader.h"
#include "compat/world_state.h"
#include "translation/contacts.h"
#include "translation/convert.h"

namespace btgpu::tool {
namespace {

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
  Status castRays(const QueryWorld& world, const Ray* rays, size_t count, RayResults& results) noexcept override {
    return m_engine->castRays(world, rays, count, results);
  }
  Status castSweeps(const QueryWorld& world, const Sweep* sweeps, size_t count,
                    SweepResults& results) noexcept override {
    return m_engine->castSweeps(world, sweeps, count, results);
  }
  Status closestPoints(const QueryWorld& world, const std::vector<ClosestQuery>& queries,
                       std::vector<ClosestAnswer>& answers) noexcept override {
    return m_engine->closestPoints(world, queries, answers);
  }
  void reset() noexcept override { m_engine->reset(); }
  EngineInfo info() const noexcept override { return m_engine->info(); }
  std::vector<StageProfile> takeProfile() noexcept override { return m_engine->takeProfile(); }
  void setZoneSink(ZoneSink* sink) noexcept override { m_engine->setZoneSink(sink); }
  std::string lastError() const noexcept override { return m_engine->lastError(); }
  std::unique_ptr<Engine> release() { return std::move(m_engine); }

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
  in.hulls.changed = in.meshes.changed = true;
  in.born.clear();
  in.replaceManifolds = true;
  in.manifolds = start.cache;
  start.settings.keepContacts = true;
  start.settings.contacts = false;
  start.settings.substepsToFollow = 0;
}

std::vector<Velocity> velocitiesOf(const StepResults& results) {
  std::vector<Velocity> velocities;
  for (const BodyVelocity& v : results.velocities) velocities.push_back({toBullet(v.linear), toBullet(v.angular)});
  return velocities;
}

}  // namespace

StepStart recordStep(btGpuDynamicsWorld& world, const std::function<void()>& step) {
  StepStart start;
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    start.states.push_back(captureState(*world.getCollisionObjectArray()[i]));
  }
  start.joints = captureJoints(world);
  const auto state = findState(&world);
  auto recorder = std::make_unique<RecordingEngine>(std::move(state->engine), start);
  RecordingEngine* const recording = recorder.get();
  state->engine = std::move(recorder);
  step();
  if (state->engine.get() == recording) state->engine = recording->release();  // else it was lost
  takeKinematicStates(world, start.input, start.states);
  takeMotors(world, start.joints);
  makeComplete(start);
  return start;
}

DeviceSolver::DeviceSolver(const std::string& device, Solver solver, GroupSplit split)
    : m_solver(solver), m_split(split) {
  EngineSettings settings;
  settings.device = device;
  std::string error;
  m_engine = createEngine(settings, error);
  if (!m_engine) throw InputError(error);
}

Solved DeviceSolver::solve(const StepStart& start, int iterations) {
  StepSettings settings = start.settings;
  settings.solver = m_solver;
  settings.groupSplit = m_split;
  settings.iterations = iterations;
  m_input = start.input;
  for (Joint& j : m_input.joints) {  // those that have no number of their own
    if (j.iterations == start.settings.iterations) j.iterations = iterations;
  }
  if (m_engine->beginStep(m_input, settings) != Status::Ok || m_engine->finishStep(m_results) != Status::Ok) {
    throw InputError(m_engine->lastError());
  }
  return {m_results.manifolds, velocitiesOf(m_results)};
}

StockSolver::StockSolver(const Builder& build) : m_contents(build(m_oracle)) {
  std::vector<btCollisionObject*> bySlot;
  for (int i = 0; i < m_oracle.getNumCollisionObjects(); ++i) {
    bySlot.push_back(m_oracle.getCollisionObjectArray()[i]);
  }
  m_oracle.setObjects(bySlot);
}

StockSolver::~StockSolver() = default;

void StockSolver::use(const StepStart& start, const StepResults& device) {
  m_start = &start;
  m_contacts = device.matchedManifolds;
  m_ofPairs = device.counters.pairCount;
  m_jointSolved = device.jointSolved;
  m_timeStep = static_cast<btScalar>(start.settings.timeStep);
  m_before.clear();
  for (const BodyState& s : start.states) m_before.push_back({s.linear, s.angular});
  m_oracle.setState(start.states, start.cache, start.input);
  m_oracle.setJoints(start.joints);
  m_oracle.findContacts(m_timeStep);
  m_predicted = m_oracle.states();
}

Solved StockSolver::solve(int iterations, bool reversed) {
  m_oracle.restore(m_predicted);
  m_oracle.setJoints(m_start->joints);
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

std::vector<Manifold> StockSolver::readSolved() const {
  std::vector<Manifold> solved = m_contacts;
  for (size_t i = 0; i < solved.size(); ++i) {
    const btPersistentManifold* from = solved[i].pointCount > 0 ? m_oracle.replaced(i) : nullptr;
    if (!from || from->getNumContacts() != solved[i].pointCount) continue;
    for (int k = 0; k < solved[i].pointCount; ++k) solved[i].points[k] = readContactPoint(from->getContactPoint(k));
  }
  return solved;
}

double StockSolver::residualOf(const Solved& solved) const {
  Residual residual =
      measureResidual(m_oracle, m_contacts, solved.manifolds, m_start->states, m_before, solved.velocities, m_timeStep);
  residual.add(measureJointResidual(m_start->input.joints, m_start->input.jointRows, m_jointSolved, solved.velocities));
  return residual.rms();
}

double StockSolver::distance(const Solved& a, const Solved& b) const {
  return velocityDistance(m_oracle, a.velocities, b.velocities);
}

}  // namespace btgpu::tool
