// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "70_solve_substeps_reference.h"

namespace btgpu {
namespace {

class HostSolveSubsteps : public HostStage {
 public:
  HostSolveSubsteps() : HostStage("70_solve_substeps", {"steps", "substep starts"}) {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_params = io.params();
    m_steps = io.readBodies(w.steps);
    m_slots = io.read(w.slots, io.counters().slotCount);
    m_masses = io.readBodies(w.solverMasses);
    m_before = read(io);
  }
  void store(StageIo& io) override {
    SubstepReference solved = m_before;
    solveSubstepsReference(m_params, m_steps, m_slots, m_masses, solved);
    io.write(io.world.solverBodies, solved.bodies);
    io.write(io.world.manifolds, solved.manifolds);
    io.write(io.world.jointImpulses, solved.joints.impulses);
  }
  void check(StageIo& io, Contract& contract) override {
    checkSolvedSubsteps(contract, m_params, m_steps, m_slots, m_masses, m_before, read(io));
  }

 private:
  static SubstepReference read(StageIo& io) {
    DeviceWorld& w = io.world;
    SubstepReference state{io.readBodies(w.solverBodies),
                           io.read(w.softRows),
                           io.read(w.rolls),
                           io.read(w.manifolds, io.manifoldCount()),
                           {io.read(w.joints, w.jointCount), io.read(w.jointRows), io.read(w.jointEffects),
                            io.read(w.jointSolved, w.jointCount), io.read(w.jointOrder, w.jointColours.order.size()),
                            io.read(w.lastJointImpulses), io.read(w.jointImpulses)}};
    return state;
  }

  StepParams m_params{};
  std::vector<BodyStep> m_steps;
  std::vector<SlotHeader> m_slots;
  std::vector<SolverMass> m_masses;
  SubstepReference m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostSolveSubsteps() { return std::make_unique<HostSolveSubsteps>(); }

}  // namespace btgpu
