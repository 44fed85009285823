// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "joint_colours.h"

namespace btgpu {
namespace {

static_assert(JOINT_COLOUR_LIMIT <= 32, "a body's colours are the bits of a uint");

// The lowest colour that neither body has yet, or JOINT_COLOUR_LIMIT.
uint lowestFree(uint taken) {
  uint colour = 0;
  while (colour < JOINT_COLOUR_LIMIT && taken >> colour & 1u) ++colour;
  return colour;
}

}  // namespace

JointColours colourJoints(const std::vector<Joint>& joints, uint bodyCount) {
  std::vector<uint> taken(bodyCount, 0);  // bit a colour
  std::vector<std::vector<uint>> batches(JOINT_COLOUR_LIMIT + 1);
  uint colours = 0;
  for (uint i = 0; i < joints.size(); ++i) {
    const Joint& j = joints[i];
    if (j.bodyA == NO_INDEX && j.bodyB == NO_INDEX) continue;
    uint both = 0;
    for (const uint body : {j.bodyA, j.bodyB}) both |= body == NO_INDEX ? 0 : taken[body];
    const uint colour = lowestFree(both);
    batches[colour].push_back(i);
    if (colour == JOINT_COLOUR_LIMIT) continue;
    colours = colour >= colours ? colour + 1 : colours;
    for (const uint body : {j.bodyA, j.bodyB}) {
      if (body != NO_INDEX) taken[body] |= 1u << colour;
    }
  }
  JointColours out;
  const auto append = [&out](const std::vector<uint>& batch) {
    out.first.push_back(static_cast<uint>(out.order.size()));
    out.order.insert(out.order.end(), batch.begin(), batch.end());
  };
  for (uint colour = 0; colour < colours; ++colour) append(batches[colour]);
  append(batches[JOINT_COLOUR_LIMIT]);
  out.first.push_back(static_cast<uint>(out.order.size()));
  return out;
}

}  // namespace btgpu
