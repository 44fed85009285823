// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "pair_search.h"

#include <chrono>

namespace btgpu {
namespace {

constexpr size_t kPairsPerBody = 6, kMinPairs = 256;

}  // namespace

DevicePairSearch::DevicePairSearch(const std::string& device, PairFinder finder)
    : m_device(ComputeDevice::open(device)), m_queue(m_device, false), m_finder(finder), m_finders(*m_device) {}

void DevicePairSearch::makeRoom(size_t pairs) {
  m_world.capacities.pairs = std::max(m_world.capacities.pairs, pairs);
  m_world.keys.resize(m_queue, m_world.capacities.pairs);
}

void DevicePairSearch::setBodies(const std::vector<BodyInfo>& infos, const std::vector<Aabb>& aabbs) {
  m_world.bodyCount = static_cast<uint>(infos.size());
  m_world.infos.copyFromHost(m_queue, infos);
  m_world.aabbs.copyFromHost(m_queue, aabbs);
  m_world.pairCount.resize(m_queue, 1);
  m_world.counters.resize(m_queue, 1);
  if (m_world.capacities.pairs == 0) makeRoom(std::max(kMinPairs, kPairsPerBody * infos.size()));
}

double DevicePairSearch::findOnce(StepCounters& counters) {
  counters = {};
  m_world.counters.copyFromHost(m_queue, {counters});
  m_queue.finish();
  const auto start = std::chrono::steady_clock::now();
  m_finders.enqueue(m_queue, m_world, m_finder);
  m_queue.finish();
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
  m_queue.read(m_world.counters.buffer(), 0, sizeof counters, &counters, true);
  return took.count();
}

PairSearchTimes DevicePairSearch::find() {
  PairSearchTimes times;
  StepCounters counters;
  while (true) {
    times.milliseconds = findOnce(counters);
    if (!counters.overflow) break;
    makeRoom(counters.pairCount + size_t{counters.pairCount} / 4);
    times.repeated = true;
  }
  times.pairCount = m_pairCount = counters.pairCount;
  return times;
}

void DevicePairSearch::readKeys(std::vector<ulong>& keys) {
  keys.resize(m_pairCount);
  if (m_pairCount > 0) m_queue.read(m_world.keys.buffer(), 0, keys.size() * sizeof(ulong), keys.data(), true);
}

}  // namespace btgpu
