// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "joint_colours.h"

#include <algorithm>
#include <numeric>

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

uint rootOf(std::vector<uint>& parents, uint body) {
  while (parents[body] != body) body = parents[body] = parents[parents[body]];
  return body;
}

// By joint: the lowest body of those that joints tie to its own, or -1. Bullet's islands are those of contacts too,
// which nobody knows before the step.
std::vector<int> islandsOf(const std::vector<Joint>& joints, uint bodyCount) {
  std::vector<uint> parents(bodyCount);
  std::iota(parents.begin(), parents.end(), 0u);
  for (const Joint& j : joints) {
    if (j.islandA == NO_INDEX || j.islandB == NO_INDEX) continue;
    const uint a = rootOf(parents, j.islandA), b = rootOf(parents, j.islandB);
    parents[std::max(a, b)] = std::min(a, b);
  }
  std::vector<int> islands;
  for (const Joint& j : joints) {
    const uint member = j.islandA != NO_INDEX ? j.islandA : j.islandB;
    islands.push_back(member == NO_INDEX ? -1 : static_cast<int>(rootOf(parents, member)));
  }
  return islands;
}

// Quicksort around the middle element in which equal ones change places: what Bullet sorts joints with.
void sortAsBullet(std::vector<uint>& order, const std::vector<int>& keys, int low, int high) {
  int i = low, j = high;
  const int pivot = keys[order[static_cast<size_t>((low + high) / 2)]];
  const auto keyAt = [&](int place) { return keys[order[static_cast<size_t>(place)]]; };
  while (i <= j) {
    while (keyAt(i) < pivot) ++i;
    while (pivot < keyAt(j)) --j;
    if (i <= j) std::swap(order[static_cast<size_t>(i++)], order[static_cast<size_t>(j--)]);
  }
  if (low < j) sortAsBullet(order, keys, low, j);
  if (i < high) sortAsBullet(order, keys, i, high);
}

// By joint: how many joints before it in this order it has to wait for, one after the other.
std::vector<uint> levelsOf(const std::vector<Joint>& joints, const std::vector<uint>& order, uint bodyCount) {
  std::vector<uint> next(bodyCount, 0), levels(joints.size(), 0);
  for (const uint i : order) {
    const Joint& j = joints[i];
    for (const uint body : {j.bodyA, j.bodyB})
      levels[i] = body == NO_INDEX ? levels[i] : std::max(levels[i], next[body]);
    for (const uint body : {j.bodyA, j.bodyB}) {
      if (body != NO_INDEX) next[body] = levels[i] + 1;
    }
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

std::vector<uint> orderOfJoints(const std::vector<Joint>& joints, uint bodyCount) {
  std::vector<uint> order(joints.size());
  std::iota(order.begin(), order.end(), 0u);
  if (order.size() > 1) sortAsBullet(order, islandsOf(joints, bodyCount), 0, static_cast<int>(order.size()) - 1);
  return order;
}

JointColours colourJoints(const std::vector<Joint>& joints, uint bodyCount) {
  std::vector<uint> colours = levelsOf(joints, orderOfJoints(joints, bodyCount), bodyCount);
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

JointBlocks blocksOf(const JointColours& colours, const std::vector<Joint>& joints) {
  JointBlocks out;
  out.colours = {colours.colourCount(), 0};
  out.rows = {0};
  std::vector<uint> batch;
  for (uint c = 0; c < colours.colourCount(); ++c) {
    batch.clear();
    for (uint i = colours.first[c]; i < colours.first[c + 1]; ++i) {
      if (joints[colours.order[i]].rowCount > 0) batch.push_back(colours.order[i]);
    }
    std::stable_sort(batch.begin(), batch.end(),
                     [&](uint a, uint b) { return joints[a].rowCount > joints[b].rowCount; });
    for (size_t first = 0; first < batch.size(); first += JOINT_LANES) {
      for (size_t i = first; i < first + JOINT_LANES; ++i) out.lanes.push_back(i < batch.size() ? batch[i] : NO_INDEX);
      out.rows.push_back(out.rows.back() + joints[batch[first]].rowCount);
    }
    out.colours.push_back(static_cast<uint>(out.rows.size() - 1));
  }
  return out;
}

}  // namespace btgpu
