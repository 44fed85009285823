// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/support/stage_bench.h"

#include <algorithm>

namespace btgpu {
namespace {

constexpr size_t kPairsPerBody = 8, kMinPairs = 64;
constexpr uint kColours = 16, kRounds = 64;

Capacities withDefaults(Capacities c, size_t bodies) {
  c.bodies = std::max(c.bodies, bodies);
  if (c.pairs == 0) c.pairs = std::max(kMinPairs, kPairsPerBody * bodies);
  if (c.colourLaunches == 0) c.colourLaunches = kColours;
  if (c.colourRounds == 0) c.colourRounds = kRounds;
  // Each colour and the serial batch may need a block of its own on top of the constraints.
  if (c.slots == 0) c.slots = c.pairs + (COLOUR_LIMIT + 1) * BTGPU_LANES;
  return c;
}

bool hasTorsion(const WorldInput& input) {
  return std::any_of(input.materials.values.begin(), input.materials.values.end(),
                     [](const BodyMaterial& m) { return m.rollingFriction != 0; });
}

}  // namespace

StepParams stepParamsOf(const StepSettings& s, const Capacities& c, bool torsionRows) {
  StepParams p{};
  const auto flag = [&p](bool on, uint bit) { p.flags |= on ? bit : 0u; };
  flag(s.useContinuous, STEP_USE_CONTINUOUS);
  flag(s.forceUpdateAllAabbs, STEP_FORCE_ALL_AABBS);
  flag(s.splitImpulse, STEP_SPLIT_IMPULSE);
  flag(s.warmStarting, STEP_WARM_START);
  flag(s.twoFrictionDirections, STEP_TWO_FRICTION);
  flag(s.frictionDirectionCaching, STEP_FRICTION_CACHING);
  flag(!s.velocityDependentFriction, STEP_NO_VELOCITY_FRICTION);
  flag(s.interleaveContactAndFriction, STEP_INTERLEAVE);
  flag(s.disableDeactivation, STEP_DISABLE_DEACTIVATION);
  flag(torsionRows, STEP_TORSION);
  flag(s.hostActivation, STEP_HOST_ACTIVATION);
  flag(s.wakeByContact, STEP_WAKE_BY_CONTACT);
  p.timeStep = s.timeStep;
  p.erp2 = s.erp2;
  p.globalCfm = s.globalCfm;
  p.splitImpulsePenetrationThreshold = s.splitImpulsePenetrationThreshold;
  p.splitImpulseTurnErp = s.splitImpulseTurnErp;
  p.linearSlop = s.linearSlop;
  p.warmStartingFactor = s.warmStartingFactor;
  p.sor = s.sor;
  p.restitutionVelocityThreshold = s.restitutionVelocityThreshold;
  p.maxGyroscopicForce = s.maxGyroscopicForce;
  p.contactThreshold = s.contactBreakingThreshold;
  p.deactivationTime = s.deactivationTime;
  p.colourLaunches = c.colourLaunches;
  p.serialLaunched = c.serialLaunched ? 1u : 0u;
  return p;
}

uint shapeTypesOf(const WorldInput& input) {
  uint types = 0;
  for (const Shape& s : input.shapes.values) types |= 1u << s.type;
  return types;
}

StageBench::StageBench(Queue& queue, const WorldInput& input, const StepSettings& settings, Capacities wanted)
    : m_queue(queue) {
  m_world.reserve(queue, withDefaults(wanted, input.bodyCount), settings.twoFrictionDirections, hasTorsion(input));
  m_world.oldPairCount.copyFromHost(queue, {0u});
  m_world.upload(queue, input);
  queue.finish();
  setParams(stepParamsOf(settings, m_world.capacities, hasTorsion(input)));
  setCounters({});
}

StepParams StageBench::params() { return read(m_world.params, 1).front(); }
void StageBench::setParams(const StepParams& params) { write(m_world.params, {params}); }
StepCounters StageBench::counters() { return read(m_world.counters, 1).front(); }
void StageBench::setCounters(const StepCounters& counters) { write(m_world.counters, {counters}); }

void StageBench::setPairs(const std::vector<Pair>& pairs) {
  std::vector<uint> items, bucketFirst;
  for (uint bucket = 0; bucket <= BUCKET_COUNT; ++bucket) {
    bucketFirst.push_back(static_cast<uint>(items.size()));
    for (uint i = 0; i < pairs.size(); ++i) {
      if (pairs[i].bucket == bucket) items.push_back(i);
    }
  }
  std::vector<ulong> keys;
  for (const Pair& p : pairs) keys.push_back(pairKeyOf(p.bodyA, p.bodyB));
  StepCounters c = counters();
  c.pairCount = static_cast<uint>(pairs.size());
  setCounters(c);
  write(m_world.pairCount, {c.pairCount});
  write(m_world.pairs, pairs);
  write(m_world.items, items);
  write(m_world.bucketFirst, bucketFirst);
  write(m_world.keys, keys);
}

void StageBench::setOldManifolds(const std::vector<Manifold>& manifolds) {
  std::vector<ulong> keys;
  for (const Manifold& m : manifolds) keys.push_back(pairKeyOf(m.bodyA, m.bodyB));
  write(m_world.oldManifolds, manifolds);
  write(m_world.oldKeys, keys);
  write(m_world.oldPairCount, {static_cast<uint>(manifolds.size())});
}

}  // namespace btgpu
