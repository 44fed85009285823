// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "65_prepare_contacts_reference.h"

namespace btgpu {
namespace {

class HostPrepareContacts : public HostStage {
 public:
  HostPrepareContacts() : HostStage("65_prepare_contacts") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_in = {io.params(),
            io.readBodies(w.infos),
            io.readBodies(w.poses),
            io.readBodies(w.steps),
            io.readBodies(w.masses),
            io.readBodies(w.materials),
            io.read(w.slots, io.counters().slotCount)};
    m_before = io.read(w.manifolds, io.manifoldCount());
    m_expected = {};
    m_expected.manifolds = m_before;
    m_expected.rows = io.read(w.rows);
    m_expected.tangent2 = io.read(w.tangent2);
    m_expected.torsion = io.read(w.torsion);
    prepareContactsReference(m_in, m_expected);
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    io.write(w.solverBodies, m_expected.solverBodies);
    io.write(w.solverMasses, m_expected.solverMasses);
    io.write(w.manifolds, m_expected.manifolds);
    io.write(w.rows, m_expected.rows);
    io.write(w.tangent2, m_expected.tangent2);
    io.write(w.torsion, m_expected.torsion);
  }
  void check(StageIo& io, Contract& contract) override {
    DeviceWorld& w = io.world;
    checkPreparedContacts(
        contract, m_in, m_before,
        {io.readBodies(w.solverBodies), io.readBodies(w.solverMasses), io.read(w.manifolds, m_before.size()),
         io.read(w.rows), io.read(w.tangent2), io.read(w.torsion)},
        m_expected);
  }

 private:
  PrepareInput m_in;
  std::vector<Manifold> m_before;
  PrepareReference m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostPrepareContacts() { return std::make_unique<HostPrepareContacts>(); }

}  // namespace btgpu
