// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "30_find_pairs_reference.h"

namespace btgpu {
namespace {

// Of all pair finders: they leave the same.
class HostFindPairs : public HostStage {
 public:
  explicit HostFindPairs(const char* finder) : HostStage(finder) {}

  void compute(StageIo& io) override {
    m_keys = findPairsReference(io.readBodies(io.world.infos), io.readBodies(io.world.aabbs));
  }
  void store(StageIo& io) override {
    StepCounters counters = io.counters();
    counters.pairCount = static_cast<uint>(m_keys.size());
    if (m_keys.size() > io.world.capacities.pairs) {
      counters.overflow |= OVERFLOW_PAIRS;
    } else {
      io.write(io.world.keys, m_keys);
    }
    io.write(io.world.pairCount, std::vector<uint>{counters.pairCount});
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    const StepCounters counters = io.counters();
    contract.same("pair count", counters.pairCount, static_cast<double>(m_keys.size()));
    if (!counters.overflow) checkKeys(contract, io.read(io.world.keys, counters.pairCount));
  }

 private:
  void checkKeys(Contract& contract, const std::vector<ulong>& device) const {
    for (size_t i = 0; i < device.size() && i < m_keys.size(); ++i) {
      contract.at("pair {}, lower body", i);
      contract.same("index", double(device[i] >> 32), double(m_keys[i] >> 32));
      contract.at("pair {}, higher body", i);
      contract.same("index", double(device[i] & 0xffffffffu), double(m_keys[i] & 0xffffffffu));
    }
  }

  std::vector<ulong> m_keys;
};

}  // namespace

std::unique_ptr<HostStage> hostFindPairs() { return std::make_unique<HostFindPairs>("30_find_pairs"); }
std::unique_ptr<HostStage> hostFindPairsGrid() { return std::make_unique<HostFindPairs>("30_find_pairs_grid"); }
std::unique_ptr<HostStage> hostFindPairsSweep() { return std::make_unique<HostFindPairs>("30_find_pairs_sweep"); }
std::unique_ptr<HostStage> hostFindPairsIncremental() {
  return std::make_unique<HostFindPairs>("30_find_pairs_incremental");
}
std::unique_ptr<HostStage> hostFindPairsBruteForce() {
  return std::make_unique<HostFindPairs>("30_find_pairs_brute_force");
}

}  // namespace btgpu
