// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// Colours for the constraints, and their slots: slots of one colour move different bodies.
// Reads constraints, manifolds, steps; writes slotFirst[] (where each colour begins) and slots[]. On the GPU shape a
// round is a launch, or all are one (docs/decisions/0025-solver-in-resident-groups.md), with the same result.
class ColourConstraints {
 public:
  explicit ColourConstraints(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void colourSerially(Queue& queue, DeviceWorld& world);
  void colourInRounds(Queue& queue, DeviceWorld& world);
  void fillSlots(Queue& queue, DeviceWorld& world);

  Kernel m_init;
  Kernel m_greedy;                                                  // the CPU shape's body
  Kernel m_round, m_rest, m_resident, m_count, m_scanRows, m_fill;  // the GPU shape's
  size_t m_restLanes = 0;
  DeviceArray<ulong> m_bodyColours{"body colours"};
  DeviceArray<SlotHeader> m_headers{"constraint headers"};
  DeviceArray<uint> m_colours{"colours"}, m_fixed{"constraints that wait"};
  DeviceArray<uint> m_claims[3] = {DeviceArray<uint>("claims"), DeviceArray<uint>("next claims"),
                                   DeviceArray<uint>("later claims")};
  DeviceArray<uint> m_left{"constraints left"}, m_tables{"colour tables"}, m_totals{"colour totals"};
};

}  // namespace btgpu
