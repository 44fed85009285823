// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "50_append_host_contacts_reference.h"

namespace btgpu {
namespace {

class HostAppendHostContacts : public HostStage {
 public:
  HostAppendHostContacts() : HostStage("50_append_host_contacts") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_counters = io.counters();
    m_manifolds = io.read(w.manifolds);
    m_count = appendHostContactsReference(w.capacities.pairs, io.read(w.hostManifolds, w.hostManifoldCount), m_counters,
                                          m_manifolds);
  }
  void store(StageIo& io) override {
    io.write(io.world.manifolds, m_manifolds);
    io.write(io.world.manifoldCount, std::vector<uint>{m_count});
    io.setCounters(m_counters);
  }
  void check(StageIo& io, Contract& contract) override {
    contract.same("manifold count", io.read(io.world.manifoldCount, 1).at(0), m_count);
    contract.same("overflow", io.counters().overflow, m_counters.overflow);
    m_manifolds.resize(std::min<size_t>(m_manifolds.size(), m_count));
    contract.sameArray("manifold", io.read(io.world.manifolds, m_manifolds.size()), m_manifolds);
  }

 private:
  StepCounters m_counters{};
  std::vector<Manifold> m_manifolds;
  uint m_count = 0;
};

}  // namespace

std::unique_ptr<HostStage> hostAppendHostContacts() { return std::make_unique<HostAppendHostContacts>(); }

}  // namespace btgpu
