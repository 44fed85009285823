// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "70_solve_velocities.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/70_solve_velocities.cl";

}  // namespace

SolveVelocities::SolveVelocities(ComputeDevice& device)
    : m_solveColour(device, kFile, "solveColour"),
      m_solveSerial(device, kFile, "solveSerial"),
      m_storeImpulses(device, kFile, "storeImpulses") {}

void SolveVelocities::solveAll(Queue& queue, DeviceWorld& world, uint passes) {
  // A colour can't hold more constraints than there are bodies to move.
  const Grid grid = queue.device().grid(world.bodyCount);
  for (uint colour = 0; colour < world.capacities.colourLaunches; ++colour) {
    m_solveColour.launch(queue, grid, colour, passes, world.counters, world.params, world.slotFirst, world.slots,
                         world.solverMasses, world.solverBodies, world.rows, world.tangent2, world.torsion);
  }
  if (world.capacities.serialLaunched) {
    m_solveSerial.launch(queue, {1, 1}, passes, world.counters, world.params, world.slotFirst, world.slots,
                         world.solverMasses, world.solverBodies, world.rows, world.tangent2, world.torsion);
  }
}

void SolveVelocities::enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows) {
  queue.enterStage("70_solve_velocities");
  if (settings.warmStarting) solveAll(queue, world, PASS_WARM_START);
  for (int i = 0; i < settings.iterations; ++i) {
    if (settings.interleaveContactAndFriction) {
      solveAll(queue, world, PASS_NORMAL | PASS_FRICTION);
    } else {
      solveAll(queue, world, PASS_NORMAL);
      solveAll(queue, world, PASS_FRICTION);
    }
    if (torsionRows) solveAll(queue, world, PASS_TORSION);
  }
  const uint slots = static_cast<uint>(world.capacities.slots);
  m_storeImpulses.launch(queue, queue.device().grid(slots), slots, world.counters, world.params, world.slots,
                         world.rows, world.tangent2, world.manifolds);
}

}  // namespace btgpu
