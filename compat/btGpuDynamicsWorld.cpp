// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "btGpuDynamicsWorld.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <set>
#include <string>
#include <tuple>

#include "../translation/contacts.h"
#include "../translation/damped_bodies.h"
#include "../translation/read_settings.h"
#include "../translation/support_check.h"
#include "../translation/virtual_table.h"
#include "../translation/write_back_bodies.h"
#include "../translation/write_back_joints.h"
#include "engine_loader.h"
#include "pair_finder_choice.h"
#include "solver_choice.h"
#include "world_state.h"

using btgpu::Path;
using btgpu::WorldState;
using btgpu::Zone;

namespace {

// Each line is said once a process: an application may make a world a level, or hundreds.
void sayOnce(const std::string& line) {
  static std::mutex mutex;
  static std::set<std::string> said;
  const std::lock_guard<std::mutex> lock(mutex);
  if (!said.insert(line).second) return;
  std::fprintf(stderr, "btgpu: %s\n", line.c_str());
}

void sayNoEngine(const std::string& reason) { sayOnce(reason + "; the world goes on on Bullet's own CPU path"); }

}  // namespace

btgpu::Engine* btgpu::engineOf(WorldState& state) {
  if (state.engine || !state.engineError.empty()) return state.engine.get();
  const btgpu::Zone zone("createEngine");
  btgpu::EngineSettings settings;
  settings.device = state.settings.m_device;
  settings.profile = state.settings.m_profile || state.zones.timesDevice();
  settings.hostStages = state.settings.m_hostStages;
  settings.checkStages = state.settings.m_checkStages;
  settings.debugKernels = state.settings.m_debugKernels;
  settings.bodyCapacity = static_cast<size_t>(btMax(0, state.settings.m_bodyCapacity));
  settings.pairCapacity = static_cast<size_t>(btMax(0, state.settings.m_pairCapacity));
  using btgpu::Status;
  Status why = Status::Ok;
  state.engine = btgpu::createEngine(settings, state.engineError, &why);
  const bool hopeless = why == Status::NoDevice || why == Status::WrongAbi;
  if (!state.engine && !hopeless) state.engine = btgpu::createEngine(settings, state.engineError, &why);
  if (!state.engine) {
    if (state.engineError.empty()) state.engineError = "no engine";
    // A kernel that did not build twice won't later.
    if (!hopeless && why != Status::BuildFailed) state.engineRetry.schedule();
    sayNoEngine(state.engineError);
  } else {
    state.engineError.clear();
    state.statistics.m_device = state.engine->info().device;
    state.zones.nameDevice(state.statistics.m_device);
  }
  return state.engine.get();
}

namespace {

// The device or its memory is gone: the world goes on without it for a while. Bullet's objects still hold the state
// before the step, so nothing is lost but the accumulated impulses.
void loseEngine(WorldState& state) {
  state.engineError = state.engine->lastError();
  sayNoEngine(state.engineError);
  state.engineRetry.schedule();
  state.engine.reset();
  state.statistics.m_device.clear();
  state.forgetWorld();
}

// Something of the application threw in the middle of a step. The device may have gone on by a step that
// Bullet's objects never see: its state is dropped, and the next step starts from theirs.
void abandonStep(WorldState& state) {
  state.engine->finishStep(state.results);
  state.engine->reset();
  state.forgetWorld();
  state.lastPath = Path::None;
}

// The application does not want to see contacts: those of the stock path, or of its own call of
// performDiscreteCollisionDetection, would go stale in the dispatcher. Pairs of the host keep theirs.
void releaseStockManifolds(btCollisionWorld& world, const WorldState& state) {
  if (world.getDispatcher()->getNumManifolds() == 0) return;
  btOverlappingPairCache& cache = *world.getPairCache();
  btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    if (!btgpu::collidesOnHost(state.reader, btgpu::slotsOf(state.reader, pairs[i])))
      cache.cleanOverlappingPair(pairs[i], world.getDispatcher());
  }
}

