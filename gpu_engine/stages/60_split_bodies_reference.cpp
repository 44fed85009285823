// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "60_split_bodies_reference.h"

namespace btgpu {

SplitBodiesReference splitBodiesReference(const std::vector<uint>& constraints, const std::vector<Manifold>& manifolds,
                                          const std::vector<BodyStep>& steps, const std::vector<Joint>& joints,
                                          const std::vector<uint>& jointSolved) {
  SplitBodiesReference out;
  std::vector<std::vector<std::pair<uint*, uint*>>> ends(steps.size());  // of each body: who is told the copy
  for (const uint m : constraints) {
    out.slots.push_back({NO_INDEX, NO_INDEX, m, static_cast<uint>(manifolds[m].pointCount)});
  }
  out.slots.resize((constraints.size() + BTGPU_LANES - 1) / BTGPU_LANES * BTGPU_LANES,
                   {NO_INDEX, NO_INDEX, NO_INDEX, 0});
  for (size_t c = 0; c < constraints.size(); ++c) {
    const Manifold& m = manifolds[constraints[c]];
    const auto moves = [&](uint body) { return steps[body].angularVelocity.w != 0; };
    if (moves(m.bodyA)) ends[m.bodyA].push_back({&out.slots[c].bodyA, nullptr});
    if (moves(m.bodyB)) ends[m.bodyB].push_back({&out.slots[c].bodyB, nullptr});
  }
  out.joints = joints;
  for (size_t j = 0; j < joints.size(); ++j) {
    Joint& split = out.joints[j];
    split.bodyA = split.bodyB = NO_INDEX;
    const uint a = joints[j].bodyA, b = joints[j].bodyB;
    if (!jointSolved[j] || joints[j].rowCount == 0) continue;
    if (a != NO_INDEX) ends[a].push_back({&split.bodyA, a == b ? &split.bodyB : nullptr});
    if (b != NO_INDEX && a != b) ends[b].push_back({&split.bodyB, nullptr});
  }
  out.copyFirst.assign(1, 0);
  uint copies = 0;
  for (const auto& ofBody : ends) {
    for (const auto& [first, second] : ofBody) {
      *first = copies;
      if (second) *second = copies;
      ++copies;
    }
    out.copyFirst.push_back(copies);
  }
  return out;
}

}  // namespace btgpu
