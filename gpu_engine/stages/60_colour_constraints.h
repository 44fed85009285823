// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"
#include "../primitives/primitives.h"

namespace btgpu {

// Colours for the constraints, and their slots: slots of one colour move different bodies.
// Reads constraints, manifolds, steps; writes slotFirst[] (where each colour begins) and slots[].
class ColourConstraints {
 public:
  explicit ColourConstraints(ComputeDevice& device);
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  void colour(Queue& queue, DeviceWorld& world);

  bool m_serialGreedy;  // the CPU shape's body
  Kernel m_init, m_greedy, m_claim, m_choose, m_layout, m_fill;
  RadixSort<uint> m_sort;
  BoundSearch m_boundSearch;
  DeviceArray<uint> m_bodyColours{"body colours"}, m_colours{"colours"}, m_order{"constraints by colour"};
  DeviceArray<uint> m_claims[2] = {DeviceArray<uint>("claims"), DeviceArray<uint>("next claims")};
  DeviceArray<uint> m_colourFirst{"colour starts"};
  DeviceArray<SlotHeader> m_headers{"constraint headers"};
};

}  // namespace btgpu
