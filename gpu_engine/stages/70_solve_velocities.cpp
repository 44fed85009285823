// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "70_solve_velocities.h"

#include <algorithm>

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/70_solve_velocities.cl";
constexpr const char* kPlain = "-DSOLVE_PLAIN";
constexpr const char* kIterations = "-DSOLVE_PLAIN -DSOLVE_PASSES=(PASS_NORMAL|PASS_FRICTION)";

// The first one in the lowest bits.
uint sequenceOf(const std::vector<uint>& passes) {
  uint sequence = 0;
  for (size_t i = 0; i < passes.size(); ++i) sequence |= passes[i] << (i * PASS_BITS);
  return sequence;
}

}  // namespace

SolveVelocities::SolveVelocities(ComputeDevice& device, const char* name)
    : m_name(name), m_inTeam(device.shape() == KernelShape::Cpu) {
  const char* options = m_inTeam ? "" : kPlain;  // the program that most steps need anyhow
  build(device, options, m_inTeam ? m_general : m_plain);
  if (!m_inTeam) build(device, kIterations, m_iterations);
  m_solveJointColour = Kernel(device, kFile, "solveJointColour", options);
  m_solveJointsSerial = Kernel(device, kFile, "solveJointsSerial", options);
  m_storeImpulses = Kernel(device, kFile, "storeImpulses", options);
}

void SolveVelocities::build(ComputeDevice& device, const char* options, ContactKernels& kernels) {
  kernels.atOnce = Kernel(device, kFile, m_inTeam ? "solveInTeam" : "solveResident", options);
  if (m_inTeam) return;
  kernels.colour = Kernel(device, kFile, "solveColour", options);
  kernels.rest = Kernel(device, kFile, "solveRest", options);
}

SolveVelocities::ContactKernels& SolveVelocities::kernelsFor(Queue& queue, const std::vector<uint>& passes) {
  if (!m_inTeam && m_isPlain) {
    return passes == std::vector<uint>{PASS_NORMAL | PASS_FRICTION} ? m_iterations : m_plain;
  }
  if (!m_general.atOnce.isBuilt()) build(queue.device(), "", m_general);
  return m_general;
}

void SolveVelocities::solve(Queue& queue, DeviceWorld& world, const std::vector<uint>& passes, int repeats) {
  const size_t resident = world.capacities.residentGroups;
  ContactKernels& kernels = kernelsFor(queue, passes);
  if (!m_inTeam && resident == 0) {
    for (int i = 0; i < repeats; ++i) {
      for (const uint p : passes) solveColours(queue, world, p, kernels);
    }
    return;
  }
  const Grid grid =
      m_inTeam ? queue.device().teamGrid(world.bodyCount) : Grid{resident * RESIDENT_GROUP, RESIDENT_GROUP};
  kernels.atOnce.launch(queue, grid, static_cast<uint>(repeats), sequenceOf(passes), world.counters, world.params,
                        world.slotFirst, world.slots, world.solverMasses, world.solverBodies, world.rows,
                        world.tangent2, world.torsion, world.solverTeam);
}

void SolveVelocities::solveColours(Queue& queue, DeviceWorld& world, uint passes, ContactKernels& kernels) {
  // A colour can't hold more constraints than there are bodies to move.
  const size_t items = queue.device().grid(world.bodyCount).global;
  const Grid grid{(items + SOLVE_GROUP - 1) / SOLVE_GROUP * SOLVE_GROUP, SOLVE_GROUP};
  for (uint colour = 0; colour < world.capacities.colourLaunches; ++colour) {
    kernels.colour.launch(queue, grid, colour, passes, world.counters, world.params, world.slotFirst, world.slots,
                          world.solverMasses, world.solverBodies, world.rows, world.tangent2, world.torsion);
  }
  const size_t group = queue.device().groupSize();
  kernels.rest.launch(queue, {group, group}, world.capacities.colourLaunches, passes, world.counters, world.params,
                      world.slotFirst, world.slots, world.solverMasses, world.solverBodies, world.rows, world.tangent2,
                      world.torsion);
}