// What of a device step ran on the CPU.
void reportShares(WorldState& state, int actions) {
  state.fallbacks.addStep(state.reader.hostShares());
  if (!state.joints.constraints().empty()) state.fallbacks.addShare("joints", "rows by the CPU");
  if (!state.reader.sweptBodies().empty()) {
    state.fallbacks.addShare("continuous collision detection (CCD)", "fast bodies are swept by the CPU");
  }
  if (state.reader.input().onlyListedPairs) {
    state.fallbacks.addShare("overlap filter callback", "called by the host's broadphase, which is kept current");
  }
  if (actions > 0) state.fallbacks.addShare("actions", "called on the CPU, after the device's part of the step");
}

// Null if the world is not to be cross-checked.
std::shared_ptr<btgpu::CrossCheck> crossCheckOf(WorldState& state) {
  if (!state.crosscheckAsked) state.crosscheck = btgpu::CrossCheck::make(state.settings);
  state.crosscheckAsked = true;
  return state.crosscheck;
}

// Milliseconds since it was made or last asked.
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - m_last).count();
    m_last = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point m_last = std::chrono::steady_clock::now();
};

void keepStageDifferences(WorldState& state) {
  btGpuStatistics& s = state.statistics;
  for (const btgpu::StageDifference& d : state.results.differences) {
    if (s.m_stageDifferences++ > 0) continue;
    s.m_firstStageDifference = "step " + std::to_string(s.m_deviceSteps) + ", " + textOf(d);
    std::fprintf(stderr, "btgpu: %s\n", s.m_firstStageDifference.c_str());
  }
}

void keepStatistics(WorldState& state) {
  const btgpu::StepCounters& c = state.results.counters;
  btGpuStatistics& s = state.statistics;
  ++s.m_deviceSteps;
  keepStageDifferences(state);
  if (state.results.prefetched) ++s.m_prefetchedSteps;
  if (!state.results.recoveredFrom.empty()) {
    ++s.m_recoveredSteps;
    sayOnce(state.results.recoveredFrom + "; the step was done again");
  }
  if (state.results.failedAssertions > 0) {
    if (s.m_failedAssertions == 0) {
      s.m_firstAssertion = state.results.firstAssertion;
      sayOnce(s.m_firstAssertion);
    }
    s.m_failedAssertions += state.results.failedAssertions;
  }
  s.m_repeatedSteps += static_cast<unsigned long long>(state.results.redos);
  s.m_pairs = c.pairCount;
  s.m_contactManifolds = c.constraintCount;
  s.m_contactPoints = c.contactPoints;
  s.m_colours = c.colourCount;
  s.m_launches = state.results.launches;
  s.m_waits = state.results.waits;
  if (c.quarantined > 0) {
    state.fallbacks.addShare("body", "NaN or infinite result: left out until the application gives it a new state",
                             c.quarantined);
  }
}

// Manifolds of the last step, on whichever path, those of sleepers included; negative: there was none. On the device it
// has one for each pair.
int lastManifolds(const WorldState& state, btDispatcher& dispatcher) {
  if (state.lastPath == Path::None) return -1;
  return state.lastPath == Path::Device ? static_cast<int>(state.statistics.m_pairs) : dispatcher.getNumManifolds();
}

// Stands in for the pre-tick callback while the base class steps, since it has been called already.
void preTickCalled(btDynamicsWorld*, btScalar) {}

// Takes the callback away and puts it back, whatever happens in between, unless the application set another
// one.
class PreTickGuard {
 public:
  explicit PreTickGuard(btInternalTickCallback& callback) : m_callback(callback), m_saved(callback) {
    if (m_saved) m_callback = preTickCalled;
  }
  ~PreTickGuard() {
    if (m_callback == preTickCalled) m_callback = m_saved;
  }
  PreTickGuard(const PreTickGuard&) = delete;
  PreTickGuard& operator=(const PreTickGuard&) = delete;

 private:
  btInternalTickCallback& m_callback;
  btInternalTickCallback m_saved;
};

// True if the world's class has made the member function its own.
template <typename Member>
bool overrides(const btGpuDynamicsWorld* world, Member member) {
  const void *own = btgpu::findState(world)->ownTable, *actual = btgpu::virtualTableOf(world);
  return own != actual && btgpu::virtualEntry(own, member) != btgpu::virtualEntry(actual, member);
}

}  // namespace

