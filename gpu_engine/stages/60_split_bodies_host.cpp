// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "60_split_bodies_reference.h"

namespace btgpu {
namespace {

class HostSplitBodies : public HostStage {
 public:
  HostSplitBodies() : HostStage("60_split_bodies") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_constraints = io.counters().constraintCount;
    m_expected = splitBodiesReference(io.read(w.constraints, m_constraints), io.read(w.manifolds, io.manifoldCount()),
                                      io.readBodies(w.steps), io.read(w.joints, w.jointCount),
                                      io.read(w.jointSolved, w.jointCount));
  }
  void store(StageIo& io) override {
    StepCounters counters = io.counters();
    const uint slotCount = static_cast<uint>(m_expected.slots.size());
    counters.colourCount = m_constraints > 0;
    counters.largeColours = counters.serialCount = 0;
    counters.slotCount = slotCount;
    std::vector<uint> slotFirst(COLOUR_TABLE, slotCount);
    slotFirst[0] = 0;
    io.write(io.world.slotFirst, slotFirst);
    io.write(io.world.split.copyFirst, m_expected.copyFirst);
    io.write(io.world.split.joints, m_expected.joints);
    if (slotCount > io.world.capacities.slots) {
      counters.overflow |= OVERFLOW_SLOTS;
    } else {
      io.write(io.world.slots, m_expected.slots);
    }
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    const StepCounters counters = io.counters();
    contract.same("colours", counters.colourCount, m_constraints > 0);
    contract.same("constraints in the serial batch", counters.serialCount, 0);
    contract.same("slots", counters.slotCount, static_cast<double>(m_expected.slots.size()));
    if (counters.overflow) return;
    contract.sameArray("slot", io.read(io.world.slots, counters.slotCount), m_expected.slots);
    contract.sameArray("first copy of body", io.read(io.world.split.copyFirst, m_expected.copyFirst.size()),
                       m_expected.copyFirst);
    contract.sameArray("split joint", io.read(io.world.split.joints, m_expected.joints.size()), m_expected.joints);
  }

 private:
  uint m_constraints = 0;
  SplitBodiesReference m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostSplitBodies() { return std::make_unique<HostSplitBodies>(); }

}  // namespace btgpu
