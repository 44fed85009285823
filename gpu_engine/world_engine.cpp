// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "world_engine.h"

#include <algorithm>
#include <cstdlib>

#include "../kernels/shared/rows.h"
#include "debug/recorders.h"
#include "opencl/error.h"
#include "slots.h"
#include "step_params.h"

namespace btgpu {
namespace {

// Room to start with. Growth costs a repeated step, so a guess that fits most scenes is worth a little
// memory.
constexpr size_t kPairsPerBody = 6;
constexpr size_t kMinPairs = 256;
constexpr size_t kFirstPadding = 16 * BTGPU_LANES;
constexpr uint kFirstColours = 8, kFirstRounds = 24;
// Turns of all resident lanes in a colour up to which they beat launches; measured in decision 28.
constexpr size_t kResidentRounds = 4;

// Up at once, down by and by: after a calm moment the next impact should not find everything taken away.
uint approach(uint now, uint needed) { return needed >= now ? needed : now - (now - needed + 3) / 4; }

std::string fromEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

size_t withSpare(uint needed) { return size_t{needed} + needed / 4; }

// Zones a stage, closed in time also if launching one fails.
class StageZones {
 public:
  explicit StageZones(Queue& queue) : m_queue(queue) {}
  ~StageZones() { m_queue.leaveStages(); }
  StageZones(const StageZones&) = delete;
  StageZones& operator=(const StageZones&) = delete;