// Stages of stock's step that a class derived from this one has made its own; the device would pass them by.
const char* btGpuDynamicsWorld::overriddenStage() const {
  if (overrides(this, &btGpuDynamicsWorld::predictUnconstraintMotion)) return "predictUnconstraintMotion";
  if (overrides(this, &btGpuDynamicsWorld::createPredictiveContacts)) return "createPredictiveContacts";
  if (overrides(this, &btGpuDynamicsWorld::performDiscreteCollisionDetection))
    return "performDiscreteCollisionDetection";
  if (overrides(this, &btGpuDynamicsWorld::calculateSimulationIslands)) return "calculateSimulationIslands";
  if (overrides(this, &btGpuDynamicsWorld::solveConstraints)) return "solveConstraints";
  if (overrides(this, &btGpuDynamicsWorld::integrateTransforms)) return "integrateTransforms";
  if (overrides(this, &btGpuDynamicsWorld::updateActivationState)) return "updateActivationState";
  return nullptr;
}

bool btGpuDynamicsWorld::overridesUpdateAabbs() const { return overrides(this, &btGpuDynamicsWorld::updateAabbs); }

// True if between two substeps of a stepSimulation the application gets to see and change bodies at most, by their
// motion states: then contacts and the host's broadphase are brought up to date after the last substep only, and the
// device goes on meanwhile.
bool btGpuDynamicsWorld::mayBatchSubsteps() {
  const auto state = btgpu::findState(this);
  const btGpuSettings& settings = state->settings;
  // Of bodies at rest the broadphase would miss how they came there.
  const bool hostAabbs = settings.m_hostQueries && (!getForceUpdateAllAabbs() || overridesUpdateAabbs());
  return !m_internalPreTickCallback && !m_internalTickCallback && m_actions.size() == 0 && m_constraints.size() == 0 &&
         state->reader.hostShares().empty() && state->reader.sweptBodies().empty() &&
         !getPairCache()->getOverlapFilterCallback() && !btgpu::hasPairCallback(*this) && !hostAabbs &&
         !settings.m_keepContacts && !crossCheckOf(*state) &&
         !(settings.m_contacts && (gContactStartedCallback || gContactEndedCallback || gContactDestroyedCallback)) &&
         !gContactAddedCallback && !gContactProcessedCallback &&
         !overrides(this, &btGpuDynamicsWorld::internalSingleStepSimulation) &&
         !overrides(this, &btGpuDynamicsWorld::synchronizeMotionStates);
}

int btGpuDynamicsWorld::stepSimulation(btScalar timeStep, int maxSubSteps, btScalar fixedTimeStep) {
  const auto state = btgpu::findState(this);
  const btgpu::WorldScope scope(state->zones);
  const Zone zone("stepSimulation");
  return btDiscreteDynamicsWorld::stepSimulation(timeStep, maxSubSteps, fixedTimeStep);
}

void btGpuDynamicsWorld::synchronizeMotionStates() {
  const Zone zone("synchronizeMotionStates");
  if (m_synchronizeAllMotionStates) {
    btDiscreteDynamicsWorld::synchronizeMotionStates();
  } else {
    btgpu::findState(this)->motionStates.write(*this, m_nonStaticRigidBodies);
  }
}

void btGpuDynamicsWorld::applyGravity() {
  const Zone zone("applyGravity");
  btgpu::applyGravityTo(m_nonStaticRigidBodies);
}
void btGpuDynamicsWorld::clearForces() {
  const Zone zone("clearForces");
  btgpu::findState(this)->substeps.endStepSimulation();
  btgpu::clearForcesOf(m_nonStaticRigidBodies);
}

void btGpuDynamicsWorld::saveKinematicState(btScalar timeStep) {
  const Zone zone("saveKinematicState");
  btgpu::findState(this)->substeps.startStepSimulation(double(timeStep));
  for (const int i : btgpu::awakeKinematicBodies(m_collisionObjects)) {
    if (i >= m_collisionObjects.size()) break;  // the motion state that was asked last took bodies out
    btRigidBody* body = btRigidBody::upcast(m_collisionObjects[i]);
    if (body && body->isKinematicObject()) body->saveKinematicState(timeStep);
  }
}

btGpuDynamicsWorld::btGpuDynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
                                       btConstraintSolver* constraintSolver,
                                       btCollisionConfiguration* collisionConfiguration)
    : btGpuDynamicsWorld(dispatcher, pairCache, constraintSolver, collisionConfiguration, btGpuSettings()) {}

