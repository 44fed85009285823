// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "70_solve_substeps.h"

#include <algorithm>

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/70_solve_substeps.cl";
constexpr const char* kJointFile = "stages/70_solve_joint_substeps.cl";

bool isBodyPass(uint pass) { return pass == SUB_MOVE || pass == SUB_BEGIN || pass == SUB_FINISH; }

}  // namespace

void SolveSubsteps::build(ComputeDevice& device) {
  if (m_storeImpulses.isBuilt()) return;
  if (device.shape() == KernelShape::Cpu) {
    m_inTeam = Kernel(device, kFile, "substepsInTeam");
  } else {
    m_colour = Kernel(device, kFile, "substepColour");
    m_rest = Kernel(device, kFile, "substepRest");
    m_bodies = Kernel(device, kFile, "substepBodies");
  }
  m_storeImpulses = Kernel(device, kFile, "storeSoftImpulses");
}

void SolveSubsteps::buildForJoints(ComputeDevice& device) {
  if (m_prepareJoints.isBuilt()) return;
  m_jointColour = Kernel(device, kJointFile, "substepJointColour");
  m_jointsSerial = Kernel(device, kJointFile, "substepJointsSerial");
  m_prepareJoints = Kernel(device, kJointFile, "prepareSoftJoints");
}

// The passes one after the other, `repeats` times, each time one substep further.
void SolveSubsteps::run(Queue& queue, DeviceWorld& world, const std::vector<uint>& passes, uint substep, uint repeats) {
  if (!m_inTeam.isBuilt()) {
    for (uint i = 0; i < repeats; ++i) {
      for (const uint pass : passes) runPass(queue, world, pass, substep + i);
    }
    return;
  }
  if (repeats == 0) return;
  uint sequence = 0;
  for (size_t i = 0; i < passes.size(); ++i) sequence |= passes[i] << (i * SUB_BITS);
  m_inTeam.launch(queue, queue.device().teamGrid(world.bodyCount), static_cast<uint>(world.bodyCount), substep, repeats,
                  sequence, world.counters, world.params, world.slotFirst, world.slots, world.solverMasses, world.steps,
                  world.solverBodies, world.substepStarts, world.softRows, world.rolls, world.solverTeam);
}

void SolveSubsteps::runPass(Queue& queue, DeviceWorld& world, uint pass, uint substep) {
  const Grid bodies = queue.device().grid(world.bodyCount);
  if (isBodyPass(pass)) {
    m_bodies.launch(queue, bodies, static_cast<uint>(world.bodyCount), pass, world.counters, world.params, world.steps,
                    world.solverBodies, world.substepStarts);
    return;
  }
  // A colour can't hold more constraints than there are bodies to move.
  const Grid grid{(bodies.global + SOLVE_GROUP - 1) / SOLVE_GROUP * SOLVE_GROUP, SOLVE_GROUP};
  for (uint colour = 0; colour < world.capacities.colourLaunches; ++colour) {
    m_colour.launch(queue, grid, colour, pass, substep, world.counters, world.params, world.slotFirst, world.slots,
                    world.solverMasses, world.solverBodies, world.softRows, world.rolls);
  }
  const size_t group = queue.device().groupSize();
  m_rest.launch(queue, {group, group}, world.capacities.colourLaunches, pass, substep, world.counters, world.params,
                world.slotFirst, world.slots, world.solverMasses, world.solverBodies, world.softRows, world.rolls);
}

void SolveSubsteps::prepareJoints(Queue& queue, DeviceWorld& world) {
  buildForJoints(queue.device());
  m_prepareJoints.launch(queue, queue.device().grid(world.jointCount), world.jointCount, world.counters, world.params,
                         world.joints, world.jointRows, world.lastJointImpulses, world.steps, world.softJointRows,
                         world.jointImpulses);
}

void SolveSubsteps::runJoints(Queue& queue, DeviceWorld& world, uint pass, uint substep) {
  if (world.jointIterations == 0) return;  // none has rows
  const auto launch = [&](Kernel& kernel, Grid grid, uint first, uint count) {
    kernel.launch(queue, grid, pass, substep, first, count, world.counters, world.params, world.jointOrder,
                  world.joints, world.jointRows, world.jointEffects, world.jointSolved, world.solverMasses,
                  world.solverBodies, world.softJointRows, world.jointImpulses);
  };
  // Back and forth: what pulls at the end of a chain is felt at its beginning at once.
  const bool back = pass == SUB_RELAX;
  const JointColours& colours = world.jointColours;
  const uint serial = colours.first.back() - colours.serialFirst();
  const auto launchSerial = [&] {
    if (serial > 0) launch(m_jointsSerial, {1, 1}, colours.serialFirst(), serial);
  };
  if (back) launchSerial();
  for (uint i = 0; i < colours.colourCount(); ++i) {
    const uint c = back ? colours.colourCount() - 1 - i : i;
    const uint count = colours.first[c + 1] - colours.first[c];
    launch(m_jointColour, queue.device().grid(count), colours.first[c], count);
  }
  if (!back) launchSerial();
}

void SolveSubsteps::enqueue(Queue& queue, DeviceWorld& world, const StepSettings& settings) {
  queue.enterStage("70_solve_substeps");
  build(queue.device());
  const bool joints = world.jointCount > 0 && world.jointIterations > 0;
  const uint last = static_cast<uint>(std::max(1, settings.substeps)) - 1;
  if (joints) prepareJoints(queue, world);
  if (joints && settings.warmStarting) runJoints(queue, world, SUB_WARM_START, 0);
  if (settings.warmStarting) run(queue, world, {SUB_WARM_START}, 0);
  if (!joints) {
    run(queue, world, {SUB_SOLVE, SUB_MOVE, SUB_RELAX, SUB_BEGIN}, 0, last);
    run(queue, world, {SUB_SOLVE, SUB_MOVE, SUB_RELAX, SUB_BOUNCE, SUB_FINISH}, last);
  } else {
    for (uint i = 0; i <= last; ++i) {
      runJoints(queue, world, SUB_SOLVE, i);
      run(queue, world, {SUB_SOLVE, SUB_MOVE}, i);
      runJoints(queue, world, SUB_RELAX, i);
      run(queue, world,
          i < last ? std::vector<uint>{SUB_RELAX, SUB_BEGIN} : std::vector<uint>{SUB_RELAX, SUB_BOUNCE, SUB_FINISH}, i);
    }
  }
  const uint slots = static_cast<uint>(world.capacities.slots);
  m_storeImpulses.launch(queue, queue.device().grid(slots), slots, world.counters, world.params, world.slots,
                         world.softRows, world.manifolds);
}

}  // namespace btgpu
