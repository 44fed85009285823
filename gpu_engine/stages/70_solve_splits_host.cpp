// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "70_solve_velocities_reference.h"

namespace btgpu {
namespace {

// The reference of the solver over colours: to it the copies are bodies, which it averages after each iteration.
class HostSolveSplits : public HostStage {
 public:
  HostSolveSplits() : HostStage("70_solve_splits") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_params = io.params();
    m_copyFirst = io.read(w.split.copyFirst, w.bodyCount + 1);
    m_slots = io.read(w.slots, io.counters().slotCount);
    m_masses = io.read(w.split.copyMasses, m_copyFirst.back());
    m_bodies = io.readBodies(w.solverBodies);
    m_before = read(io);
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    SolveReference solved = m_before;
    solveVelocitiesReference(m_params, io.settings.iterations, m_slots, m_masses, solved);
    io.write(w.split.copies, solved.bodies);
    io.write(w.solverBodies, wholeBodies(solved.bodies));
    io.write(w.rows, solved.rows);
    io.write(w.tangent2, solved.tangent2);
    io.write(w.torsion, solved.torsion);
    io.write(w.manifolds, solved.manifolds);
    io.write(w.jointImpulses, solved.joints.impulses);
  }
  void check(StageIo& io, Contract& contract) override {
    const SolveReference device = read(io);
    checkSolvedVelocities(contract, m_params, io.settings.iterations, m_slots, m_masses, m_before, device);
    contract.sameArray("solver body", io.readBodies(io.world.solverBodies), wholeBodies(device.bodies));
  }

 private:
  SolveReference read(StageIo& io) {
    DeviceWorld& w = io.world;
    return {io.read(w.split.copies, m_copyFirst.back()),
            io.read(w.rows),
            io.read(w.tangent2),
            io.read(w.torsion),
            io.read(w.manifolds, io.manifoldCount()),
            {io.read(w.split.joints, w.jointCount), io.read(w.split.jointRows), io.read(w.jointEffects),
             io.read(w.jointSolved, w.jointCount), io.read(w.jointOrder, w.jointColours.order.size()),
             io.read(w.jointImpulses)},
            m_copyFirst};
  }
  // All copies of a body are alike at the end.
  std::vector<SolverBody> wholeBodies(const std::vector<SolverBody>& copies) const {
    std::vector<SolverBody> bodies = m_bodies;
    for (size_t i = 0; i < bodies.size(); ++i) {
      if (m_copyFirst[i] < m_copyFirst[i + 1]) bodies[i] = copies[m_copyFirst[i]];
    }
    return bodies;
  }

  StepParams m_params{};
  std::vector<uint> m_copyFirst;
  std::vector<SlotHeader> m_slots;
  std::vector<SolverMass> m_masses;
  std::vector<SolverBody> m_bodies;  // whole ones, before
  SolveReference m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostSolveSplits() { return std::make_unique<HostSolveSplits>(); }

}  // namespace btgpu