btGpuDynamicsWorld::btGpuDynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
                                       btConstraintSolver* constraintSolver,
                                       btCollisionConfiguration* collisionConfiguration, const btGpuSettings& settings)
    : btDiscreteDynamicsWorld(dispatcher, pairCache, constraintSolver, collisionConfiguration) {
  btgpu::replaceState(this, settings)->ownTable = btgpu::virtualTableOf(this);
}

btGpuDynamicsWorld::~btGpuDynamicsWorld() { btgpu::eraseState(this); }

void btGpuDynamicsWorld::configure(btGpuDynamicsWorld* world, const btGpuSettings& settings) {
  const auto state = btgpu::findState(world);
  const auto hadProfile = state->zones.profile();
  state->zones.useFile(settings.m_profileFile);
  const auto engineSettings = [](const btGpuSettings& s) {
    return std::tie(s.m_device, s.m_profile, s.m_debugKernels, s.m_hostStages, s.m_checkStages);
  };
  const bool sameEngine =
      engineSettings(state->settings) == engineSettings(settings) && hadProfile == state->zones.profile();
  state->settings = settings;
  state->small.use(settings);
  state->crosscheck.reset();
  state->crosscheckAsked = false;
  if (sameEngine && state->engine) return;
  state->engine.reset();
  state->engineError.clear();
  state->engineRetry.forget();
  state->forgetWorld();
  if (state->lastPath == Path::Device) state->lastPath = Path::None;
}

void btGpuDynamicsWorld::addCollisionObject(btCollisionObject* collisionObject, int collisionFilterGroup,
                                            int collisionFilterMask) {
  btDiscreteDynamicsWorld::addCollisionObject(collisionObject, collisionFilterGroup, collisionFilterMask);
  btgpu::findState(this)->reader.noteAdded(collisionObject);
}

std::vector<btGpuFallback> btGpuDynamicsWorld::fallbackReport() const {
  std::vector<btGpuFallback> report;
  for (const auto& entry : btgpu::findState(this)->fallbacks.entries()) {
    report.push_back({entry.what, entry.reason, entry.count, entry.wholeStep});
  }
  return report;
}

btGpuStatistics btGpuDynamicsWorld::statistics() const { return btgpu::findState(this)->statistics; }

btGpuCrosscheckSummary btGpuDynamicsWorld::crosscheck() const {
  const auto check = btgpu::findState(this)->crosscheck;
  return check ? check->summary() : btGpuCrosscheckSummary();
}

std::vector<btGpuStageTime> btGpuDynamicsWorld::takeProfile() {
  std::vector<btGpuStageTime> times;
  const auto state = btgpu::findState(this);
  if (!state->engine) return times;
  for (const auto& t : state->engine->takeProfile()) times.push_back({t.stage, t.milliseconds, t.launches});
  return times;
}

void btGpuDynamicsWorld::internalSingleStepSimulation(btScalar timeStep) {
  const auto state = btgpu::findState(this);
  const btgpu::WorldScope scope(state->zones);
  const Zone zone("internalSingleStepSimulation");
  if (state->zones.profile()) state->zones.profile()->countStep();
  state->substeps.startSubstep(double(timeStep));
  if (m_internalPreTickCallback) {
    const Zone callbackZone("preTickCallback");
    (*m_internalPreTickCallback)(this, timeStep);
  }
  if (!deviceStep(timeStep)) {
    stockStep(timeStep);
    return;
  }
  // From here on as in stock. With actions in the world the sleep timers come after them, on the host.
  const bool hostActivation = m_actions.size() > 0;
  updateActions(timeStep);
  if (hostActivation) updateActivationState(timeStep);
  if (m_internalTickCallback) {
    const Zone callbackZone("tickCallback");
    (*m_internalTickCallback)(this, timeStep);
  }
}

