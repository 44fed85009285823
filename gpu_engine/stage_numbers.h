// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What stages get as plain numbers, as captures keep it.
#pragma once

#include <cstdint>
#include <vector>

#include "device_world.h"
#include "step_settings.h"

namespace btgpu {

// In the order of docs/capture.md: bodies, manifolds of the host, listed pairs (and LISTED_ONLY), joints, joints that
// move a body; room for pairs and for slots; iterations; 1 if all contacts are sent.
inline std::vector<std::uint64_t> stageNumbers(const DeviceWorld& w, const StepSettings& s) {
  return {w.bodyCount,
          w.hostManifoldCount,
          w.listed(),
          w.jointCount,
          w.jointColours.order.size(),
          w.capacities.pairs,
          w.capacities.slots,
          static_cast<std::uint64_t>(s.iterations),
          s.allContacts ? 1u : 0u};
}

constexpr std::size_t kStageNumbers = 9;

// The other way round. numbers: kStageNumbers of them.
inline void setStageNumbers(const std::vector<std::uint64_t>& numbers, DeviceWorld& w, StepSettings& s) {
  const auto number = [&](std::size_t i) { return static_cast<uint>(numbers.at(i)); };
  w.bodyCount = number(0);
  w.hostManifoldCount = number(1);
  w.listedCount = number(2) & ~LISTED_ONLY;
  w.onlyListed = (number(2) & LISTED_ONLY) != 0;
  w.jointCount = number(3);
  w.jointColours.order.resize(number(4));
  w.capacities.pairs = number(5);
  w.capacities.slots = number(6);
  s.iterations = static_cast<int>(number(7));
  s.allContacts = number(8) != 0;
}

}  // namespace btgpu
