// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "95_gather_contacts_reference.h"

namespace btgpu {
namespace {

class HostGatherContacts : public HostStage {
 public:
  HostGatherContacts() : HostStage("95_gather_contacts") {}

  void compute(StageIo& io) override {
    m_expected = gatherContactsReference(io.read(io.world.manifolds, io.pairCount()), io.settings.allContacts);
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    io.write(w.touching, m_expected.touching);
    io.write(w.fresh, m_expected.fresh);
    StepCounters counters = io.counters();
    counters.touchingCount = static_cast<uint>(m_expected.touching.size());
    counters.freshCount = static_cast<uint>(m_expected.fresh.size());
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    const StepCounters counters = io.counters();
    contract.sameArray("touching manifold", io.read(io.world.touching, counters.touchingCount), m_expected.touching);
    contract.sameArray("fresh manifold", io.read(io.world.fresh, counters.freshCount), m_expected.fresh);
  }

 private:
  GatheredContacts m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostGatherContacts() { return std::make_unique<HostGatherContacts>(); }

}  // namespace btgpu
