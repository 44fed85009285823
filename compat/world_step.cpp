// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "world_step.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <set>
#include <string>

#include "../translation/contacts.h"
#include "../translation/damped_bodies.h"
#include "../translation/island_tags.h"
#include "../translation/kept_aabbs.h"
#include "../translation/read_settings.h"
#include "../translation/support_check.h"
#include "../translation/virtual_table.h"
#include "../translation/write_back_bodies.h"
#include "../translation/write_back_joints.h"
#include "engine_loader.h"
#include "pair_finder_choice.h"
#include "solver_choice.h"

BTGPU_TRANSLATION_BEGIN
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

Engine* engineOf(WorldState& state) {
  if (state.engine || !state.engineError.empty()) return state.engine.get();
  const Zone zone("createEngine");
  EngineSettings settings;
  settings.device = state.settings.m_device;
  settings.profile = state.settings.m_profile || state.zones.timesDevice();
  settings.hostStages = state.settings.m_hostStages;
  settings.checkStages = state.settings.m_checkStages;
  settings.debugKernels = state.settings.m_debugKernels;
  settings.bodyCapacity = static_cast<size_t>(btMax(0, state.settings.m_bodyCapacity));
  settings.pairCapacity = static_cast<size_t>(btMax(0, state.settings.m_pairCapacity));
  Status why = Status::Ok;
  state.engine = createEngine(settings, state.engineError, &why);
  const bool hopeless = why == Status::NoDevice || why == Status::WrongAbi;
  if (!state.engine && !hopeless) state.engine = createEngine(settings, state.engineError, &why);
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
    if (!collidesOnHost(state.reader, slotsOf(state.reader, pairs[i])))
      cache.cleanOverlappingPair(pairs[i], world.getDispatcher());
  }
}

