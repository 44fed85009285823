// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "joint_colours.h"

#include <algorithm>

namespace btgpu {
namespace {

static_assert(JOINT_COLOUR_LIMIT <= 32, "a body's colours are the bits of a uint");

// The lowest colour that neither body has yet, or JOINT_COLOUR_LIMIT.
uint lowestFree(uint taken) {
  uint colour = 0;
  while (colour < JOINT_COLOUR_LIMIT && taken >> colour & 1u) ++colour;
  return colour;
}

bool movesNothing(const Joint& j) { return j.bodyA == NO_INDEX && j.bodyB == NO_INDEX; }

// By joint: how many earlier joints it has to wait for, one after the other.
std::vector<uint> levelsOf(const std::vector<Joint>& joints, uint bodyCount) {
  std::vector<uint> next(bodyCount, 0), levels;
  for (const Joint& j : joints) {
    uint level = 0;
    for (const uint body : {j.bodyA, j.bodyB}) level = body == NO_INDEX ? level : std::max(level, next[body]);
    for (const uint body : {j.bodyA, j.bodyB}) {
      if (body != NO_INDEX) next[body] = level + 1;
    }
    levels.push_back(level);
  }
  return levels;
}

std::vector<uint> greedyColoursOf(const std::vector<Joint>& joints, uint bodyCount) {
  std::vector<uint> taken(bodyCount, 0), colours;  // taken: bit a colour
  for (const Joint& j : joints) {
    uint both = 0;
    for (const uint body : {j.bodyA, j.bodyB}) both |= body == NO_INDEX ? 0 : taken[body];
    const uint colour = lowestFree(both);
    for (const uint body : {j.bodyA, j.bodyB}) {
      if (body != NO_INDEX && colour < JOINT_COLOUR_LIMIT) taken[body] |= 1u << colour;
    }
    colours.push_back(colour);
  }
  return colours;
}

}  // namespace

JointColours colourJoints(const std::vector<Joint>& joints, uint bodyCount) {
  std::vector<uint> colours = levelsOf(joints, bodyCount);
  const bool few = std::all_of(colours.begin(), colours.end(), [](uint c) { return c < JOINT_ORDER_LIMIT; });
  if (!few) colours = greedyColoursOf(joints, bodyCount);
  std::vector<std::vector<uint>> batches(JOINT_COLOUR_LIMIT + 1);
  uint count = 0;
  for (uint i = 0; i < joints.size(); ++i) {
    if (movesNothing(joints[i])) continue;
    batches[colours[i]].push_back(i);
    if (colours[i] < JOINT_COLOUR_LIMIT) count = std::max(count, colours[i] + 1);
  }
  JointColours out;
  const auto append = [&out](const std::vector<uint>& batch) {
    out.first.push_back(static_cast<uint>(out.order.size()));
    out.order.insert(out.order.end(), batch.begin(), batch.end());
  };
  for (uint colour = 0; colour < count; ++colour) append(batches[colour]);
  append(batches[JOINT_COLOUR_LIMIT]);
  out.first.push_back(static_cast<uint>(out.order.size()));
  return out;
}

}  // namespace btgpu
