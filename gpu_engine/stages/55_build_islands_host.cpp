// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "55_build_islands_reference.h"

namespace btgpu {
namespace {

class HostBuildIslands : public HostStage {
 public:
  HostBuildIslands() : HostStage("55_build_islands") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_expected = buildIslandsReference(io.params(), io.readBodies(w.infos), io.readBodies(w.steps),
                                       io.readBodies(w.stepActivations), io.read(w.pairs, io.pairCount()),
                                       io.read(w.manifolds, io.manifoldCount()), io.read(w.joints, w.jointCount));
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    io.write(w.roots, m_expected.roots);
    io.write(w.stepActivations, m_expected.activations);
    io.write(w.solved, m_expected.solved);
    io.write(w.constraints, m_expected.constraints);
    io.write(w.constraintCount, std::vector<uint>{static_cast<uint>(m_expected.constraints.size())});
    io.write(w.jointSolved, m_expected.jointSolved);
    StepCounters counters = io.counters();
    counters.contactPoints = m_expected.contactPoints;
    counters.constraintCount = static_cast<uint>(m_expected.constraints.size());
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    DeviceWorld& w = io.world;
    const StepCounters counters = io.counters();
    contract.sameArray("root of body", io.readBodies(w.roots), m_expected.roots);
    contract.sameArray("activation of body", io.readBodies(w.stepActivations), m_expected.activations);
    contract.sameArray("solved, body", io.readBodies(w.solved), m_expected.solved);
    contract.sameArray("constraint", io.read(w.constraints, counters.constraintCount), m_expected.constraints);
    contract.sameArray("solved, joint", io.read(w.jointSolved, w.jointCount), m_expected.jointSolved);
    contract.same("contact points", counters.contactPoints, m_expected.contactPoints);
  }

 private:
  IslandsReference m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostBuildIslands() { return std::make_unique<HostBuildIslands>(); }

}  // namespace btgpu
