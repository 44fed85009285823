// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "10_apply_forces_reference.h"

namespace btgpu {
namespace {

class HostApplyForces : public HostStage {
 public:
  HostApplyForces() : HostStage("10_apply_forces") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_params = io.params();
    m_masses = io.readBodies(w.masses);
    m_steps =
        applyForcesReference(m_params, io.readBodies(w.infos), io.readBodies(w.poses), io.readBodies(w.velocities),
                             io.readBodies(w.forces), m_masses, io.readBodies(w.dampings));
  }
  void store(StageIo& io) override { io.write(io.world.steps, m_steps); }
  void check(StageIo& io, Contract& contract) override {
    checkAppliedForces(contract, m_params, m_masses, io.readBodies(io.world.steps), m_steps);
  }

 private:
  StepParams m_params{};
  std::vector<BodyMass> m_masses;
  std::vector<BodyStep> m_steps;
};

}  // namespace

std::unique_ptr<HostStage> hostApplyForces() { return std::make_unique<HostApplyForces>(); }

}  // namespace btgpu
