// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "65_prepare_soft_contacts_reference.h"

namespace btgpu {
namespace {

class HostPrepareSoftContacts : public HostStage {
 public:
  HostPrepareSoftContacts() : HostStage("65_prepare_soft_contacts") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_in = {io.params(),
            io.readBodies(w.infos),
            io.readBodies(w.poses),
            io.readBodies(w.steps),
            io.readBodies(w.masses),
            io.readBodies(w.materials),
            io.read(w.slots, io.counters().slotCount)};
    m_before = {};
    m_before.manifolds = io.read(w.manifolds, io.manifoldCount());
    m_before.rows = io.read(w.softRows);
    m_before.rolls = io.read(w.rolls);
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    PrepareSoftReference out = m_before;
    prepareSoftContactsReference(m_in, out);
    io.write(w.solverBodies, out.solverBodies);
    io.write(w.solverMasses, out.solverMasses);
    io.write(w.substepStarts, out.starts);
    io.write(w.manifolds, out.manifolds);
    io.write(w.softRows, out.rows);
    io.write(w.rolls, out.rolls);
    StepCounters counters = io.counters();
    counters.bouncing = out.bouncing;
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    DeviceWorld& w = io.world;
    PrepareSoftReference device;
    device.solverBodies = io.readBodies(w.solverBodies);
    device.solverMasses = io.readBodies(w.solverMasses);
    device.starts = io.readBodies(w.substepStarts);
    device.manifolds = io.read(w.manifolds, m_before.manifolds.size());
    device.rows = io.read(w.softRows);
    device.rolls = io.read(w.rolls);
    device.bouncing = io.counters().bouncing;
    checkPreparedSoftContacts(contract, m_in, m_before, device);
  }

 private:
  PrepareInput m_in;
  PrepareSoftReference m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostPrepareSoftContacts() { return std::make_unique<HostPrepareSoftContacts>(); }

}  // namespace btgpu