void SolveVelocities::solveJoints(Queue& queue, DeviceWorld& world, uint iteration) {
  const auto launch = [&](Kernel& kernel, Grid grid, uint first, uint count) {
    kernel.launch(queue, grid, iteration, first, count, world.counters, world.jointOrder, world.joints, world.jointRows,
                  world.jointEffects, world.jointSolved, world.solverMasses, world.solverBodies, world.jointImpulses);
  };
  const JointColours& colours = world.jointColours;
  for (uint c = 0; c < colours.colourCount(); ++c) {
    const uint count = colours.first[c + 1] - colours.first[c];
    launch(m_solveJointColour, queue.device().grid(count), colours.first[c], count);
  }
  const uint serial = colours.first.back() - colours.serialFirst();
  if (serial > 0) launch(m_solveJointsSerial, {1, 1}, colours.serialFirst(), serial);
}

// Joints and contacts in launches of their own.
void SolveVelocities::solveInTurn(Queue& queue, DeviceWorld& world, const StepSettings& settings,
                                  const std::vector<uint>& passes, const std::vector<uint>& lastPasses) {
  if (settings.warmStarting) solve(queue, world, {PASS_WARM_START}, 1);
  const int last = settings.iterations - 1;
  for (int i = 0; i < world.jointIterations; ++i) {
    solveJoints(queue, world, static_cast<uint>(i));
    if (i <= last) solve(queue, world, i == last ? lastPasses : passes, 1);
  }
  if (world.jointIterations < last) solve(queue, world, passes, last - world.jointIterations);
  if (world.jointIterations <= last) solve(queue, world, lastPasses, 1);
}

void SolveVelocities::solveJointsInTeam(Queue& queue, DeviceWorld& world, const StepSettings& settings,
                                        const std::vector<uint>& passes, const std::vector<uint>& lastPasses) {
  if (!m_solveJointsInTeam.isBuilt())
    m_solveJointsInTeam = Kernel(queue.device(), "stages/70_solve_joints.cl", "solveJointsInTeam");
  const JointColours& colours = world.jointColours;
  m_solveJointsInTeam.launch(
      queue, queue.device().teamGrid(world.bodyCount), static_cast<uint>(world.jointIterations),
      static_cast<uint>(settings.iterations), settings.warmStarting ? sequenceOf({PASS_WARM_START}) : 0u,
      sequenceOf(passes), sequenceOf(lastPasses), colours.serialFirst(), colours.first.back() - colours.serialFirst(),
      world.counters, world.params, world.slotFirst, world.slots, world.solverMasses, world.solverBodies, world.rows,
      world.tangent2, world.torsion, world.solverTeam, world.jointOrder, world.jointBlockColours, world.jointLanes,
      world.jointBlockRows, world.joints, world.jointRows, world.jointEffects, world.jointSolved, world.jointImpulses,
      world.jointHeads, world.jointLaneRows);
}

void SolveVelocities::enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings, bool torsionRows) {
  queue.enterStage(m_name);
  m_isPlain = !torsionRows && !settings.twoFrictionDirections && !settings.interleaveContactAndFriction;
  std::vector<uint> passes = {PASS_NORMAL | PASS_FRICTION}, lastPasses = passes;
  if (!settings.interleaveContactAndFriction) lastPasses = {PASS_NORMAL, PASS_FRICTION};
  if (torsionRows) {
    passes.push_back(PASS_TORSION);
    lastPasses.push_back(PASS_TORSION);
  }
  if (world.jointIterations > 0 && jointsInTeam()) {
    solveJointsInTeam(queue, world, settings, passes, lastPasses);
  } else {
    solveInTurn(queue, world, settings, passes, lastPasses);
  }
  const uint slots = static_cast<uint>(world.capacities.slots);
  m_storeImpulses.launch(queue, queue.device().grid(slots), slots, world.counters, world.params, world.slots,
                         world.rows, world.tangent2, world.manifolds);
}

}  // namespace btgpu