// One step on the device, up to the point where stock has integrated the transforms. False if the stock path
// has to do it; Bullet's objects are then as before.
bool btGpuDynamicsWorld::deviceStep(btScalar timeStep) {
  const auto state = btgpu::findState(this);
  if (state->small.isSmall(m_nonStaticRigidBodies.size(), lastManifolds(*state, *getDispatcher()))) {
    ++state->statistics.m_smallSteps;
    return false;
  }
  btgpu::FallbackList missing;
  if (state->settings.m_stockOnly) missing.add("device", "turned off by setting");
  if (const char* stage = overriddenStage()) missing.add("world", std::string("its class overrides ") + stage);
  btgpu::checkWorld(*this, timeStep, missing);
  getDispatchInfo().m_timeStep = timeStep;
  getDispatchInfo().m_stepCount = 0;
  getDispatchInfo().m_debugDraw = getDebugDrawer();
  bool hostPairsDone = missing.empty() && state->settings.m_hostQueries && btgpu::hasPairCallback(*this);
  if (hostPairsDone) updateHostBroadphase(timeStep);
  Stopwatch watch;
  if (missing.empty() && state->engineRetry.due()) {
    state->engineError.clear();
    state->forgetWorld();
  }
  // Where there is no device, the world need not be read to know it.
  if (missing.empty() && !state->engineError.empty()) missing.add("device", state->engineError);
  if (missing.empty()) state->reader.read(*this, missing, state->fallbacks);
  if (missing.empty() && !engineOf(*state)) missing.add("device", state->engineError);
  if (missing.empty() && (state->reader.hostBodiesChanged() || !state->reader.hostShares().empty())) catchUpContacts();
  // Not before it is known that the step runs on the device: callbacks of the narrowphase would be called twice.
  if (missing.empty()) hostPairsDone = findHostContacts(timeStep, hostPairsDone, missing);
  if (missing.empty()) {
    state->joints.read(*this, timeStep, state->reader, missing, btScalar(btgpu::jointLead(state->settings)) * timeStep);
  }
  if (!missing.empty()) {
    state->fallbacks.addStep(missing);
    return false;
  }

  btgpu::WorldInput& input = state->reader.input();
  const bool contacts = state->settings.m_contacts;
  const bool fromStock = state->lastPath == Path::Stock;
  // Pairs that the host collided until now bring their impulses, if the dispatcher has those of all pairs.
  if (fromStock || (contacts && state->lastPath == Path::Device && state->reader.hostBodiesChanged())) {
    input.replaceManifolds = true;
    input.manifolds = btgpu::readManifolds(*getDispatcher(), state->reader, m_predictiveManifolds);
  }
  if (fromStock) state->contacts.forget();
  if (!contacts) {
    releaseStockManifolds(*this, *state);
    state->contacts.forget();
  }
  btgpu::StepSettings settings = btgpu::readSettings(*this, timeStep);
  btgpu::chooseSolver(state->settings, settings);
  settings.pairFinder = btgpu::pairFinderOf(state->settings);
  settings.contacts = contacts;
  settings.allContacts = state->contacts.isFresh();
  settings.hostActivation = m_actions.size() > 0;
  const std::shared_ptr<btgpu::CrossCheck> check = crossCheckOf(*state);
  const bool checked = check && check->isDue();
  settings.keepContacts = state->settings.m_keepContacts || checked;
  if (!hostPairsDone && mayBatchSubsteps()) settings.substepsToFollow = state->substeps.toFollow();
  const bool last = settings.substepsToFollow == 0;
  getSolverInfo().m_timeStep = timeStep;

  const double reading = watch.lap();
  if (checked) {
    const Zone zone("crosscheck");
    check->beforeStep(*this, state->reader, state->joints, *state->engine, state->lastPath == Path::Device,
                      state->results);
    watch.lap();
  }
  state->engine->setZoneSink(btgpu::currentZoneSink());
  btgpu::Status status = [&] {
    const Zone zone("beginStep");
    return state->engine->beginStep(input, settings);
  }();
  if (status == btgpu::Status::Ok) {
    // The device works while the host finds its own pairs; pair callbacks come here, as in stock before the
    // solver.
    try {
      if (last && state->settings.m_hostQueries && !hostPairsDone) updateHostBroadphase(timeStep);
    } catch (...) {
      abandonStep(*state);
      throw;
    }
    state->statistics.m_deviceMs = watch.lap();
    {
      const Zone zone("finishStep");
      status = state->engine->finishStep(state->results);
    }
    state->statistics.m_waitMs = watch.lap();
    state->statistics.m_deviceMs += state->statistics.m_waitMs;
  }
  if (status != btgpu::Status::Ok) {
    loseEngine(*state);
    missing.add("device", state->engineError);
    state->fallbacks.addStep(missing);
    return false;
  }
  state->hostContacts.writeBack(state->results);
  if (contacts && last) {
    state->contacts.write(*this, state->reader, state->results, state->hostContacts.manifoldCount(),
                          !state->settings.m_hostQueries);
  }
  state->contactsBehind = contacts && !last;
  if (settings.solver == btgpu::Solver::Fast) state->joints.remember(state->results.jointImpulses);
  btgpu::writeBackJoints(*this, state->joints, input, state->results, timeStep);
  writeBackBodies(timeStep);
  state->reader.acceptResults(state->results);
  keepStatistics(*state);
  reportShares(*state, m_actions.size());
  state->statistics.m_translateMs = reading + watch.lap();
  state->lastPath = Path::Device;
  if (checked) {
    const Zone zone("crosscheck");
    const btGpuCrosscheckStep step =
        check->afterStep(state->reader, state->joints, state->results, timeStep, !settings.hostActivation);
    const auto callback = state->settings.m_crosscheckCallback;
    if (callback) callback(step);
  } else if (check) {
    check->skipStep();
  }
  return true;
}

