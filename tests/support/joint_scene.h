// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Joints made by hand or at random for stage tests: rows without a joint's geometry behind them.
#pragma once

#include "gpu_engine/world_input.h"
#include "tests/support/world_builder.h"

namespace btgpu {

struct JointScene {
  std::vector<Joint> joints;
  std::vector<JointRow> rows;

  // A joint between bodies that the solver moves (NO_INDEX: held) and whose islands it unites.
  Joint& add(uint a, uint b) {
    Joint j{};
    j.bodyA = j.islandA = a;
    j.bodyB = j.islandB = b;
    j.firstRow = static_cast<uint>(rows.size());
    j.iterations = 10;
    j.enabled = 1;
    j.damping = 1;
    j.leastMobility = 1.1920929e-7f;
    joints.push_back(j);
    return joints.back();
  }
  // A row of the last joint: unlimited, without an error to remove.
  JointRow& addRow(float4 linearA, float4 angularA, float4 linearB, float4 angularB) {
    rows.push_back({linearA, angularA, linearB, angularB});
    rows.back().linearB.w = -3.402823466e38f;
    rows.back().angularB.w = 3.402823466e38f;
    ++joints.back().rowCount;
    return rows.back();
  }
  void addRandomRow(std::mt19937& random) {
    const float4 direction = uniform3(random, -1, 1);
    JointRow& row = addRow(direction, uniform3(random, -1, 1), -direction, uniform3(random, -1, 1));
    row.linearA.w = uniform(random, -2, 2);
    row.angularA.w = random() % 4 ? 0 : uniform(random, 0, 0.3f);
    if (random() % 3 == 0) {  // a motor or a limit
      row.linearB.w = random() % 2 ? 0 : uniform(random, -0.5f, 0);
      row.angularB.w = uniform(random, 0, 0.5f);
    }
  }
  WorldInput addTo(WorldInput input) const {
    input.joints = joints;
    input.jointRows = rows;
    return input;
  }
};

// Joints of up to six rows between random bodies of a world; some are disabled, some have no row, some want another
// number of iterations. `moves`: by body, whether the solver moves it.
inline JointScene randomJoints(std::mt19937& random, const std::vector<bool>& moves, uint count) {
  JointScene scene;
  const uint bodies = static_cast<uint>(moves.size());
  for (uint i = 0; i < count; ++i) {
    const uint a = random() % bodies, b = random() % bodies;
    Joint& j = scene.add(moves[a] ? a : NO_INDEX, moves[b] && b != a ? b : NO_INDEX);
    if (random() % 8 == 0) j.iterations = static_cast<int>(random() % 25) + 1;
    if (random() % 8 == 0) j.damping = 0.5f;
    if (random() % 8 == 0) {
      j.enabled = 0;
      continue;
    }
    for (uint r = random() % 7; r > 0; --r) scene.addRandomRow(random);
  }
  return scene;
}

}  // namespace btgpu
