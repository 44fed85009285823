// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "90_update_activation_reference.h"

namespace btgpu {
namespace {

class HostUpdateActivation : public HostStage {
 public:
  HostUpdateActivation() : HostStage("90_update_activation") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_velocities = io.readBodies(w.velocities);
    m_activations = io.readBodies(w.stepActivations);
    updateActivationReference(io.params(), io.readBodies(w.infos), io.readBodies(w.dampings), m_velocities,
                              m_activations);
  }
  void store(StageIo& io) override {
    io.write(io.world.velocities, m_velocities);
    io.write(io.world.activations, m_activations);
  }
  void check(StageIo& io, Contract& contract) override {
    contract.sameArray("velocity of body", io.readBodies(io.world.velocities), m_velocities);
    contract.sameArray("activation of body", io.readBodies(io.world.activations), m_activations);
  }

 private:
  std::vector<BodyVelocity> m_velocities;
  std::vector<BodyActivation> m_activations;
};

}  // namespace

std::unique_ptr<HostStage> hostUpdateActivation() { return std::make_unique<HostUpdateActivation>(); }

}  // namespace btgpu
