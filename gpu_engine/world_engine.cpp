// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "world_engine.h"

#include <algorithm>

#include "opencl/error.h"
#include "step_params.h"

namespace btgpu {
namespace {

// Room to start with. Growth costs a repeated step, so a guess that fits most scenes is worth a little
// memory.
constexpr size_t kPairsPerBody = 6;
constexpr size_t kMinPairs = 256;
constexpr uint kFirstColours = 8, kFirstRounds = 24, kSpareRounds = 4;

// Up at once, down by and by: after a calm moment the next impact should not find everything taken away.
uint approach(uint now, uint needed) { return needed >= now ? needed : now - (now - needed + 3) / 4; }

size_t withSpare(uint needed) { return size_t{needed} + needed / 4; }

}  // namespace

WorldEngine::WorldEngine(const EngineSettings& settings)
    : m_engineSettings(settings),
      m_device(ComputeDevice::open(settings.device)),
      m_queue(m_device, settings.profile),
      m_pipeline(*m_device),
      m_world(std::make_unique<DeviceWorld>()),
      m_params(1),
      m_counters(1) {}

WorldEngine::~WorldEngine() {
  try {
    m_queue.finish();
  } catch (const OpenClError&) {  // the device is lost, and nothing runs on it any more
  }
}

void WorldEngine::reset() {
  m_queue.finish();
  m_world = std::make_unique<DeviceWorld>();
}

void WorldEngine::makeRoom(size_t bodyCount) {
  Capacities wanted = m_world->capacities;
  wanted.bodies = std::max(bodyCount, m_engineSettings.bodyCapacity);
  if (wanted.pairs == 0) {
    // A guess must not ask for more than the device gives in one piece; what a step really needs it may.
    const size_t most = m_device->description().largestAllocation / sizeof(Manifold);
    const size_t guess = std::max(kMinPairs, std::min(kPairsPerBody * bodyCount, most));
    wanted.pairs = std::max(guess, m_engineSettings.pairCapacity);
    wanted.slots = wanted.pairs / 2 + 2 * kFirstColours * BTGPU_LANES;
    wanted.colourLaunches = kFirstColours;
    wanted.colourRounds = kFirstRounds;
  }
  m_world->reserve(m_queue, wanted, m_settings.twoFrictionDirections, m_traits.torsionRows);
}

void WorldEngine::begin(const WorldInput& input, const StepSettings& settings) {
  m_settings = settings;
  m_launchesBefore = m_queue.launches();
  m_waitsBefore = m_queue.waits();
  m_traits = traitsOf(input);
  makeRoom(input.bodyCount);
  m_world->upload(m_queue, input);
  if (!settings.forceUpdateAllAabbs) m_world->forgetStaleAabbs(m_queue, input);
  enqueue();
}

void WorldEngine::enqueue() {
  m_params.assign(1, makeStepParams(m_settings, m_traits.torsionRows));
  m_params.front().hostManifoldCount = m_world->hostManifoldCount;
  m_counters.assign(1, StepCounters{});
  m_world->params.copyFromHost(m_queue, m_params, false);
  m_world->counters.copyFromHost(m_queue, m_counters, false);
  if (m_world->bodyCount > 0) m_pipeline.enqueueStep(m_queue, *m_world, m_settings, m_traits);
  m_queue.flush();
}

void WorldEngine::enqueueReads(StepResults& results) {
  const size_t n = m_world->bodyCount;
  results.poses.resize(n);
  results.velocities.resize(n);
  results.activations.resize(n);
  m_queue.read(m_world->poses.buffer(), 0, n * sizeof(BodyPose), results.poses.data(), false);
  m_queue.read(m_world->velocities.buffer(), 0, n * sizeof(BodyVelocity), results.velocities.data(), false);
  m_queue.read(m_world->activations.buffer(), 0, n * sizeof(BodyActivation), results.activations.data(), false);
  const auto& w = *m_world;
  results.jointSolved.resize(w.jointCount);
  results.jointImpulses.resize(w.jointCount > 0 ? w.jointImpulses.size() : 0);
  if (w.jointCount > 0) {
    m_queue.read(w.jointSolved.buffer(), 0, w.jointCount * sizeof(uint), results.jointSolved.data(), false);
  }
  if (!results.jointImpulses.empty()) {
    m_queue.read(w.jointImpulses.buffer(), 0, results.jointImpulses.size() * sizeof(float),
                 results.jointImpulses.data(), false);
  }
  m_queue.read(m_world->counters.buffer(), 0, sizeof(StepCounters), &results.counters, false);
}

void WorldEngine::finish(StepResults& results) {
  results.redos = 0;
  enqueueReads(results);
  m_queue.finish();
  while (growAfterOverflow(results.counters)) {
    ++results.redos;
    enqueue();
    enqueueReads(results);
    m_queue.finish();
  }
  adaptLaunches(results.counters);
  readContacts(results);
  results.quarantined.clear();
  if (results.counters.quarantined > 0) {
    const auto infos = m_world->infos.toVector(m_queue);
    for (uint i = 0; i < m_world->bodyCount; ++i) {
      if (infos[i].flags & BODY_QUARANTINED) results.quarantined.push_back(i);
    }
  }
  m_world->swapStepResults();
  results.launches = m_queue.launches() - m_launchesBefore;
  results.waits = m_queue.waits() - m_waitsBefore;
  m_device->programs().saveNext();
}

void WorldEngine::readContacts(StepResults& results) {
  const size_t pairs = results.counters.pairCount, hosts = m_world->hostManifoldCount;
  results.hostManifolds.resize(hosts);
  m_queue.read(m_world->manifolds.buffer(), pairs * sizeof(Manifold), hosts * sizeof(Manifold),
               results.hostManifolds.data(), true);
  results.contactKeys.clear();
  results.contacts = {};
  if (m_settings.contacts && m_world->bodyCount > 0) {
    m_pipeline.enqueueContactReads(m_queue, *m_world, results);
    m_queue.finish();
  }
  const size_t all = m_settings.keepContacts ? pairs + hosts : 0;
  results.matchedManifolds.resize(all);
  results.manifolds.resize(all);
  if (all == 0) return;
  m_queue.read(m_world->matchedManifolds.buffer(), 0, all * sizeof(Manifold), results.matchedManifolds.data(), true);
  m_queue.read(m_world->manifolds.buffer(), 0, all * sizeof(Manifold), results.manifolds.data(), true);
}

void WorldEngine::readManifolds(std::vector<Manifold>& manifolds) {
  manifolds.clear();
  if (m_world->oldPairCount.empty()) return;
  manifolds.resize(m_world->oldPairCount.toVector(m_queue).front());
  m_queue.read(m_world->oldManifolds.buffer(), 0, manifolds.size() * sizeof(Manifold), manifolds.data(), true);
}

// True if the step has to be repeated.
bool WorldEngine::growAfterOverflow(const StepCounters& counters) {
  if (counters.overflow == 0) return false;
  Capacities wanted = m_world->capacities;
  if (counters.overflow & OVERFLOW_PAIRS) wanted.pairs = withSpare(counters.pairCount + m_world->hostManifoldCount);
  if (counters.overflow & OVERFLOW_SLOTS) wanted.slots = withSpare(counters.slotCount);
  if (counters.overflow & OVERFLOW_ROUNDS) wanted.colourRounds = std::max(2 * wanted.colourRounds, kFirstRounds);
  m_world->reserve(m_queue, wanted, m_settings.twoFrictionDirections, m_traits.torsionRows);
  return true;
}

// Launches follow what the last step used: empty ones cost time, missing ones a repeated step. The result of
// a step does not depend on them.
void WorldEngine::adaptLaunches(const StepCounters& counters) {
  Capacities& c = m_world->capacities;
  c.colourLaunches = counters.largeColours;
  c.colourRounds = approach(c.colourRounds, counters.colourRounds + kSpareRounds);
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
  return info;
}

std::vector<StageProfile> WorldEngine::takeProfile() {
  std::vector<StageProfile> profile;
  for (const auto& t : m_queue.takeProfile()) profile.push_back({t.stage, t.milliseconds, t.launches});
  return profile;
}

}  // namespace btgpu
