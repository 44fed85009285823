// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 60. Must be equal exactly: colours are integers and a pure function of the
// constraints.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/rows.h"

namespace btgpu {

struct ColoursReference {
  std::vector<uint> colours;      // of each constraint: below COLOUR_LIMIT, or COLOUR_SERIAL
  std::vector<uint> slotFirst;    // COLOUR_TABLE
  std::vector<SlotHeader> slots;  // whole blocks of BTGPU_LANES for each colour
  uint colourCount = 0;           // highest parallel colour + 1
  uint largeColours = 0;          // the same of those with more than SMALL_COLOUR constraints
  uint serialCount = 0;           // constraints in the serial batch
};

// One constraint after the other gets the lowest colour that no constraint of its two bodies has yet; a body that
// can't move does not count. They choose in the order of permute(index), those between two moving bodies before
// all others. `constraints` are indices into `manifolds`. Within a colour the constraints keep their order.
ColoursReference colourConstraintsReference(const std::vector<uint>& constraints,
                                            const std::vector<Manifold>& manifolds, const std::vector<BodyStep>& steps);

}  // namespace btgpu
