// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "60_colour_constraints.h"

#include <algorithm>

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/60_colour_constraints.cl";

}  // namespace

void ColourConstraints::colour(Queue& queue, DeviceWorld& world) {
  const uint capacity = static_cast<uint>(world.capacities.pairs);
  if (m_serialGreedy) {
    m_greedy.launch(queue, {1, 1}, capacity, world.counters, m_headers, m_bodyColours, m_colours);
    return;
  }
  const Grid grid = queue.device().grid(capacity);
  for (uint round = 0; round < world.capacities.colourRounds; ++round) {
    m_claim.launch(queue, grid, capacity, world.counters, m_headers, m_bodyColours, m_colours, m_claims[round % 2]);
    m_choose.launch(queue, grid, round, capacity, world.counters, m_headers, m_claims[round % 2],
                    m_claims[(round + 1) % 2], m_bodyColours, m_colours);
  }
}

ColourConstraints::ColourConstraints(ComputeDevice& device)
    : m_serialGreedy(device.shape() == KernelShape::Cpu),
      m_init(device, kFile, "colourInit"),
      m_layout(device, kFile, "layoutColours"),
      m_fill(device, kFile, "fillSlots"),
      m_sort(device),
      m_boundSearch(device) {
  if (m_serialGreedy) {
    m_greedy = Kernel(device, kFile, "colourGreedy");
  } else {
    m_claim = Kernel(device, kFile, "colourClaim");
    m_choose = Kernel(device, kFile, "colourChoose");
  }
}

void ColourConstraints::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("60_colour_constraints");
  const uint bodies = static_cast<uint>(world.bodyCount), capacity = static_cast<uint>(world.capacities.pairs);
  const uint slots = static_cast<uint>(world.capacities.slots);
  const Count count{capacity, &world.constraintCount};
  m_bodyColours.resize(queue, 2 * size_t{bodies});
  m_claims[0].resize(queue, bodies);
  m_claims[1].resize(queue, bodies);
  m_headers.resize(queue, capacity);
  m_colours.resize(queue, capacity);
  m_order.resize(queue, capacity);
  m_init.launch(queue, queue.device().grid(std::max(bodies, capacity)), bodies, capacity, world.counters,
                world.constraints, world.manifolds, world.steps, m_bodyColours, m_claims[0], m_claims[1], m_headers,
                m_colours, m_order);
  colour(queue, world);
  m_sort.pairs(queue, count, m_colours, m_order, {{0, 8}});
  m_boundSearch.lower(queue, count, m_colours, COLOUR_TABLE, m_colourFirst);
  m_layout.launch(queue, {1, 1}, slots, m_colourFirst, world.slotFirst, world.counters);
  m_fill.launch(queue, queue.device().grid(slots), slots, world.counters, m_colourFirst, world.slotFirst, m_order,
                m_headers, world.slots);
}

}  // namespace btgpu
