// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "60_batch_constraints_reference.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "../../kernels/lib/batches.h"

namespace btgpu {
namespace {

using Headers = std::vector<SlotHeader>;

Headers makeHeaders(const std::vector<uint>& constraints, const std::vector<Manifold>& manifolds,
                    const std::vector<BodyStep>& steps) {
  const auto moved = [&](uint body) { return steps[body].angularVelocity.w != 0.0f ? body : NO_INDEX; };
  Headers headers;
  for (const uint m : constraints) {
    headers.push_back(
        {moved(manifolds[m].bodyA), moved(manifolds[m].bodyB), m, static_cast<uint>(manifolds[m].pointCount)});
  }
  return headers;
}

std::vector<uint> movedBodies(const SlotHeader& h) {
  std::vector<uint> bodies;
  for (const uint body : {h.bodyA, h.bodyB}) {
    if (body != NO_INDEX) bodies.push_back(body);
  }
  return bodies;
}

// Power of two that is the side of a cell: all but a LONG_SHARE-th of the constraints between two bodies are shorter.
double cellSide(const Headers& headers, const std::vector<BodyPose>& poses) {
  std::vector<int> exponents;  // of the least powers of two above the lengths
  for (const SlotHeader& h : headers) {
    if (movedBodies(h).size() != 2) continue;
    const float4 a = poses[h.bodyA].position, b = poses[h.bodyB].position;
    const float x = std::fabs(a.x - b.x), y = std::fabs(a.y - b.y), z = std::fabs(a.z - b.z);
    const float longest = std::max({x, y, z});
    int exponent = -126;
    if (!std::isfinite(x + y + z)) {
      exponent = 129;
    } else if (longest >= 1.17549435e-38f) {
      std::frexp(longest, &exponent);
    }
    exponents.push_back(exponent);
  }
  if (exponents.empty()) return 1;
  std::sort(exponents.begin(), exponents.end());
  const size_t mayBeLonger = exponents.size() / LONG_SHARE;
  return std::ldexp(1.0, std::min(126, exponents[exponents.size() - 1 - mayBeLonger]));
}

long cellOfPosition(float position, double side) {
  const double place = std::floor(double(position) / side);
  if (!(place > -1073741824.0)) return -1073741824;
  return static_cast<long>(std::min(place, 1073741824.0));
}

uint groupOf(const SlotHeader& h, const std::vector<uint>& split, const std::vector<BodyPose>& poses, double side) {
  const std::vector<uint> bodies = movedBodies(h);
  const uint a = bodies.empty() ? 0 : bodies.front(), b = bodies.empty() ? 0 : bodies.back();
  if (split[SPLIT_KIND] == SPLIT_BY_INDEX) {
    const uint sets = split[SPLIT_GROUPS], setA = a % sets, setB = b % sets;
    return (sets - 1 - (setA ^ setB)) * sets + std::min(setA, setB);
  }
  const uint bits[] = {split[SPLIT_BITS_X], split[SPLIT_BITS_Y], split[SPLIT_BITS_Z]};
  const float4 pa = poses[a].position, pb = poses[b].position;
  const float axesA[] = {pa.x, pa.y, pa.z}, axesB[] = {pb.x, pb.y, pb.z};
  uint phase = 0, place = 0, shift = 0;
  for (uint axis = 0; axis < 3; ++axis) {
    const long ca = cellOfPosition(axesA[axis], side), cb = cellOfPosition(axesB[axis], side);
    if (std::labs(ca - cb) > 1) return SPACE_LONG * split[SPLIT_GROUPS];
    const long period = 2L << bits[axis];
    const long cell = ((std::min(ca, cb) % period) + period) % period;
    phase |= static_cast<uint>(cell % 2) << axis;
    place |= static_cast<uint>(cell / 2) << shift;
    shift += bits[axis];
  }
  if (bodies.size() < 2) phase = SPACE_SINGLE;
  return phase * split[SPLIT_GROUPS] + place;
}

// The constraints of one group, in the order in which they are tried.
std::vector<uint> scattered(const std::vector<uint>& group, const Headers& headers) {
  const uint bits = indexBits(std::max<uint>(1, static_cast<uint>(group.size())));
  std::vector<uint> order(group.size());
  for (uint i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](uint a, uint b) { return permute(a, bits) < permute(b, bits); });
  for (uint& i : order) i = group[i];
  std::stable_partition(order.begin(), order.end(), [&](uint c) { return movedBodies(headers[c]).size() == 2; });
  return order;
}

// Batches of a group, each in the order of the constraints; the last one is what fits no other.
std::vector<std::vector<uint>> batchesOf(const std::vector<uint>& group, const Headers& headers) {
  std::vector<std::vector<uint>> batches;
  std::vector<uint> left = scattered(group, headers);
  while (!left.empty() && batches.size() < BATCH_LIMIT) {
    std::set<uint> used;
    std::vector<uint> batch, later;
    for (const uint c : left) {
      const std::vector<uint> bodies = movedBodies(headers[c]);
      const bool available =
          std::none_of(bodies.begin(), bodies.end(), [&](uint b) { return used.count(markCell(b)); });
      for (const uint body : bodies) {
        if (available) used.insert(markCell(body));
      }
      (available ? batch : later).push_back(c);
    }
    std::sort(batch.begin(), batch.end());
    batches.push_back(batch);
    left = later;
  }
  batches.resize(BATCH_LIMIT);
  std::sort(left.begin(), left.end());
  batches.push_back(left);
  return batches;
}

constexpr SlotHeader kNoSlot = {NO_INDEX, NO_INDEX, NO_INDEX, 0};

void padTo(std::vector<SlotHeader>& slots, size_t block) {
  while (slots.size() % block != 0) slots.push_back(kNoSlot);
}

}  // namespace

BatchesReference batchConstraintsReference(const std::vector<uint>& split, const std::vector<uint>& constraints,
                                           const std::vector<Manifold>& manifolds, const std::vector<BodyStep>& steps,
                                           const std::vector<BodyPose>& poses) {
  BatchesReference out;
  const Headers headers = makeHeaders(constraints, manifolds, steps);
  const double side = cellSide(headers, poses);
  std::vector<std::vector<uint>> groups(size_t{split[SPLIT_PHASES]} * split[SPLIT_GROUPS]);
  for (uint c = 0; c < headers.size(); ++c) {
    out.groups.push_back(groupOf(headers[c], split, poses, side));
    groups[out.groups.back()].push_back(c);
  }
  std::vector<std::vector<uint>> serial;
  for (const auto& group : groups) {
    auto batches = batchesOf(group, headers);
    serial.push_back(batches.back());
    batches.pop_back();
    uint count = 0;
    for (uint b = 0; b < BATCH_LIMIT; ++b) {
      if (!batches[b].empty()) count = b + 1;
      out.batchFirst.push_back(static_cast<uint>(out.slots.size()));
      for (const uint c : batches[b]) out.slots.push_back(headers[c]);
      padTo(out.slots, BATCH_BLOCK);
    }
    out.groupBatches.push_back(count);
    out.batchCount = std::max(out.batchCount, count);
  }
  out.serialFirst = static_cast<uint>(out.slots.size());
  for (const auto& share : serial) {
    out.batchFirst.push_back(static_cast<uint>(out.slots.size()));
    for (const uint c : share) out.slots.push_back(headers[c]);
    out.serialCount += static_cast<uint>(share.size());
  }
  out.end = static_cast<uint>(out.slots.size());
  padTo(out.slots, BTGPU_LANES);
  return out;
}

}  // namespace btgpu