// What of the collision detection is the host's: the pairs that the device can't collide, those that the application
// filters, and what is in the way of fast bodies. It needs the host's broadphase, whatever the settings say. Returns
// whether that is current now.
bool btGpuDynamicsWorld::findHostContacts(btScalar timeStep, bool hostPairsDone, btgpu::FallbackList& missing) {
  const auto state = btgpu::findState(this);
  btgpu::WorldInput& input = state->reader.input();
  const bool contacts = !state->reader.hostShares().empty(), swept = !state->reader.sweptBodies().empty();
  releasePredictiveContacts();
  state->hostContacts.clear(input);
  input.onlyListedPairs = getPairCache()->getOverlapFilterCallback() != nullptr;
  if (!contacts && !swept && !input.onlyListedPairs) return hostPairsDone;
  if (!hostPairsDone) updateHostBroadphase(timeStep);
  const Zone zone("hostContacts");
  if (contacts) state->hostContacts.find(*this, state->reader);
  // The callback may have changed bodies.
  if (contacts && (gContactAddedCallback || gContactProcessedCallback)) {
    state->reader.read(*this, missing, state->fallbacks);
  }
  if (swept) {
    predictContacts(timeStep);
    state->hostContacts.add(m_predictiveManifolds, state->reader);
  }
  state->hostContacts.fill(input, state->reader, missing);
  if (input.onlyListedPairs) state->pairFilter.listPairs(*this, state->reader);
  return true;
}

// Stock's createPredictiveContacts, for the bodies that ask for it. As there they are damped by then, and nothing else.
void btGpuDynamicsWorld::predictContacts(btScalar timeStep) {
  const Zone zone("predictiveContacts");
  const btgpu::WorldReader& reader = btgpu::findState(this)->reader;
  btgpu::DampedBodies damped(timeStep);
  damped.reserve(reader.input().bodyCount);
  std::vector<btRigidBody*> bodies;
  for (const std::uint32_t slot : reader.sweptBodies()) {
    btRigidBody* body = btRigidBody::upcast(reader.objectOf(slot));
    if (reader.slots()[slot].quarantined || reader.slots()[slot].deviceQuarantined) continue;
    damped.damp(*body, slot);
    bodies.push_back(body);
  }
  if (!bodies.empty()) createPredictiveContactsInternal(bodies.data(), static_cast<int>(bodies.size()), timeStep);
}

// Fast bodies that ask for it go no farther than to what they hit (btDiscreteDynamicsWorld::integrateTransforms).
void btGpuDynamicsWorld::writeBackBodies(btScalar timeStep) {
  const auto state = btgpu::findState(this);
  const std::vector<std::uint32_t> fast = btgpu::fastBodies(state->reader, state->results, timeStep);
  if (fast.empty()) {
    btgpu::writeBackBodies(state->reader, state->results, timeStep);
  } else {
    btgpu::writeBackInOrder(state->reader, state->results, timeStep, m_nonStaticRigidBodies, fast,
                            [this, timeStep](btRigidBody& body) {
                              btRigidBody* one = &body;
                              integrateTransformsInternal(&one, 1, timeStep);
                            });
  }
  if (!m_applySpeculativeContactRestitution || m_predictiveManifolds.size() == 0) return;
  // What stock does for restitution after it has integrated the bodies of its list.
  const int bodies = m_nonStaticRigidBodies.size();
  m_nonStaticRigidBodies.resizeNoInitialize(0);
  btDiscreteDynamicsWorld::integrateTransforms(timeStep);
  m_nonStaticRigidBodies.resizeNoInitialize(bodies);
}

