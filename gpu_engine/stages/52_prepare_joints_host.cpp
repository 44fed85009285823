// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "52_prepare_joints_reference.h"

namespace btgpu {
namespace {

class HostPrepareJoints : public HostStage {
 public:
  HostPrepareJoints() : HostStage("52_prepare_joints") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_expected = prepareJointsReference(io.read(w.joints, w.jointCount), io.read(w.jointRows), io.readBodies(w.steps));
  }
  void store(StageIo& io) override {
    std::vector<JointEffect> effects;
    for (const JointEffectReference& e : m_expected)
      effects.push_back({static_cast<float>(e.jac), static_cast<float>(e.rhs)});
    io.write(io.world.jointEffects, effects);
    io.write(io.world.jointImpulses, std::vector<float>(effects.size(), 0.0f));
  }
  void check(StageIo& io, Contract& contract) override {
    checkPreparedJoints(contract, io.read(io.world.jointEffects, m_expected.size()),
                        io.read(io.world.jointImpulses, m_expected.size()), m_expected);
  }

 private:
  std::vector<JointEffectReference> m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostPrepareJoints() { return std::make_unique<HostPrepareJoints>(); }

}  // namespace btgpu
