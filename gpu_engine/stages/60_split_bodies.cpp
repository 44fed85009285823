// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "60_split_bodies.h"

#include <algorithm>

#include "../../kernels/lib/colour.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/60_split_bodies.cl";

}  // namespace

SplitBodies::SplitBodies(ComputeDevice& device)
    : m_begin(device, kFile, "beginSplit"),
      m_list(device, kFile, "listEnds"),
      m_assign(device, kFile, "assignCopies"),
      m_sort(device),
      m_search(device) {}

void SplitBodies::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("60_split_bodies");
  const uint bodies = static_cast<uint>(world.bodyCount), slots = static_cast<uint>(world.capacities.slots);
  const uint constraints = static_cast<uint>(world.capacities.pairs), joints = world.jointCount;
  // Constraints that have no slot end the step.
  const size_t ends = 2 * (std::min<size_t>(constraints, slots) + joints);
  for (auto* array : {&m_keys, &m_ends}) array->resize(queue, ends);
  m_endCount.resize(queue, 1);
  world.split.joints.resize(queue, joints);
  m_begin.launch(queue, {1, 1}, constraints, slots, joints, world.counters, world.slotFirst, m_endCount);
  m_list.launch(queue, queue.device().grid(size_t{slots} + joints), bodies, constraints, joints, world.counters,
                world.constraints, world.manifolds, world.steps, world.joints, world.jointSolved, world.slots,
                world.split.joints, m_keys, m_ends);
  m_sort.pairs(queue, {ends, &m_endCount}, m_keys, m_ends, {{0, indexBits(bodies + 1)}});
  m_search.lower(queue, {ends, &m_endCount}, m_keys, size_t{bodies} + 1, world.split.copyFirst);
  m_assign.launch(queue, queue.device().grid(ends), bodies, constraints, world.counters, world.split.copyFirst, m_ends,
                  world.joints, world.slots, world.split.joints);
}

}  // namespace btgpu
