// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "20_update_aabbs_reference.h"

namespace btgpu {
namespace {

class HostUpdateAabbs : public HostStage {
 public:
  HostUpdateAabbs() : HostStage("20_update_aabbs", {"hull vertices"}) {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_expected = updateAabbsReference(io.params(), io.readBodies(w.infos), io.read(w.shapes), io.read(w.hullVertices),
                                      io.readBodies(w.poses), io.readBodies(w.steps), io.readBodies(w.activations),
                                      io.readBodies(w.oldAabbs), io.readBodies(w.hostAabbs));
    m_expected.outOfBounds += io.counters().outOfBounds;
  }
  void store(StageIo& io) override {
    io.write(io.world.aabbs, m_expected.aabbs);
    io.write(io.world.stepActivations, m_expected.activations);
    StepCounters counters = io.counters();
    counters.outOfBounds = m_expected.outOfBounds;
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    DeviceWorld& w = io.world;
    checkUpdatedAabbs(contract, {io.readBodies(w.aabbs), io.readBodies(w.stepActivations), io.counters().outOfBounds},
                      m_expected);
  }

 private:
  UpdatedAabbs m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostUpdateAabbs() { return std::make_unique<HostUpdateAabbs>(); }

}  // namespace btgpu
