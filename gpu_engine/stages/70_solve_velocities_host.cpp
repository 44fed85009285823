// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "70_solve_velocities_reference.h"

namespace btgpu {
namespace {

class HostSolveVelocities : public HostStage {
 public:
  explicit HostSolveVelocities(const char* name) : HostStage(name) {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_params = io.params();
    m_slots = io.read(w.slots, io.counters().slotCount);
    m_masses = io.readBodies(w.solverMasses);
    m_before = read(io);
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    SolveReference solved = m_before;
    solveVelocitiesReference(m_params, io.settings.iterations, m_slots, m_masses, solved);
    io.write(w.solverBodies, solved.bodies);
    io.write(w.rows, solved.rows);
    io.write(w.tangent2, solved.tangent2);
    io.write(w.torsion, solved.torsion);
    io.write(w.manifolds, solved.manifolds);
    io.write(w.jointImpulses, solved.joints.impulses);
  }
  void check(StageIo& io, Contract& contract) override {
    checkSolvedVelocities(contract, m_params, io.settings.iterations, m_slots, m_masses, m_before, read(io));
  }

 private:
  static SolveReference read(StageIo& io) {
    DeviceWorld& w = io.world;
    return {io.readBodies(w.solverBodies),
            io.read(w.rows),
            io.read(w.tangent2),
            io.read(w.torsion),
            io.read(w.manifolds, io.manifoldCount()),
            {io.read(w.joints, w.jointCount), io.read(w.jointRows), io.read(w.jointEffects),
             io.read(w.jointSolved, w.jointCount), io.read(w.jointOrder, w.jointColours.order.size()),
             io.read(w.jointImpulses)},
            {}};
  }

  StepParams m_params{};
  std::vector<SlotHeader> m_slots;
  std::vector<SolverMass> m_masses;
  SolveReference m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostSolveVelocities() {
  return std::make_unique<HostSolveVelocities>("70_solve_velocities");
}
// The slots lie in the order in which they are solved here too.
std::unique_ptr<HostStage> hostSolveBatches() { return std::make_unique<HostSolveVelocities>("70_solve_batches"); }

}  // namespace btgpu