// Brings the dispatcher's manifolds to where the last substep left them, if that was not the last of its batch:
// something in between made the host's part in the next one larger.
void btGpuDynamicsWorld::catchUpContacts() {
  const auto state = btgpu::findState(this);
  if (!state->contactsBehind || !state->engine) return;
  const Zone zone("catchUpContacts");
  std::vector<btgpu::Manifold> manifolds;
  if (state->engine->readManifolds(manifolds) != btgpu::Status::Ok) return;
  state->contactsBehind = false;
  const auto& born = state->reader.input().born;
  const auto isGone = [&](std::uint32_t slot) {
    return !state->reader.objectOf(slot) || std::binary_search(born.begin(), born.end(), slot);
  };
  btgpu::StepResults results;
  std::vector<btgpu::Manifold> touching;
  for (const btgpu::Manifold& m : manifolds) {
    if (m.pointCount == 0 || isGone(m.bodyA) || isGone(m.bodyB)) continue;
    results.contactKeys.push_back(btgpu::pairKeyOf(m.bodyA, m.bodyB));
    touching.push_back(m);
    touching.back().bodyA = state->reader.ownerOf(m.bodyA);
    touching.back().bodyB = state->reader.ownerOf(m.bodyB);
  }
  results.contacts = {touching.data(), touching.size()};
  state->contacts.forget();
  state->contacts.write(*this, state->reader, results, state->hostContacts.manifoldCount(),
                        !state->settings.m_hostQueries);
  state->contacts.forget();
}

// What stock's step does for the broadphase: AABBs that cover the predicted motion, then the overlapping
// pairs.
void btGpuDynamicsWorld::updateHostBroadphase(btScalar timeStep) {
  const Zone zone("hostBroadphase");
  btgpu::predictTransforms(m_nonStaticRigidBodies, timeStep);
  if (overridesUpdateAabbs()) {
    updateAabbs();
  } else {
    btgpu::findState(this)->aabbs.update(*this);
  }
  computeOverlappingPairs();
}

// Stock takes the island tag of a joint's body for an index, also of one that left the world, and then it is the tag
// that its last step in the world gave it. A body that only ever stepped on the device has none: the first island's
// will do.
void btGpuDynamicsWorld::giveIslandTags() {
  for (int i = 0; i < m_constraints.size(); ++i) {
    for (btRigidBody* body : {&m_constraints[i]->getRigidBodyA(), &m_constraints[i]->getRigidBodyB()}) {
      if (!body->isStaticOrKinematicObject() && body->getIslandTag() < 0) body->setIslandTag(0);
    }
  }
}

void btGpuDynamicsWorld::stockStep(btScalar timeStep) {
  const Zone zone("stockStep");
  const auto state = btgpu::findState(this);
  if (state->contactsBehind && state->engine) {
    btgpu::FallbackList ignored;
    state->reader.read(*this, ignored, state->fallbacks);
    catchUpContacts();
  }
  if (state->lastPath == Path::Device && state->engine && !state->settings.m_contacts) {
    // The contacts come along, so that the stack does not lose its warm start.
    std::vector<btgpu::Manifold> manifolds;
    btgpu::FallbackList ignored;
    state->reader.read(*this, ignored, state->fallbacks);
    if (state->engine->readManifolds(manifolds) == btgpu::Status::Ok) {
      updateHostBroadphase(timeStep);
      btgpu::writeManifolds(manifolds, state->reader, *this);
    }
  }
  giveIslandTags();
  state->lastPath = Path::Stock;
  ++state->statistics.m_stockSteps;
  if (const auto check = crossCheckOf(*state)) check->stockStep();
  const PreTickGuard guard(m_internalPreTickCallback);
  btDiscreteDynamicsWorld::internalSingleStepSimulation(timeStep);
}
