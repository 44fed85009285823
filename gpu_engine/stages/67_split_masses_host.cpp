// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "67_split_masses_reference.h"

namespace btgpu {
namespace {

class HostSplitMasses : public HostStage {
 public:
  HostSplitMasses() : HostStage("67_split_masses") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_in = {io.params(),
            io.read(w.slots, io.counters().slotCount),
            io.read(w.split.copyFirst, w.bodyCount + 1),
            io.read(w.manifolds, io.manifoldCount()),
            io.readBodies(w.steps),
            io.readBodies(w.masses),
            io.readBodies(w.solverMasses),
            io.read(w.joints, w.jointCount),
            io.read(w.split.joints, w.jointCount),
            io.read(w.jointRows)};
    m_before = read(io);
    m_expected = splitMassesReference(m_in, m_before);
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    const SplitMassesState& v = m_expected.values;
    io.write(w.rows, v.rows);
    io.write(w.tangent2, v.tangent2);
    io.write(w.torsion, v.torsion);
    io.write(w.jointEffects, v.effects);
    io.write(w.split.jointRows, v.splitRows);
    io.write(w.split.copies, v.copies);
    io.write(w.split.copyMasses, v.copyMasses);
  }
  void check(StageIo& io, Contract& contract) override {
    checkSplitMasses(contract, m_in, m_before, read(io), m_expected);
  }

 private:
  SplitMassesState read(StageIo& io) {
    DeviceWorld& w = io.world;
    const size_t copies = m_in.copyFirst.back();
    return {io.read(w.rows),
            io.read(w.tangent2),
            io.read(w.torsion),
            io.read(w.jointEffects, m_in.jointRows.size()),
            io.read(w.split.jointRows, m_in.jointRows.size()),
            io.read(w.split.copies, copies),
            io.read(w.split.copyMasses, copies)};
  }

  SplitMassesInput m_in;
  SplitMassesState m_before;
  SplitMassesReference m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostSplitMasses() { return std::make_unique<HostSplitMasses>(); }

}  // namespace btgpu
