// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/support/stage_bench.h"

#include <algorithm>

#include "gpu_engine/pipeline.h"

namespace btgpu {
namespace {

constexpr size_t kPairsPerBody = 8, kMinPairs = 64;

Capacities withDefaults(Capacities c, size_t bodies) {
  c.bodies = std::max(c.bodies, bodies);
  if (c.pairs == 0) c.pairs = std::max(kMinPairs, kPairsPerBody * bodies);
  // Each colour and the serial batch may need a block of its own on top of the constraints.
  if (c.slots == 0) c.slots = c.pairs + (COLOUR_LIMIT + 1) * BTGPU_LANES;
  return c;
}

}  // namespace

StageBench::StageBench(Queue& queue, const WorldInput& input, const StepSettings& settings, Capacities wanted)
    : m_queue(queue) {
  const bool torsionRows = traitsOf(input).torsionRows;
  m_world.reserve(queue, withDefaults(wanted, input.bodyCount), settings.twoFrictionDirections, torsionRows);
  m_world.upload(queue, input);
  queue.finish();
  setParams(makeStepParams(settings, torsionRows));
  setCounters({});
}

StepParams StageBench::params() { return read(m_world.params, 1).front(); }
void StageBench::setParams(const StepParams& params) { write(m_world.params, {params}); }
StepCounters StageBench::counters() { return read(m_world.counters, 1).front(); }
void StageBench::setCounters(const StepCounters& counters) { write(m_world.counters, {counters}); }

void StageBench::setOverflow(uint overflow) {
  StepCounters c = counters();
  c.overflow = overflow;
  setCounters(c);
}

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
