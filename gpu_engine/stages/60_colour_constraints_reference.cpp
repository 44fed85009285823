// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "60_colour_constraints_reference.h"

#include <algorithm>
#include <array>

#include "../../kernels/lib/colour.h"

namespace btgpu {
namespace {

using Taken = std::array<bool, COLOUR_LIMIT>;  // colours that a body's constraints have

uint movedBody(const std::vector<BodyStep>& steps, uint body) {
  return steps[body].angularVelocity.w != 0.0f ? body : NO_INDEX;
}

std::vector<SlotHeader> makeHeaders(const std::vector<uint>& constraints, const std::vector<Manifold>& manifolds,
                                    const std::vector<BodyStep>& steps) {
  std::vector<SlotHeader> headers;
  for (const uint m : constraints) {
    headers.push_back({movedBody(steps, manifolds[m].bodyA), movedBody(steps, manifolds[m].bodyB), m,
                       static_cast<uint>(manifolds[m].pointCount)});
  }
  return headers;
}

bool hasFixedBody(const SlotHeader& h) { return h.bodyA == NO_INDEX || h.bodyB == NO_INDEX; }

// First all constraints between two bodies that move, then those of one such body alone; both scattered.
std::vector<uint> choosingOrder(const std::vector<SlotHeader>& headers) {
  const uint bits = indexBits(static_cast<uint>(headers.size()));
  std::vector<uint> order(headers.size());
  for (uint c = 0; c < order.size(); ++c) order[c] = c;
  std::sort(order.begin(), order.end(), [&](uint a, uint b) { return permute(a, bits) < permute(b, bits); });
  std::stable_partition(order.begin(), order.end(), [&](uint c) { return !hasFixedBody(headers[c]); });
  return order;
}

std::vector<uint> greedyColours(const std::vector<SlotHeader>& headers, size_t bodyCount) {
  std::vector<Taken> taken(bodyCount + 1);  // the last one stands for all bodies that can't move
  const auto at = [&](uint body) -> Taken& { return taken[std::min<size_t>(body, bodyCount)]; };
  std::vector<uint> colours(headers.size(), COLOUR_SERIAL);
  for (const uint c : choosingOrder(headers)) {
    for (uint colour = 0; colour < COLOUR_LIMIT; ++colour) {
      if (at(headers[c].bodyA)[colour] || at(headers[c].bodyB)[colour]) continue;
      colours[c] = colour;
      for (const uint body : {headers[c].bodyA, headers[c].bodyB}) {
        if (body != NO_INDEX) taken[body][colour] = true;
      }
      break;
    }
  }
  return colours;
}

}  // namespace

ColoursReference colourConstraintsReference(const std::vector<uint>& constraints,
                                            const std::vector<Manifold>& manifolds,
                                            const std::vector<BodyStep>& steps) {
  ColoursReference out;
  const auto headers = makeHeaders(constraints, manifolds, steps);
  out.colours = greedyColours(headers, steps.size());
  for (uint colour = 0; colour <= COLOUR_SERIAL; ++colour) {
    out.slotFirst.push_back(static_cast<uint>(out.slots.size()));
    for (uint c = 0; c < headers.size(); ++c) {
      if (out.colours[c] != colour) continue;
      out.slots.push_back(headers[c]);
      if (colour == COLOUR_SERIAL)
        ++out.serialCount;
      else
        out.colourCount = colour + 1;
    }
    if (colour < COLOUR_SERIAL && out.slots.size() - out.slotFirst.back() > SMALL_COLOUR) out.largeColours = colour + 1;
    while (out.slots.size() % BTGPU_LANES != 0) out.slots.push_back({NO_INDEX, NO_INDEX, NO_INDEX, 0});
  }
  out.slotFirst.push_back(static_cast<uint>(out.slots.size()));
  return out;
}

}  // namespace btgpu
