// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "70_solve_batches.h"

#include <algorithm>

#include "../../kernels/lib/batches.h"
#include "60_batch_constraints.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/70_solve_batches.cl";

}  // namespace

SolveBatches::SolveBatches(ComputeDevice& device)
    : SolveVelocities(device, "70_solve_batches"),
      m_solveBatches(device, kFile, "solveBatches"),
      m_solveSerial(device, kFile, "solveSerialBatch") {}

void SolveBatches::enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows) {
  const std::vector<uint> split = splitForGroups(settings.groupSplit, world.bodyCount);
  m_phases = split[SPLIT_PHASES];
  m_groups = split[SPLIT_GROUPS];
  m_batchLaunches = settings.batchLaunches == BatchLaunches::Batch;
  SolveVelocities::enqueue(queue, world, settings, torsionRows);
}

void SolveBatches::solvePhase(Queue& queue, DeviceWorld& world, uint phase, uint passes) {
  const size_t local = queue.device().shape() == KernelShape::Gpu ? SOLVE_GROUP : 1;
  const Grid grid{std::min<size_t>(m_groups, queue.device().maxGroups()) * local, local};
  const auto launch = [&](uint firstBatch, uint count) {
    m_solveBatches.launch(queue, grid, phase, firstBatch, count, passes, world.counters, world.params,
                          world.batches.split, world.batches.groupBatches, world.batches.batchFirst, world.slots,
                          world.solverMasses, world.solverBodies, world.rows, world.tangent2, world.torsion);
  };
  // As many as the last step had; all others, if there are more now, share one.
  const uint apart = m_batchLaunches ? std::min<uint>(world.capacities.colourLaunches, BATCH_LIMIT) : 0;
  for (uint batch = 0; batch < apart; ++batch) launch(batch, 1);
  if (apart < BATCH_LIMIT) launch(apart, BATCH_LIMIT - apart);
}

void SolveBatches::solve(Queue& queue, DeviceWorld& world, const std::vector<uint>& passes, int repeats) {
  for (int i = 0; i < repeats; ++i) {
    for (const uint p : passes) {
      for (uint phase = 0; phase < m_phases; ++phase) solvePhase(queue, world, phase, p);
      m_solveSerial.launch(queue, {1, 1}, p, world.counters, world.params, world.slotFirst, world.slots,
                           world.solverMasses, world.solverBodies, world.rows, world.tangent2, world.torsion);
    }
  }
}

}  // namespace btgpu