 private:
  Queue& m_queue;
};

}  // namespace

WorldEngine::WorldEngine(const EngineSettings& settings)
    : m_engineSettings(settings),
      m_device(ComputeDevice::open(settings.device, settings.debugKernels || ComputeDevice::debugKernelsWanted())),
      m_queue(m_device, settings.profile),
      m_hostStages(settings.hostStages.empty() ? fromEnvironment("BTGPU_HOST_STAGES") : settings.hostStages,
                   settings.checkStages || fromEnvironment("BTGPU_CHECK_STAGES") == "1"),
      m_pipeline(*m_device, m_hostStages),
      m_world(std::make_unique<DeviceWorld>()),
      m_residentGroups(m_device->residentGroups()) {
  m_queue.setRecorder(recorderFromEnvironment(*m_device));
}

WorldEngine::~WorldEngine() {
  try {
    m_queue.finish();
  } catch (const OpenClError&) {  // the device is lost, and nothing runs on it any more
  }
}

void WorldEngine::reset() {
  m_queue.finish();
  m_world = std::make_unique<DeviceWorld>();
  m_pipeline.forget();
  m_ahead = Ahead::None;
  m_contactsUnseen = false;
}

void WorldEngine::makeRoom(size_t bodyCount) {
  Capacities wanted = m_world->capacities;
  wanted.bodies = std::max(bodyCount, m_engineSettings.bodyCapacity);
  if (wanted.pairs == 0) {
    // A guess must not ask for more than the device gives in one piece; what a step really needs it may.
    const size_t most = m_device->description().largestAllocation / sizeof(Manifold);
    const size_t guess = std::max(kMinPairs, std::min(kPairsPerBody * bodyCount, most));
    wanted.pairs = std::max(guess, m_engineSettings.pairCapacity);
    wanted.slots = wanted.pairs / 2 + kFirstPadding;
    wanted.colourLaunches = kFirstColours;
    wanted.colourRounds = kFirstRounds;
    wanted.residentGroups = wanted.colourGroups = m_residentGroups;
  }
  if (m_traits.has(SHAPE_MESH)) wanted.triangleHits = std::max(wanted.triangleHits, wanted.pairs);
  reserve(wanted);
}

void WorldEngine::reserve(const Capacities& wanted) {
  const StepSettings& settings = m_flights[m_current].settings;
  m_world->reserve(m_queue, wanted, settings.twoFrictionDirections, m_traits.torsionRows);
  if (settings.solver == Solver::Fast) m_world->reserveSubsteps(m_queue, m_traits.torsionRows);
}

void WorldEngine::begin(const WorldInput& input, const StepSettings& settings) {
  m_waitsBefore = m_queue.waits();
  ++m_begun;
  m_input = &input;
  m_recoveredFrom.clear();
  try {
    start(input, settings);
  } catch (const OpenClError& e) {
    // A step ahead has the last finished one for its start, which is in place.
    m_ahead = Ahead::None;
    recover(e);
    start(input, settings);
  }
}

// gContactAddedCallback may give a point what its bodies don't have.
static bool haveRollingPoints(const std::vector<Manifold>& manifolds) {
  return std::any_of(manifolds.begin(), manifolds.end(), [](const Manifold& m) {
    return std::any_of(m.points, m.points + m.pointCount, [](const ContactPoint& p) { return p.combined.z != 0.0f; });
  });
}

void WorldEngine::start(const WorldInput& input, const StepSettings& settings) {
  m_prefetched = adoptAhead(input, settings);
  if (!m_prefetched) {
    m_pipeline.endContactReads(m_queue);
    throwAheadAway();
    Flight& flight = m_flights[m_current];
    flight.settings = settings;
    flight.contactsUnseen = m_contactsUnseen && !input.replaceManifolds;
    m_traits = traitsOf(input);
    if (input.replaceManifolds) m_oldPointsRoll = haveRollingPoints(input.manifolds);
    if (m_oldPointsRoll || haveRollingPoints(input.hostManifolds)) m_traits.torsionRows = true;
    launchCurrent(input);
  }
  if (mayRunAhead(input)) runAhead();
}

void WorldEngine::launchCurrent(const WorldInput& input) {
  Flight& flight = m_flights[m_current];
  {
    const Zone zone("upload");
    makeRoom(input.bodyCount);
    m_world->upload(m_queue, input);
    if (!flight.settings.forceUpdateAllAabbs) m_world->keepAabbs(m_queue, input);
    makeRoomFor(flight);
  }
  enqueue(flight, false);
}

// After a failed call: waits until nothing runs any more, gives memory back if that was lacking, and sees to it that
// all that the host knows comes again. Throws if the device does not do even that.
void WorldEngine::recover(const OpenClError& error) {
  const Zone zone("recover");
  m_recoveredFrom = error.what();
  m_queue.finish();
  if (m_ahead != Ahead::None) {
    m_ahead = Ahead::None;
    m_world->retreat();
  }
  if (error.kind() == OpenClError::Kind::OutOfMemory) {
    m_aheadAllowed = false;
    m_world->dropSpare();
  }
  m_world->forgetUploads(m_queue);
}

// True if the step that is asked for is the one that is under way.
bool WorldEngine::adoptAhead(const WorldInput& input, const StepSettings& settings) {
  const int next = 1 - m_current;
  if (m_ahead != Ahead::Running || !(m_flights[next].settings == settings) || !m_world->holds(input)) return false;
  m_current = next;
  m_ahead = Ahead::None;
  return true;
}

// The results of the last finished step are in place; its bodies come from the input once more.
void WorldEngine::throwAheadAway() {
  if (m_ahead == Ahead::None) return;
  const Zone zone("throwAheadAway");
  m_ahead = Ahead::None;
  m_queue.finish();
  m_world->forgetBodies(m_queue);
  if (!m_aheadAllowed) m_world->dropSpare();
}

// Whether the next substep can be known to start from nothing but what this one leaves on the device.
bool WorldEngine::mayRunAhead(const WorldInput& input) const {
  const StepSettings& s = m_flights[m_current].settings;
  return s.substepsToFollow > 0 && m_aheadAllowed && !m_hostStages.any() && !s.keepContacts && input.bodyCount > 0 &&
         input.born.empty() && !input.replaceManifolds && input.joints.empty() && input.hostManifolds.empty() &&
         input.hostAabbs.empty();
}

void WorldEngine::runAhead() {
  const Zone zone("launchAhead");
  const Flight& flight = m_flights[m_current];
  Flight& next = m_flights[1 - m_current];
  next.settings = flight.settings.following();
  next.contactsUnseen = flight.settings.contacts;
  try {
    makeRoomFor(next);
    m_world->advance(m_queue);
    m_ahead = Ahead::Broken;
    enqueue(next, true);
    m_ahead = Ahead::Running;
  } catch (const OpenClError& e) {  // the current step is on its way all the same
    if (e.kind() != OpenClError::Kind::OutOfMemory) return;
    m_aheadAllowed = false;
    if (m_ahead == Ahead::None) m_world->dropSpare();
  }
}

// The current step has to be seen to first; the one ahead has found that out and done nothing.
void WorldEngine::takeBackAhead() {
  if (m_ahead == Ahead::None) return;
  m_queue.finish();
  m_ahead = Ahead::None;
  m_world->retreat();
  if (!m_aheadAllowed) m_world->dropSpare();
}

void WorldEngine::enqueue(Flight& flight, bool ahead) {
  const Zone zone("launch");
  DeviceWorld& w = *m_world;
  const int launchesBefore = m_queue.launches();
  m_queue.enterStep(ahead ? m_begun : m_begun - 1);
  flight.params.assign(1, makeStepParams(flight.settings, m_traits.torsionRows));
  flight.params.front().hostManifoldCount = w.hostManifoldCount;
  if (flight.contactsUnseen) flight.params.front().flags |= STEP_CONTACTS_UNSEEN;
  w.params.copyFromHost(m_queue, flight.params, false);
  {
    const StageZones zones(m_queue);
    if (ahead) {
      m_pipeline.enqueueFollow(m_queue, w);
    } else {
      w.counters.copyFromHost(m_queue, m_noCounters, false);
    }
    if (m_device->debugKernels() && w.bodyCount > 0) w.spoilStepArrays(m_queue);
    if (w.bodyCount > 0) m_pipeline.enqueueStep(m_queue, w, flight.settings, m_traits);
  }
  m_queue.flush();
  enqueueReads(flight);
  m_queue.leaveStep();
  m_queue.flush();
  flight.launches = m_queue.launches() - launchesBefore;
}

void WorldEngine::makeRoomFor(Flight& flight) {
  const DeviceWorld& w = *m_world;
  flight.poses.resize(m_queue, w.bodyCount);
  flight.velocities.resize(m_queue, w.bodyCount);
  flight.activations.resize(m_queue, w.bodyCount);
  flight.roots.resize(m_queue, flight.settings.islandRoots ? w.bodyCount : 0);
  flight.jointSolved.resize(m_queue, w.jointCount);
  flight.jointImpulses.resize(m_queue, w.jointCount > 0 ? w.jointImpulses.size() : 0);
  flight.counters.resize(m_queue, 1);
}

bool WorldEngine::sendsContacts(const Flight& flight) const {
  return flight.settings.sendsContacts() && m_world->bodyCount > 0;
}

void WorldEngine::enqueueReads(Flight& flight) {
  const Zone zone("enqueueReads");
  const DeviceWorld& w = *m_world;
  flight.poses.readFrom(m_queue, w.poses.buffer());
  flight.velocities.readFrom(m_queue, w.velocities.buffer());
  flight.activations.readFrom(m_queue, w.activations.buffer());
  flight.roots.readFrom(m_queue, w.roots.buffer());
  flight.jointSolved.readFrom(m_queue, w.jointSolved.buffer());
  flight.jointImpulses.readFrom(m_queue, w.jointImpulses.buffer());
  flight.counters.readFrom(m_queue, w.counters.buffer(), &flight.done);
  if (!sendsContacts(flight)) return;
  const StageZones zones(m_queue);
  m_pipeline.enqueueContactReads(m_queue, *m_world, flight.settings);
}

void WorldEngine::await(const Flight& flight) {
  const Zone zone("wait");
  if (m_ahead == Ahead::None) {
    m_queue.finish();
  } else {
    m_queue.wait(flight.done);
  }
}

void WorldEngine::showResults(Flight& flight, StepResults& results) const {
  results.poses.show(flight.poses.data(), flight.poses.size());
  results.velocities.show(flight.velocities.data(), flight.velocities.size());
  results.activations.show(flight.activations.data(), flight.activations.size());
  flight.roots.copyTo(results.roots);
  flight.jointSolved.copyTo(results.jointSolved);
  flight.jointImpulses.copyTo(results.jointImpulses);
  results.counters = flight.counters[0];
}

void WorldEngine::finish(StepResults& results) {
  results.redos = 0;
  results.prefetched = m_prefetched;
  try {
    conclude(results);
  } catch (const OpenClError& e) {
    recover(e);
    m_pipeline.endContactReads(m_queue);
    launchCurrent(*m_input);
    conclude(results);
  }
  m_input = nullptr;
  results.recoveredFrom = m_recoveredFrom;
  takeFailures(results);
  results.differences = m_hostStages.takeDifferences();
  const Zone zone("saveProgram");
  m_device->programs().saveNext();
}

void WorldEngine::takeFailures(StepResults& results) {
  const Failures failures = m_queue.recorder() ? m_queue.recorder()->takeFailures(m_queue) : Failures();
  results.failedAssertions = failures.count;
  results.firstAssertion = failures.first;
}

void WorldEngine::conclude(StepResults& results) {
  Flight& flight = m_flights[m_current];
  await(flight);
  results.launches = flight.launches;
  while (flight.counters[0].overflow != 0) {
    const Zone zone("repeat");
    takeBackAhead();
    m_pipeline.endContactReads(m_queue);
    growAfterOverflow(flight.counters[0]);
    ++results.redos;
    enqueue(flight, false);
    await(flight);
    results.launches += flight.launches;
  }
  const Zone zone("download");
  showResults(flight, results);
  adaptLaunches(results.counters);
  if (results.counters.quarantined > 0) takeBackAhead();
  const int launchesBefore = m_queue.launches();
  readContacts(results);
  results.launches += m_queue.launches() - launchesBefore;
  results.quarantined.clear();
  if (results.counters.quarantined > 0) {
    const auto infos = m_world->infos.toVector(m_queue);
    for (uint i = 0; i < m_world->bodyCount; ++i) {
      if ((infos[i].flags & (BODY_QUARANTINED | BODY_CHILD)) == BODY_QUARANTINED) results.quarantined.push_back(i);
    }
  }
  if (m_ahead == Ahead::None) m_world->swapStepResults();
  m_contactsUnseen = flight.settings.contacts && !flight.settings.sendsContacts();
  results.waits = m_queue.waits() - m_waitsBefore;
}

void WorldEngine::readContacts(StepResults& results) {
  const StepSettings& settings = m_flights[m_current].settings;
  const size_t pairs = results.counters.pairCount, hosts = m_world->hostManifoldCount;
  results.hostManifolds.resize(hosts);
  m_queue.read(m_world->manifolds.buffer(), pairs * sizeof(Manifold), hosts * sizeof(Manifold),
               results.hostManifolds.data(), true);
  results.contactKeys.clear();
  results.contacts = {};
  if (sendsContacts(m_flights[m_current])) {
    const StageZones zones(m_queue);
    m_queue.enterStep(m_begun - 1);
    m_pipeline.finishContactReads(m_queue, *m_world, settings, results);
    m_queue.leaveStep();
  }
  const size_t all = settings.keepContacts ? pairs + hosts : 0;
  results.matchedManifolds.resize(all);
  results.matchedKeys.resize(settings.keepContacts ? pairs : 0);
  results.manifolds.resize(all);
  if (all == 0) return;
  m_queue.read(m_world->keys.buffer(), 0, pairs * sizeof(ulong), results.matchedKeys.data(), true);
  m_queue.read(m_world->matchedManifolds.buffer(), 0, all * sizeof(Manifold), results.matchedManifolds.data(), true);
  m_queue.read(m_world->manifolds.buffer(), 0, all * sizeof(Manifold), results.manifolds.data(), true);
}

void WorldEngine::readManifolds(std::vector<Manifold>& manifolds) {
  manifolds.clear();
  if (m_world->oldPairCount.empty()) return;
  manifolds.resize(m_world->oldPairCount.toVector(m_queue).front());
  m_queue.read(m_world->oldManifolds.buffer(), 0, manifolds.size() * sizeof(Manifold), manifolds.data(), true);
  if (m_world->childPoses.empty()) return;
  nameSlots(m_world->infos.toVector(m_queue), m_world->oldKeys.toVector(m_queue), manifolds);
}

// Makes room for what a step lacked that is to be repeated.
void WorldEngine::growAfterOverflow(const StepCounters& counters) {
  Capacities wanted = m_world->capacities;
  if (counters.overflow & OVERFLOW_PAIRS) wanted.pairs = withSpare(counters.pairCount + m_world->hostManifoldCount);
  if (counters.overflow & OVERFLOW_TRIANGLES) wanted.triangleHits = withSpare(counters.triangleHits);
  if (counters.overflow & OVERFLOW_SLOTS) wanted.slots = withSpare(counters.slotCount);
  if (counters.overflow & OVERFLOW_ABSENT) wanted.residentGroups = wanted.colourGroups = m_residentGroups = 0;
  reserve(wanted);
}

// Launches follow what the last step used: empty ones cost time, missing ones a repeated step. The result of
// a step does not depend on them.
void WorldEngine::adaptLaunches(const StepCounters& counters) {
  Capacities& c = m_world->capacities;
  c.colourLaunches = counters.largeColours;
  // Waits for each other are shorter than launches, while the groups don't have to go many times through a colour. With
  // more slots than that, more lanes than can be resident hide better what each of them waits for.
  const size_t lanes = size_t{m_residentGroups} * RESIDENT_GROUP;
  const bool few = counters.slotCount <= kResidentRounds * lanes * std::max(1u, counters.colourCount);
  c.residentGroups = few ? m_residentGroups : 0;
  const bool fit = counters.constraintCount <= size_t{m_residentGroups} * COLOUR_LIST;
  c.colourGroups = fit ? m_residentGroups : 0;
  // One more than were needed: a round too few is done by one group, which takes it longer than an empty launch.
  c.colourRounds = approach(c.colourRounds, counters.colourRounds > 0 ? counters.colourRounds + 1 : 0);
}

// What is left of a query that failed may still run on its arrays: they go once it has ended.
template <typename Work>
void WorldEngine::query(const Work& work) {
  if (!m_queries) m_queries = std::make_unique<Queries>(m_device);
  try {
    const StageZones zones(m_queries->queue);
    work(*m_queries);
  } catch (...) {
    try {
      m_queries->queue.finish();
    } catch (const OpenClError&) {  // the device is lost
    }
    m_queries.reset();
    throw;
  }
  m_device->programs().saveNext();
}

void WorldEngine::castRays(const QueryWorld& world, const Ray* rays, size_t count, RayResults& results) {
  query([&](Queries& q) {
    if (!q.rays) q.rays = std::make_unique<RayCaster>(*m_device);
    q.rays->cast(q.queue, q.rayArrays, world, rays, count, results);
  });
}

void WorldEngine::castSweeps(const QueryWorld& world, const Sweep* sweeps, size_t count, SweepResults& results) {
  query([&](Queries& q) {
    if (!q.sweeps) q.sweeps = std::make_unique<ConvexSweeper>(*m_device);
    q.sweeps->cast(q.queue, q.sweepArrays, world, sweeps, count, results);
  });
}

void WorldEngine::closestPoints(const QueryWorld& world, const std::vector<ClosestQuery>& queries,
                                std::vector<ClosestAnswer>& answers) {
  query([&](Queries& q) {
    if (!q.closest) q.closest = std::make_unique<ClosestPoints>(*m_device);
    q.closest->find(q.queue, world, queries, answers);
  });
}

EngineInfo describeDevice(const DeviceDescription& d) {
  EngineInfo info;
  info.device = d.name;
  info.vendor = d.vendor;
  info.platform = d.platform;
  info.version = d.version;
  info.driver = d.driver;
  info.type = d.type;
  info.index = d.index;
  info.computeUnits = d.computeUnits;
  info.globalMemory = d.globalMemory;
  info.largestAllocation = d.largestAllocation;
  return info;
}

EngineInfo WorldEngine::info() const {
  EngineInfo info = describeDevice(m_device->description());
  info.kernelShape = m_device->shape() == KernelShape::Cpu ? "cpu" : "gpu";
  const auto statistics = m_device->programs().statistics();
  info.programsBuilt = statistics.built;
  info.programsLoaded = statistics.loaded;
  info.programsRejected = statistics.rejected;
  info.buildSeconds = statistics.buildSeconds;
  if (m_world) m_world->forEachArray([&info](const auto& array) { info.worldMemory += array.capacityBytes(); });
  return info;
}

std::vector<StageProfile> WorldEngine::takeProfile(ZoneSink* sink) {
  std::vector<StageProfile> profile;
  for (const auto& t : m_queue.takeProfile(sink)) profile.push_back({t.stage, t.milliseconds, t.launches});
  return profile;
}

}  // namespace btgpu
