// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "80_integrate_poses_reference.h"

namespace btgpu {
namespace {

class HostIntegratePoses : public HostStage {
 public:
  HostIntegratePoses() : HostStage("80_integrate_poses") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_params = io.params();
    m_steps = io.readBodies(w.steps);
    m_solverBodies = io.readBodies(w.solverBodies);
    m_before = read(io);
    m_expected = m_before;
    integratePosesReference(m_params, m_steps, m_solverBodies, io.readBodies(w.solved),
                            io.readBodies(w.stepActivations), m_expected);
  }
  void store(StageIo& io) override {
    io.write(io.world.infos, m_expected.infos);
    io.write(io.world.poses, m_expected.poses);
    io.write(io.world.velocities, m_expected.velocities);
    StepCounters counters = io.counters();
    counters.quarantined = m_expected.quarantined;
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    checkIntegratedPoses(contract, m_params, m_steps, m_solverBodies, m_before, read(io), m_expected);
  }

 private:
  static PosesReference read(StageIo& io) {
    DeviceWorld& w = io.world;
    return {io.readBodies(w.infos), io.readBodies(w.poses), io.readBodies(w.velocities), io.counters().quarantined};
  }

  StepParams m_params{};
  std::vector<BodyStep> m_steps;
  std::vector<SolverBody> m_solverBodies;
  PosesReference m_before, m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostIntegratePoses() { return std::make_unique<HostIntegratePoses>(); }

}  // namespace btgpu