// What the chosen solver has no rows for.
void checkSolverChoice(const WorldState& state, FallbackList& missing) {
  if (solverOf(state.settings) != Solver::Fast) return;
  const auto& infos = state.reader.input().infos.values;
  const auto isAnchored = [](const BodyInfo& body) { return (body.flags & BODY_FRICTION_ANCHOR) != 0; };
  if (std::any_of(infos.begin(), infos.end(), isAnchored)) missing.add("friction anchor", "not in the fast mode");
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
std::shared_ptr<CrossCheck> crossCheckOf(WorldState& state) {
  if (!state.crosscheckAsked) state.crosscheck = CrossCheck::make(state.settings);
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
  for (const StageDifference& d : state.results.differences) {
    if (s.m_stageDifferences++ > 0) continue;
    s.m_firstStageDifference = "step " + std::to_string(s.m_deviceSteps) + ", " + textOf(d);
    std::fprintf(stderr, "btgpu: %s\n", s.m_firstStageDifference.c_str());
  }
}

void keepStatistics(WorldState& state) {
  const StepCounters& c = state.results.counters;
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

// Of a step that needed nothing done: the counts of the last one hold for it too.
void keepRestingStatistics(WorldState& state) {
  btGpuStatistics& s = state.statistics;
  ++s.m_deviceSteps;
  ++s.m_restingSteps;
  s.m_launches = s.m_waits = 0;
  s.m_deviceMs = s.m_waitMs = 0;
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

}  // namespace

WorldStep::WorldStep(btDiscreteDynamicsWorld& world, StockStep stock)
    : m_world(world),
      m_stock(stock),
      m_state(findState(&world)),
      m_bodies(world.*(&WorldMembers::m_nonStaticRigidBodies)),
      m_actions(world.*(&WorldMembers::m_actions)),
      m_constraints(world.*(&WorldMembers::m_constraints)),
      m_predictive(world.*(&WorldMembers::m_predictiveManifolds)) {}

// True if the world's class has made the member function its own.
template <typename Member>
bool WorldStep::overrides(Member member) const {
  const void *own = m_state->ownTable, *actual = virtualTableOf(&m_world);
  return own != actual && virtualEntry(own, member) != virtualEntry(actual, member);
}

// Stages of stock's step that a class derived from btgpu's has made its own; the device would pass them by.
const char* WorldStep::overriddenStage() const {
  if (overrides(&WorldMembers::predictUnconstraintMotion)) return "predictUnconstraintMotion";
  if (overrides(&WorldMembers::createPredictiveContacts)) return "createPredictiveContacts";
  if (overrides(&WorldMembers::performDiscreteCollisionDetection)) return "performDiscreteCollisionDetection";
  if (overrides(&WorldMembers::calculateSimulationIslands)) return "calculateSimulationIslands";
  if (overrides(&WorldMembers::solveConstraints)) return "solveConstraints";
  if (overrides(&WorldMembers::integrateTransforms)) return "integrateTransforms";
  if (overrides(&WorldMembers::updateActivationState)) return "updateActivationState";
  return nullptr;
}

bool WorldStep::isAllOurs() const {
  return !overrides(&WorldMembers::internalSingleStepSimulation) && !overrides(&WorldMembers::saveKinematicState) &&
         !overrides(&WorldMembers::applyGravity) && !overrides(&WorldMembers::synchronizeMotionStates) &&
         !overrides(&WorldMembers::clearForces);
}

// True if between two substeps of a stepSimulation the application gets to see and change bodies at most, by their
// motion states: then contacts and the host's broadphase are brought up to date after the last substep only, and the
// device goes on meanwhile.
bool WorldStep::mayBatchSubsteps() const {
  const btGpuSettings& settings = m_state->settings;
  // Of bodies at rest the broadphase would miss how they came there.
  const bool hostAabbs =
      settings.m_hostQueries && (!m_world.getForceUpdateAllAabbs() || overrides(&WorldMembers::updateAabbs));
  return !(m_world.*&WorldMembers::m_internalPreTickCallback) && !(m_world.*&WorldMembers::m_internalTickCallback) &&
         m_actions.size() == 0 && m_constraints.size() == 0 && m_state->reader.hostShares().empty() &&
         m_state->reader.sweptBodies().empty() && !m_world.getPairCache()->getOverlapFilterCallback() &&
         !hasPairCallback(m_world) && !hostAabbs && !settings.m_keepContacts && !crossCheckOf(*m_state) &&
         !(settings.m_contacts && (gContactStartedCallback || gContactEndedCallback || gContactDestroyedCallback)) &&
         !gContactAddedCallback && !gContactProcessedCallback &&
         !overrides(&WorldMembers::internalSingleStepSimulation) && !overrides(&WorldMembers::synchronizeMotionStates);
}

void WorldStep::run(btScalar timeStep) {
  const WorldScope scope(m_state->zones);
  const Zone zone("internalSingleStepSimulation");
  if (m_state->zones.profile()) m_state->zones.profile()->countStep();
  m_state->substeps.startSubstep(double(timeStep));
  if (const btInternalTickCallback preTick = m_world.*&WorldMembers::m_internalPreTickCallback) {
    const Zone callbackZone("preTickCallback");
    m_state->rest.endConfirmation();
    preTick(&m_world, timeStep);
  }
  if (!runOnDevice(timeStep)) {
    runStock(timeStep);
    return;
  }
  // From here on as in stock. With actions in the world the sleep timers come after them, on the host.
  const bool hostActivation = m_actions.size() > 0;
  const btInternalTickCallback tick = m_world.*&WorldMembers::m_internalTickCallback;
  if (hostActivation || tick || !m_state->inStepSimulation) m_state->rest.endConfirmation();
  (m_world.*&WorldMembers::updateActions)(timeStep);
  if (hostActivation) (m_world.*&WorldMembers::updateActivationState)(timeStep);
  // An action may have set one.
  if (const btInternalTickCallback now = m_world.*&WorldMembers::m_internalTickCallback) {
    const Zone callbackZone("tickCallback");
    now(&m_world, timeStep);
  }
}

StepSettings WorldStep::settingsOf(btScalar timeStep) const {
  StepSettings settings = readSettings(m_world, timeStep);
  chooseSolver(m_state->settings, settings);
  settings.pairFinder = pairFinderOf(m_state->settings);
  settings.contacts = m_state->settings.m_contacts;
  settings.allContacts = m_state->contacts.isFresh();
  settings.hostActivation = m_actions.size() > 0;
  settings.islandRoots = m_state->settings.m_islandTags;
  return settings;
}

// True if everything sleeps and the step would leave it as the one before it has: then nothing is to be done. What
// would not show before something wakes (friction, a joint's motor, a callback for contacts) is read when it does.
bool WorldStep::staysAtRest(const StepSettings& settings) {
  if (!m_state->rest.isSettled()) return false;
  // Which pairs are the host's may have changed.
  const auto& dispatcher = static_cast<const btCollisionDispatcher&>(*m_world.getDispatcher());
  const bool sameCallbacks =
      m_state->restCallback == globalContactCallback(dispatcher) &&
      m_state->restAddedCallback == gContactAddedCallback &&
      m_state->reader.input().onlyListedPairs == (m_world.getPairCache()->getOverlapFilterCallback() != nullptr);
  if (!(settings == m_state->restSettings) || !sameCallbacks) {
    m_state->rest.forget();
    return false;
  }
  const Watch watch = m_state->settings.m_watchSleepers ? Watch::Everything : Watch::Activations;
  return m_state->rest.isUndisturbed(m_world.getCollisionObjectArray(), m_bodies, m_constraints, m_state->reader,
                                     watch);
}

// After a step on the device; `still`: it changed nothing, and nothing was changed for it.
void WorldStep::watchRest(const StepSettings& settings, bool still) {
  // The host's broadphase has to come to rest too, and sees the last substep of a batch only.
  if (still && settings.substepsToFollow > 0) return;
  RestWatch& rest = m_state->rest;
  rest.endStep(still && !settings.keepContacts && !looksAtSteps(m_state->settings) &&
               !overrides(&WorldMembers::updateAabbs));
  if (!rest.isDue()) return;
  rest.settle(m_world.getCollisionObjectArray(), m_bodies, m_constraints, m_state->reader);
  m_state->restSettings = settings;
  m_state->restCallback = globalContactCallback(static_cast<const btCollisionDispatcher&>(*m_world.getDispatcher()));
  m_state->restAddedCallback = gContactAddedCallback;
}

// One step on the device, up to the point where stock has integrated the transforms. False if the stock path
// has to do it; Bullet's objects are then as before.
bool WorldStep::runOnDevice(btScalar timeStep) {
  if (m_state->small.isSmall(m_bodies.size(), lastManifolds(*m_state, *m_world.getDispatcher()))) {
    ++m_state->statistics.m_smallSteps;
    return false;
  }
  FallbackList missing;
  if (m_state->settings.m_stockOnly) missing.add("device", "turned off by setting");
  if (const char* stage = overriddenStage()) missing.add("world", std::string("its class overrides ") + stage);
  checkWorld(m_world, timeStep, missing);
  m_world.getDispatchInfo().m_timeStep = timeStep;
  m_world.getDispatchInfo().m_stepCount = 0;
  m_world.getDispatchInfo().m_debugDraw = m_world.getDebugDrawer();
  m_state->aabbsUpdated = false;
  bool hostPairsDone = missing.empty() && m_state->settings.m_hostQueries && hasPairCallback(m_world);
  if (hostPairsDone) updateHostBroadphase(timeStep);
  Stopwatch watch;
  StepSettings settings = settingsOf(timeStep);
  if (missing.empty() && staysAtRest(settings)) {
    m_world.getSolverInfo().m_timeStep = timeStep;
    keepRestingStatistics(*m_state);
    m_state->statistics.m_translateMs = watch.lap();
    return true;
  }
  if (missing.empty() && m_state->engineRetry.due()) {
    m_state->engineError.clear();
    m_state->forgetWorld();
  }
  // Where there is no device, the world need not be read to know it.
  if (missing.empty() && !m_state->engineError.empty()) missing.add("device", m_state->engineError);
  if (missing.empty()) m_state->reader.read(m_world, missing, m_state->fallbacks);
  if (missing.empty()) checkSolverChoice(*m_state, missing);
  if (missing.empty() && !engineOf(*m_state)) missing.add("device", m_state->engineError);
  if (missing.empty() && (m_state->reader.hostBodiesChanged() || !m_state->reader.hostShares().empty()))
    catchUpContacts();
  // Not before it is known that the step runs on the device: callbacks of the narrowphase would be called twice.
  if (missing.empty()) hostPairsDone = findHostContacts(timeStep, hostPairsDone, missing);
  if (missing.empty()) {
    m_state->joints.read(m_world, timeStep, m_state->reader, missing,
                         btScalar(jointLead(m_state->settings)) * timeStep);
  }
  if (!missing.empty()) {
    m_state->fallbacks.addStep(missing);
    return false;
  }

  WorldInput& input = m_state->reader.input();
  const bool contacts = m_state->settings.m_contacts;
  const bool fromStock = m_state->lastPath == Path::Stock;
  // Pairs that the host collided until now bring their impulses, if the dispatcher has those of all pairs.
  if (fromStock || (contacts && m_state->lastPath == Path::Device && m_state->reader.hostBodiesChanged())) {
    input.replaceManifolds = true;
    input.manifolds = readManifolds(*m_world.getDispatcher(), m_state->reader, m_predictive);
  }
  if (fromStock) m_state->contacts.forget();
  if (!contacts) {
    releaseStockManifolds(m_world, *m_state);
    m_state->contacts.forget();
  }
  settings = settingsOf(timeStep);  // callbacks may have changed some
  listKeptAabbs(m_world, m_state->aabbsCurrent, m_state->reader);
  const std::shared_ptr<CrossCheck> check = crossCheckOf(*m_state);
  const bool checked = check && check->isDue();
  settings.keepContacts = m_state->settings.m_keepContacts || checked;
  if (!hostPairsDone && mayBatchSubsteps()) settings.substepsToFollow = m_state->substeps.toFollow();
  const bool last = settings.substepsToFollow == 0;
  m_world.getSolverInfo().m_timeStep = timeStep;

  const double reading = watch.lap();
  if (checked) {
    const Zone zone("crosscheck");
    check->beforeStep(m_world, m_state->reader, m_state->joints, *m_state->engine, m_state->lastPath == Path::Device,
                      m_state->results);
    watch.lap();
  }
  m_state->engine->setZoneSink(currentZoneSink());
  Status status = [&] {
    const Zone zone("beginStep");
    return m_state->engine->beginStep(input, settings);
  }();
  if (status == Status::Ok) {
    // The device works while the host finds its own pairs; pair callbacks come here, as in stock before the
    // solver.
    try {
      if (last && m_state->settings.m_hostQueries && !hostPairsDone) updateHostBroadphase(timeStep);
    } catch (...) {
      abandonStep(*m_state);
      throw;
    }
    m_state->statistics.m_deviceMs = watch.lap();
    {
      const Zone zone("finishStep");
      status = m_state->engine->finishStep(m_state->results);
    }
    m_state->statistics.m_waitMs = watch.lap();
    m_state->statistics.m_deviceMs += m_state->statistics.m_waitMs;
  }
  if (status != Status::Ok) {
    loseEngine(*m_state);
    missing.add("device", m_state->engineError);
    m_state->fallbacks.addStep(missing);
    return false;
  }
  m_state->hostContacts.writeBack(input, m_state->results);
  if (contacts && last) {
    m_state->contacts.write(m_world, m_state->reader, m_state->results, m_state->hostContacts.manifoldCount(),
                            !m_state->settings.m_hostQueries);
  }
  m_state->contactsBehind = contacts && !last;
  if (!m_state->aabbsUpdated) m_state->aabbsCurrent = false;
  if (settings.solver == Solver::Fast) m_state->joints.remember(m_state->results.jointImpulses);
  writeBackJoints(m_world, m_state->joints, input, m_state->results, timeStep);
  const bool unchanged = input.unchanged() && input.hostManifolds.empty();
  const bool wrote = writeBackBodies(timeStep);
  if (m_state->settings.m_islandTags) {
    writeIslandTags(m_world.getCollisionObjectArray(), m_state->reader, m_state->results);
  }
  m_state->reader.acceptResults(m_state->results);
  keepStatistics(*m_state);
  reportShares(*m_state, m_actions.size());
  m_state->statistics.m_translateMs = reading + watch.lap();
  m_state->lastPath = Path::Device;
  if (checked) {
    const Zone zone("crosscheck");
    const btGpuCrosscheckStep step =
        check->afterStep(m_state->reader, m_state->joints, m_state->results, timeStep, !settings.hostActivation);
    const auto callback = m_state->settings.m_crosscheckCallback;
    if (callback) callback(step);
  } else if (check) {
    check->skipStep();
  }
  watchRest(settings, unchanged && !wrote);
  return true;
}

// What of the collision detection is the host's: the pairs that the device can't collide, those that the application
// filters, and what is in the way of fast bodies. It needs the host's broadphase, whatever the settings say. Returns
// whether that is current now.
bool WorldStep::findHostContacts(btScalar timeStep, bool hostPairsDone, FallbackList& missing) {
  WorldInput& input = m_state->reader.input();
  const bool contacts = !m_state->reader.hostShares().empty(), swept = !m_state->reader.sweptBodies().empty();
  (m_world.*&WorldMembers::releasePredictiveContacts)();
  m_state->hostContacts.clear(input);
  input.onlyListedPairs = m_world.getPairCache()->getOverlapFilterCallback() != nullptr;
  if (!contacts && !swept && !input.onlyListedPairs) return hostPairsDone;
  if (!hostPairsDone) updateHostBroadphase(timeStep);
  const Zone zone("hostContacts");
  if (contacts) m_state->hostContacts.find(m_world, m_state->reader);
  // A callback may have changed bodies.
  const auto& dispatcher = static_cast<const btCollisionDispatcher&>(*m_world.getDispatcher());
  if (contacts && (gContactAddedCallback || globalContactCallback(dispatcher))) {
    m_state->reader.read(m_world, missing, m_state->fallbacks);
  }
  if (swept) {
    predictContacts(timeStep);
    m_state->hostContacts.add(m_predictive, m_state->reader);
  }
  const bool fast = solverOf(m_state->settings) == Solver::Fast;
  m_state->hostContacts.fill(input, m_state->reader, m_world.getSolverInfo().m_solverMode, fast, missing);
  if (input.onlyListedPairs) m_state->pairFilter.listPairs(m_world, m_state->reader);
  return true;
}

// Stock's createPredictiveContacts, for the bodies that ask for it. As there they are damped by then, and nothing else.
void WorldStep::predictContacts(btScalar timeStep) {
  const Zone zone("predictiveContacts");
  const WorldReader& reader = m_state->reader;
  DampedBodies damped(timeStep);
  damped.reserve(reader.input().bodyCount);
  std::vector<btRigidBody*> bodies;
  for (const std::uint32_t slot : reader.sweptBodies()) {
    btRigidBody* body = btRigidBody::upcast(reader.objectOf(slot));
    if (reader.slots()[slot].quarantined || reader.slots()[slot].deviceQuarantined) continue;
    damped.damp(*body, slot);
    bodies.push_back(body);
  }
  if (bodies.empty()) return;
  (m_world.*&WorldMembers::createPredictiveContactsInternal)(bodies.data(), static_cast<int>(bodies.size()), timeStep);
}

// Fast bodies that ask for it go no farther than to what they hit (btDiscreteDynamicsWorld::integrateTransforms).
bool WorldStep::writeBackBodies(btScalar timeStep) {
  const std::vector<std::uint32_t> fast = fastBodies(m_state->reader, m_state->results, timeStep);
  bool wrote = !fast.empty();
  if (fast.empty()) {
    wrote = btgpu::writeBackBodies(m_state->reader, m_state->results, timeStep);
  } else {
    writeBackInOrder(m_state->reader, m_state->results, timeStep, m_bodies, fast, [this, timeStep](btRigidBody& body) {
      btRigidBody* one = &body;
      (m_world.*&WorldMembers::integrateTransformsInternal)(&one, 1, timeStep);
    });
  }
  if (!(m_world.*&WorldMembers::m_applySpeculativeContactRestitution) || m_predictive.size() == 0) return wrote;
  // What stock does for restitution after it has integrated the bodies of its list.
  const int bodies = m_bodies.size();
  m_bodies.resizeNoInitialize(0);
  (m_world.*&WorldMembers::integrateTransforms)(timeStep);
  m_bodies.resizeNoInitialize(bodies);
  return true;
}

// Brings the dispatcher's manifolds to where the last substep left them, if that was not the last of its batch:
// something in between made the host's part in the next one larger.
void WorldStep::catchUpContacts() {
  if (!m_state->contactsBehind || !m_state->engine) return;
  const Zone zone("catchUpContacts");
  std::vector<Manifold> manifolds;
  if (m_state->engine->readManifolds(manifolds) != Status::Ok) return;
  m_state->contactsBehind = false;
  const auto& born = m_state->reader.input().born;
  const auto isGone = [&](std::uint32_t slot) {
    return !m_state->reader.objectOf(slot) || std::binary_search(born.begin(), born.end(), slot);
  };
  StepResults results;
  std::vector<Manifold> touching;
  for (const Manifold& m : manifolds) {
    if (m.pointCount == 0 || isGone(m.bodyA) || isGone(m.bodyB)) continue;
    results.contactKeys.push_back(pairKeyOf(m.bodyA, m.bodyB));
    touching.push_back(m);
    touching.back().bodyA = m_state->reader.ownerOf(m.bodyA);
    touching.back().bodyB = m_state->reader.ownerOf(m.bodyB);
  }
  results.contacts = {touching.data(), touching.size()};
  m_state->contacts.forget();
  m_state->contacts.write(m_world, m_state->reader, results, m_state->hostContacts.manifoldCount(),
                          !m_state->settings.m_hostQueries);
  m_state->contacts.forget();
}

// What stock's step does for the broadphase: AABBs that cover the predicted motion, then the overlapping
// pairs.
void WorldStep::updateHostBroadphase(btScalar timeStep) {
  const Zone zone("hostBroadphase");
  m_state->aabbsUpdated = true;
  if (m_world.getForceUpdateAllAabbs()) m_state->aabbsCurrent = true;
  predictTransforms(m_bodies, timeStep);
  if (overrides(&WorldMembers::updateAabbs)) {
    m_world.updateAabbs();
  } else {
    m_state->aabbs.update(m_world);
  }
  m_world.computeOverlappingPairs();
}

// Stock takes the island tag of a joint's body for an index, also of one that left the world, and then it is the tag
// that its last step in the world gave it. A body that only ever stepped on the device has none: the first island's
// will do.
void WorldStep::giveIslandTags() {
  for (int i = 0; i < m_constraints.size(); ++i) {
    for (btRigidBody* body : {&m_constraints[i]->getRigidBodyA(), &m_constraints[i]->getRigidBodyB()}) {
      if (!body->isStaticOrKinematicObject() && body->getIslandTag() < 0) body->setIslandTag(0);
    }
  }
}

void WorldStep::runStock(btScalar timeStep) {
  const Zone zone("stockStep");
  if (m_state->contactsBehind && m_state->engine) {
    FallbackList ignored;
    m_state->reader.read(m_world, ignored, m_state->fallbacks);
    catchUpContacts();
  }
  if (m_state->lastPath == Path::Device && m_state->engine && !m_state->settings.m_contacts) {
    // The contacts come along, so that the stack does not lose its warm start.
    std::vector<Manifold> manifolds;
    FallbackList ignored;
    m_state->reader.read(m_world, ignored, m_state->fallbacks);
    if (m_state->engine->readManifolds(manifolds) == Status::Ok) {
      updateHostBroadphase(timeStep);
      writeManifolds(manifolds, m_state->reader, m_world);
    }
  }
  giveIslandTags();
  m_state->rest.forget();
  if (m_world.getForceUpdateAllAabbs()) m_state->aabbsCurrent = true;
  m_state->lastPath = Path::Stock;
  ++m_state->statistics.m_stockSteps;
  if (const auto check = crossCheckOf(*m_state)) check->stockStep();
  const PreTickGuard guard(m_world.*&WorldMembers::m_internalPreTickCallback);
  m_stock(m_world, timeStep);
}

BTGPU_TRANSLATION_END
