// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "60_colour_constraints_reference.h"

namespace btgpu {
namespace {

class HostColourConstraints : public HostStage {
 public:
  HostColourConstraints() : HostStage("60_colour_constraints") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_expected = colourConstraintsReference(io.read(w.constraints, io.counters().constraintCount),
                                            io.read(w.manifolds, io.manifoldCount()), io.readBodies(w.steps));
  }
  void store(StageIo& io) override {
    StepCounters counters = io.counters();
    counters.colourCount = m_expected.colourCount;
    counters.largeColours = m_expected.largeColours;
    counters.serialCount = m_expected.serialCount;
    counters.slotCount = static_cast<uint>(m_expected.slots.size());
    if (m_expected.slots.size() > io.world.capacities.slots) {
      counters.overflow |= OVERFLOW_SLOTS;
    } else {
      io.write(io.world.slots, m_expected.slots);
    }
    io.write(io.world.slotFirst, m_expected.slotFirst);
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    const StepCounters counters = io.counters();
    contract.same("colours", counters.colourCount, m_expected.colourCount);
    contract.same("large colours", counters.largeColours, m_expected.largeColours);
    contract.same("constraints in the serial batch", counters.serialCount, m_expected.serialCount);
    contract.same("slots", counters.slotCount, static_cast<double>(m_expected.slots.size()));
    contract.sameArray("start of colour", io.read(io.world.slotFirst, COLOUR_TABLE), m_expected.slotFirst);
    if (!counters.overflow) contract.sameArray("slot", io.read(io.world.slots, counters.slotCount), m_expected.slots);
  }

 private:
  ColoursReference m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostColourConstraints() { return std::make_unique<HostColourConstraints>(); }

}  // namespace btgpu
