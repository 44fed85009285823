// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "60_colour_constraints.h"

#include <fmt/format.h>

#include <algorithm>

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/60_colour_constraints.cl";
constexpr uint kLeftInTurn = 3;  // words of left[] that colourResident takes in turn

// Of the one group that does all rounds that are not worth a launch.
size_t restLanes(const ComputeDevice& device) {
  return device.device().getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>() >= 1024 ? 1024 : 256;
}

std::string optionsFor(const ComputeDevice& device) {
  return device.shape() == KernelShape::Gpu ? fmt::format("-DREST_LANES={}", restLanes(device)) : std::string();
}

}  // namespace

ColourConstraints::ColourConstraints(ComputeDevice& device) : m_init(device, kFile, "colourInit", optionsFor(device)) {
  const auto kernel = [&device](const char* name) { return Kernel(device, kFile, name, optionsFor(device)); };
  if (device.shape() == KernelShape::Cpu) {
    m_greedy = kernel("colourGreedy");
    return;
  }
  m_restLanes = restLanes(device);
  m_round = kernel("colourRound");
  m_rest = kernel("colourRest");
  m_resident = kernel("colourResident");
  m_count = kernel("countColours");
  m_scanRows = Kernel(device, "primitives/scan.cl", "scanRows");
  m_fill = kernel("fillSlots");
}

void ColourConstraints::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("60_colour_constraints");
  m_bodyColours.resize(queue, world.bodyCount);
  m_headers.resize(queue, world.capacities.pairs);
  m_colours.resize(queue, world.capacities.pairs);
  if (m_greedy.isBuilt()) {
    colourSerially(queue, world);
  } else {
    colourInRounds(queue, world);
    fillSlots(queue, world);
  }
}

void ColourConstraints::colourSerially(Queue& queue, DeviceWorld& world) {
  const uint bodies = static_cast<uint>(world.bodyCount), capacity = static_cast<uint>(world.capacities.pairs);
  m_fixed.resize(queue, capacity);
  m_init.launch(queue, queue.device().grid(std::max(bodies, capacity)), bodies, capacity, world.counters,
                world.constraints, world.manifolds, world.steps, m_bodyColours, m_headers);
  m_greedy.launch(queue, {1, 1}, capacity, static_cast<uint>(world.capacities.slots), world.counters, m_headers,
                  m_bodyColours, m_fixed, m_colours, world.slotFirst, world.slots);
}

void ColourConstraints::colourInRounds(Queue& queue, DeviceWorld& world) {
  const uint bodies = static_cast<uint>(world.bodyCount), capacity = static_cast<uint>(world.capacities.pairs);
  const uint groups = world.capacities.colourGroups, rounds = groups > 0 ? 0 : world.capacities.colourRounds;
  for (auto& claims : m_claims) claims.resize(queue, bodies);
  m_left.resize(queue, std::max(kLeftInTurn, rounds));
  const Grid grid = queue.device().grid(capacity);
  m_init.launch(queue, queue.device().grid(std::max(bodies, capacity)), bodies, capacity, std::max(kLeftInTurn, rounds),
                world.counters, world.constraints, world.manifolds, world.steps, m_bodyColours, m_claims[0],
                m_claims[1], m_claims[2], m_left, m_headers, m_colours);
  if (groups > 0) {
    m_resident.launch(queue, {size_t{groups} * RESIDENT_GROUP, RESIDENT_GROUP}, capacity, world.counters, m_headers,
                      m_claims[0], m_claims[1], m_claims[2], m_bodyColours, m_colours, m_left, world.solverTeam);
    return;
  }
  for (uint round = 0; round < rounds; ++round) {
    m_round.launch(queue, grid, round, capacity, world.counters, m_headers, m_claims[round % 3],
                   m_claims[(round + 1) % 3], m_claims[(round + 2) % 3], m_bodyColours, m_colours, m_left);
  }
  m_rest.launch(queue, {m_restLanes, m_restLanes}, rounds, capacity, world.counters, m_headers, m_left,
                m_claims[rounds % 3], m_claims[(rounds + 1) % 3], m_claims[(rounds + 2) % 3], m_bodyColours, m_colours);
}

void ColourConstraints::fillSlots(Queue& queue, DeviceWorld& world) {
  const uint capacity = static_cast<uint>(world.capacities.pairs);
  const Grid grid = queue.device().chunkGrid(capacity);
  const uint rows = COLOUR_LIMIT + 1, groups = static_cast<uint>(grid.groups());
  m_tables.resize(queue, size_t{rows} * groups);
  m_totals.resize(queue, rows);
  m_count.launch(queue, grid, capacity, world.counters, m_colours, m_tables);
  m_scanRows.launch(queue, {rows * grid.local, grid.local}, rows, groups, m_tables, m_totals);
  m_fill.launch(queue, grid, capacity, static_cast<uint>(world.capacities.slots), world.counters, m_headers, m_colours,
                m_tables, m_totals, world.slotFirst, world.slots);
}

}  // namespace btgpu
