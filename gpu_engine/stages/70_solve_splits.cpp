// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "70_solve_splits.h"

#include <algorithm>

namespace btgpu {
namespace {

// The kernels of the solver over colours: to them the copies are bodies.
constexpr const char* kFile = "stages/70_solve_velocities.cl";

}  // namespace

SolveSplits::SolveSplits(ComputeDevice& device)
    : m_inTeam(device.shape() == KernelShape::Cpu),
      m_solveJoints(device, kFile, "solveJointColour"),
      m_average(device, "stages/70_solve_splits.cl", "averageCopies"),
      m_storeImpulses(device, kFile, "storeImpulses") {
  if (m_inTeam) {
    m_solveInTeam = Kernel(device, kFile, "solveInTeam");
  } else {
    m_solveColour = Kernel(device, kFile, "solveColour");
  }
}

// The only colour there is.
void SolveSplits::solveContacts(Queue& queue, DeviceWorld& world, uint passes) {
  if (m_inTeam) {
    m_solveInTeam.launch(queue, queue.device().teamGrid(world.bodyCount), 1u, passes, world.counters, world.params,
                         world.slotFirst, world.slots, world.split.copyMasses, world.split.copies, world.rows,
                         world.tangent2, world.torsion, world.solverTeam);
    return;
  }
  const size_t items = queue.device().grid(world.capacities.slots).global;
  const Grid grid{(items + SOLVE_GROUP - 1) / SOLVE_GROUP * SOLVE_GROUP, SOLVE_GROUP};
  m_solveColour.launch(queue, grid, 0u, passes, world.counters, world.params, world.slotFirst, world.slots,
                       world.split.copyMasses, world.split.copies, world.rows, world.tangent2, world.torsion);
}

void SolveSplits::solveJoints(Queue& queue, DeviceWorld& world, uint iteration) {
  const uint count = static_cast<uint>(world.jointColours.order.size());
  if (count == 0) return;
  m_solveJoints.launch(queue, queue.device().grid(count), iteration, 0u, count, world.counters, world.jointOrder,
                       world.split.joints, world.split.jointRows, world.jointEffects, world.jointSolved,
                       world.split.copyMasses, world.split.copies, world.jointImpulses);
}

void SolveSplits::average(Queue& queue, DeviceWorld& world) {
  const uint bodies = static_cast<uint>(world.bodyCount);
  m_average.launch(queue, queue.device().grid(bodies), bodies, world.counters, world.params, world.split.copyFirst,
                   world.split.copies, world.solverBodies);
}

void SolveSplits::enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows) {
  queue.enterStage("70_solve_splits");
  if (settings.warmStarting) {
    solveContacts(queue, world, PASS_WARM_START);
    average(queue, world);
  }
  for (int i = 0; i < std::max(settings.iterations, world.jointIterations); ++i) {
    if (i < world.jointIterations) solveJoints(queue, world, static_cast<uint>(i));
    if (i < settings.iterations) {
      solveContacts(queue, world, PASS_NORMAL | PASS_FRICTION);
      if (torsionRows) solveContacts(queue, world, PASS_TORSION);
    }
    average(queue, world);
  }
  const uint slots = static_cast<uint>(world.capacities.slots);
  m_storeImpulses.launch(queue, queue.device().grid(slots), slots, world.counters, world.params, world.slots,
                         world.rows, world.tangent2, world.manifolds);
}

}  // namespace btgpu
